"""Teaching through a real driver, on the mock in lock-step, also over a slow line."""

import itertools
from collections.abc import Callable, Iterator

import pytest

from daq.contracts.errors import SafetyError
from daq.contracts.sample import SampleRow
from daq.driver import Controller
from daq.runner.arm_control import ArmControl, StoppedError
from daq.teaching.arm import TeachingError
from daq.teaching.controller_arm import ControllerArm
from daq.teaching.jog import JogCommand, jog
from daq.teaching.lead import lead_by_nose
from daq.teaching.performer import FollowingPerformer
from daq.teaching.program import Program
from daq.teaching.program_plan import plan_program, run_program
from daq.teaching.recording import RecordedPath
from tests.control_port import told_by
from tests.daq.servo_bench import pan_tilt
from tests.daq.teaching.stand_in import MA2000


@pytest.fixture(scope="module")
def controller() -> Iterator[Controller]:
    with Controller.connect("mock://?lock_step=1") as controller:
        yield controller


class WatchedArm(ControllerArm):
    """Keeps what it has delivered."""

    def __init__(self, controller: Controller, control: ArmControl) -> None:
        super().__init__(controller, control, MA2000, lambda: None)
        self.control = control
        self.seen: list[SampleRow] = []

    def next_sample(self) -> SampleRow:
        self.seen.append(super().next_sample())
        return self.seen[-1]


@pytest.fixture
def arm(controller: Controller) -> WatchedArm:
    return WatchedArm(controller, ArmControl(controller))


def test_a_limp_joint_is_recorded_and_held_again_where_it_is(arm: WatchedArm, controller: Controller) -> None:
    before = controller.gains()
    asked = iter(range(60))
    kept: list[RecordedPath] = []
    lead_by_nose(arm, MA2000, MA2000.limits, (3,), lambda: next(asked) >= 50, kept.append)
    (path,) = kept
    assert len(path.times) == 50
    assert controller.gains() == before
    row = arm.next_sample()
    assert row.position[2] == pytest.approx(path.positions[-1][0], abs=0.1)
    assert abs(row.error[2] / MA2000.calibration(3).rad_per_count) <= 10


def test_a_machine_file_of_another_controller_is_refused(controller: Controller, arm: WatchedArm) -> None:
    period = MA2000.controller.period.model_copy(update={"value": 0.03})
    other = MA2000.model_copy(update={"controller": MA2000.controller.model_copy(update={"period": period})})
    with pytest.raises(SafetyError, match="control period of 20 ms, the machine file ma2000 says 30 ms"):
        ControllerArm(controller, ArmControl(controller), other, lambda: None)
    with pytest.raises(SafetyError, match="has 6 joints, the machine file pan_tilt describes 2"):
        ControllerArm(controller, ArmControl(controller), pan_tilt(), lambda: None)
    before = controller.next_snapshot().set_points
    with pytest.raises(TeachingError, match="only while the arm is driven: it is idle"):
        arm.set_points({1: 600})
    assert controller.next_snapshot().set_points == before


def carried_out(controller: Controller, ended: Callable[[], str | None], *instructions: dict[str, object]) -> None:
    program = Program.model_validate({"name": "test", "machine": "ma2000", "instructions": instructions})
    control = ArmControl(controller)
    here = ControllerArm(controller, control, MA2000, lambda: None).next_sample()
    planned = plan_program(program, MA2000, here.set_point)
    performer = FollowingPerformer(controller, control, MA2000, MA2000.limits, ended, lambda _line: None)
    run_program(planned, MA2000, performer, lambda _line: None)
    performer.finish()


@pytest.mark.parametrize(
    "instruction", [{"kind": "wait", "duration": 5}, {"kind": "input", "line": 3, "on": True, "longest": 5}]
)
def test_a_restart_while_a_program_waits_freezes_the_arm(instruction: dict[str, object]) -> None:
    """The board takes other set points then: what comes next must not be sent from there."""
    with Controller.connect("mock://?lock_step=1") as controller:
        asked = itertools.count()

        def restarted() -> None:
            if next(asked) == 20:
                told_by(controller.link.control, "brown_out")

        with pytest.raises(TeachingError, match="restarted"):
            carried_out(controller, restarted, instruction, {"kind": "relative", "angles": {1: 0.2}})
        assert told_by(controller.link.control, "state")["frozen"]


