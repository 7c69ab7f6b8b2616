"""Teaching over a slow line, on the mock in lock-step: the guards know how far samples are apart."""

from collections.abc import Iterator

import pytest

from daq.contracts.sample import SampleRow
from daq.driver import Controller
from daq.runner.arm_control import ArmControl
from daq.teaching.controller_arm import ControllerArm
from daq.teaching.jog import JogCommand, jog
from daq.teaching.lead import lead_by_nose
from daq.teaching.performer import FollowingPerformer
from daq.teaching.program import Program
from daq.teaching.program_plan import plan_program
from daq.teaching.recording import RecordedPath
from tests.daq.teaching.stand_in import MA2000


@pytest.fixture(scope="module", params=[38400, 9600])
def controller(request: pytest.FixtureRequest) -> Iterator[Controller]:
    with Controller.connect(f"mock://?lock_step=1&baud={request.param}") as controller:
        yield controller


@pytest.fixture
def arm(controller: Controller) -> ControllerArm:
    return ControllerArm(controller, ArmControl(controller), MA2000, lambda: None)


def test_a_program_takes_the_time_that_was_planned(controller: Controller, arm: ControllerArm) -> None:
    program = Program.model_validate(
        {"name": "test", "machine": "ma2000", "instructions": [{"kind": "relative", "angles": {1: 0.2}}]}
    )
    (planned,) = plan_program(program, MA2000, arm.next_sample().set_point)
    (plan,) = planned.plans
    every = controller.line_rate(range(1, 7), range(1, 7)).every
    assert every > 1
    performer = FollowingPerformer(
        controller, ArmControl(controller), MA2000, MA2000.limits, lambda: None, lambda _line: None
    )
    before = controller.next_snapshot()
    performer.follow(plan)
    took = controller.next_snapshot().tick - before.tick
    assert len(plan) - every <= took < 1.1 * len(plan) + 4 * every


def test_a_wait_takes_its_time(controller: Controller) -> None:
    control = ArmControl(controller)
    performer = FollowingPerformer(controller, control, MA2000, MA2000.limits, lambda: None, lambda _line: None)
    before = controller.next_snapshot().tick
    performer.observe(50)
    assert 50 <= controller.next_snapshot().tick - before < 70


def test_a_jog_moves_the_arm_at_the_speed_asked_for(controller: Controller, arm: ControllerArm) -> None:
    begun = arm.next_sample()
    last = begun.tick + 160
    seen = [begun]

    def commands(row: SampleRow) -> JogCommand:
        seen.append(row)
        return JogCommand({1: 0.2}, row.host_time)

    jog(arm, MA2000, MA2000.limits, commands, lambda: seen[-1].tick >= last, print)
    settled = [arm.next_sample() for _ in range(10)][-1]
    time = (seen[-1].tick - begun.tick) * controller.period_s
    assert settled.position[0] - begun.position[0] == pytest.approx(0.2 * time, abs=0.02)


def test_a_led_joint_is_held_again(controller: Controller, arm: ControllerArm) -> None:
    before, asked = controller.gains(), iter(range(100))
    kept: list[RecordedPath] = []
    lead_by_nose(arm, MA2000, MA2000.limits, (3,), lambda: next(asked) >= 30, kept.append)
    assert controller.gains() == before
    assert kept[0].times[1] == pytest.approx(0.02 * arm.every)
