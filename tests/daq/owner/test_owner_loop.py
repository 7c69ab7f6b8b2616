"""The owner's loop when the robot is silent for a while although its line stays open."""

import time
from collections.abc import Iterator
from threading import Event
from types import SimpleNamespace
from typing import Any, cast

import pytest

from daq.contracts.errors import ReachError
from daq.driver import HardwareFaultError, NoSampleError
from daq.link import LinkState
from daq.owner import long_orders
from daq.owner.loop import serve
from daq.owner.messages import BEGINS_WITHIN, Answer, Reset, RunProgram
from daq.runner.arm_control import ArmControl
from firmware_protocol.commands import StatusFlag

SILENT = NoSampleError("mock://: no whole sample")


class SilentForAWhile:
    """A controller that gives a sample, then none twice while its line stays open, then samples again."""

    def __init__(self) -> None:
        self.link = SimpleNamespace(state=LinkState.CONNECTED, lock_step=True, url="mock://", stops=0)
        self.period_s = 0.0
        self.ticks = iter(range(1000))
        self.silence: Iterator[bool] = iter([False, True, True])

    def next_snapshot(self, _after: int | None = None) -> SimpleNamespace:
        if next(self.silence, False):
            raise SILENT
        return SimpleNamespace(tick=next(self.ticks), flags=StatusFlag(0))

    def line_rate(self) -> SimpleNamespace:
        return SimpleNamespace(every=1)

    def hello(self) -> None:
        """The greeting."""

    def status(self) -> SimpleNamespace:
        return SimpleNamespace(flags=StatusFlag(0))


class WithADamagedDrive(SilentForAWhile):
    """A controller that reports a damaged drive in place of these samples."""

    def __init__(self, *damaged: bool) -> None:
        super().__init__()
        self.silence = iter(())
        self.damaged = iter(damaged)
        self.greetings = self.stops = self.numbered = 0

    def number_stop(self) -> None:
        self.numbered += 1

    def next_snapshot(self, _after: int | None = None) -> SimpleNamespace:
        if next(self.damaged, False):
            raise HardwareFaultError("servo 2 reports overload")
        return super().next_snapshot()

    def hello(self) -> None:
        self.greetings += 1

    def stop(self) -> SimpleNamespace:
        self.stops += 1
        return SimpleNamespace(acknowledged=True)


def served(
    orders: dict[int, Any],
    turns: int = 8,
    activities: list[str] | None = None,
    anew: list[int] | None = None,
    controller: SilentForAWhile | None = None,
) -> tuple[list[str], list[Answer]]:
    """States of the arm as they are told, and answers; `orders` by the turn in which they come. `anew` gets how many
    answers there were whenever the state was told in any case."""
    controller, closing = controller or SilentForAWhile(), Event()
    states: list[str] = []
    answers: list[Answer] = []
    control = ArmControl(cast(Any, controller))
    numbers = iter(range(turns))

    def take(_timeout: float) -> Any:
        return orders.get(next(numbers))

    def tell_arm(**told: bool) -> None:
        if anew is not None and told.get("anew"):
            anew.append(len(answers))
        states.append(str(control.arm.state))
        if activities is not None:
            activities.append(robot.activity)
        if len(states) >= turns:
            closing.set()

    robot = SimpleNamespace(
        opening=SimpleNamespace(watched=True),
        controller=controller,
        control=control,
        tell_arm=tell_arm,
        read_gains=dict,
        activity="none",
        guardian=SimpleNamespace(cause=None, outdated=lambda _asked: False),
        number_stop=getattr(controller, "number_stop", lambda: None),
        end_cause=lambda: None,
        speaker=SimpleNamespace(ended=answers.append),
        inbox=SimpleNamespace(take=take, closing=closing, done=lambda: None),
    )
    serve(cast(Any, robot))
    return states, answers


def test_a_robot_that_answers_again_is_connected_again() -> None:
    states, _ = served({})
    assert states[:5] == ["idle", "disconnected", "disconnected", "idle", "idle"]


def test_a_damaged_drive_trips_once_and_the_robot_stays_connected() -> None:
    controller = WithADamagedDrive(False, True, True, True)
    states, _ = served({}, controller=controller)
    assert states[:6] == ["idle", "fault", "fault", "fault", "fault", "fault"]
    assert (controller.stops, controller.greetings) == (1, 0)
    assert controller.numbered >= 3, "else nobody could release the stop while the drive is damaged"


def test_a_robot_that_answers_again_with_a_damaged_drive_is_connected_and_at_fault() -> None:
    controller = WithADamagedDrive(False, True, True)
    controller.silence = iter([True])
    states, _ = served({}, controller=controller)
    assert states[:4] == ["disconnected", "idle", "fault", "fault"]


def test_what_would_move_a_robot_that_is_silent_is_refused() -> None:
    order = cast(Any, RunProgram).model_construct(number=7, asked=time.monotonic(), activity="program")
    states, answers = served({2: order})
    assert [(a.number, a.exit_code) for a in answers] == [(7, ReachError.exit_code)]
    assert "the link is lost; the service tries to reconnect" in answers[0].problem
    assert states[-1] == "idle"


def test_a_reset_is_told_before_its_answer_though_the_stop_before_it_never_was() -> None:
    """The service has noted the stop by then, and lets nobody resume the queue until it is told of another state."""
    told: list[int] = []
    _, answers = served({0: Reset(number=7, asked=time.monotonic(), stop=0, here=False)}, anew=told)
    assert [answer.number for answer in answers] == [7]
    assert told == [0]


def test_an_order_that_comes_late_moves_nothing() -> None:
    """The process was put aside with the order in its pipe, and goes on when nobody expects it any more. Its program is
    missing: a fault if it began."""
    late = time.monotonic() - BEGINS_WITHIN - 0.1
    order = cast(Any, RunProgram).model_construct(number=7, asked=late, activity="program")
    _, (answer,) = served({0: order})
    assert answer.exit_code == ReachError.exit_code
    assert "nothing was done" in answer.problem


@pytest.mark.parametrize("activity", ["program", "step"])
def test_what_is_carried_out_is_told_before_it_begins_and_by_its_own_name(
    activity: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    order = cast(Any, RunProgram).model_construct(number=7, asked=time.monotonic(), activity=activity)
    activities: list[str] = []

    def perform(_robot: Any, order: RunProgram) -> Answer:
        assert activities[-1] == activity
        return Answer(number=order.number)

    monkeypatch.setattr(long_orders, "perform", perform)
    _, answers = served({0: order}, activities=activities)
    assert answers == [Answer(number=7)]
    assert activities[:2] == [activity, "none"]