def test_nothing_is_switched_after_a_stop(controller: Controller) -> None:
    asked = itertools.count()

    def ended() -> str | None:
        return "on request" if next(asked) >= 30 else None

    before = controller.process().outputs
    with pytest.raises(StoppedError, match="on request"):
        carried_out(
            controller, ended, {"kind": "wait", "duration": 0.6}, *[{"kind": "output", "line": 2, "on": True}] * 40
        )
    assert next(asked) <= 34, "the first that asks is told, and nobody else"
    controller.release(controller.status().stop)
    controller.write_outputs(0xFF, before)


def test_a_stop_in_the_moment_of_the_end_is_not_taken_for_a_good_end(arm: WatchedArm, controller: Controller) -> None:
    """The key that ends a jog and the stop arrive together: the stop counts."""

    def ended() -> bool:
        if len(arm.seen) < 10:
            return False
        arm.control.stop("on request, by STOP on the page or daq stop")
        return True

    with pytest.raises(StoppedError, match="or daq stop; the board confirmed: set points are frozen"):
        jog(arm, MA2000, MA2000.limits, lambda _row: None, ended, print)
    with pytest.raises(StoppedError):
        arm.set_points({1: 600})
    controller.release(controller.status().stop)


# ---- Teaching over a slow line, on the mock in lock-step: the guards know how far samples are apart


@pytest.fixture(scope="module", params=[38400, 9600])
def slow(request: pytest.FixtureRequest) -> Iterator[Controller]:
    with Controller.connect(f"mock://?lock_step=1&baud={request.param}") as slow:
        yield slow


@pytest.fixture
def slow_arm(slow: Controller) -> ControllerArm:
    return ControllerArm(slow, ArmControl(slow), MA2000, lambda: None)


def test_a_program_and_a_wait_take_the_time_that_was_planned(slow: Controller, slow_arm: ControllerArm) -> None:
    program = Program.model_validate(
        {"name": "test", "machine": "ma2000", "instructions": [{"kind": "relative", "angles": {1: 0.2}}]}
    )
    (planned,) = plan_program(program, MA2000, slow_arm.next_sample().set_point)
    (plan,) = planned.plans
    every = slow.line_rate(range(1, 7), range(1, 7)).every
    assert every > 1
    performer = FollowingPerformer(slow, ArmControl(slow), MA2000, MA2000.limits, lambda: None, lambda _line: None)
    before = slow.next_snapshot()
    performer.follow(plan)
    took = slow.next_snapshot().tick - before.tick
    assert len(plan) - every <= took < 1.1 * len(plan) + 4 * every
    control = ArmControl(slow)
    performer = FollowingPerformer(slow, control, MA2000, MA2000.limits, lambda: None, lambda _line: None)
    before = slow.next_snapshot().tick
    performer.observe(50)
    assert 50 <= slow.next_snapshot().tick - before < 70


def test_a_jog_moves_the_arm_at_the_speed_asked_for(slow: Controller, slow_arm: ControllerArm) -> None:
    begun = slow_arm.next_sample()
    last = begun.tick + 160
    seen = [begun]

    def commands(row: SampleRow) -> JogCommand:
        seen.append(row)
        return JogCommand({1: 0.2}, row.host_time)

    jog(slow_arm, MA2000, MA2000.limits, commands, lambda: seen[-1].tick >= last, print)
    settled = [slow_arm.next_sample() for _ in range(10)][-1]
    time = (seen[-1].tick - begun.tick) * slow.period_s
    assert settled.position[0] - begun.position[0] == pytest.approx(0.2 * time, abs=0.02)


def test_a_led_joint_is_held_again(slow: Controller, slow_arm: ControllerArm) -> None:
    before, asked = slow.gains(), iter(range(100))
    kept: list[RecordedPath] = []
    lead_by_nose(slow_arm, MA2000, MA2000.limits, (3,), lambda: next(asked) >= 30, kept.append)
    assert slow.gains() == before
    assert kept[0].times[1] == pytest.approx(0.02 * slow_arm.every)
