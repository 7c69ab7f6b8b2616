"""A stop wins, in whatever moment it comes. The controller here only writes down what it is told."""

from collections.abc import Callable
from typing import Any, cast

import pytest

from daq.driver import Controller, StopConfirmation
from daq.runner.arm_control import ArmControl, StoppedError, stop_line
from daq.safety import Event, State


class Written:
    """What went to the line, in order."""

    def __init__(self) -> None:
        self.requests: list[str] = []
        self.during_release: Callable[[], Any] = lambda: None
        self.released: int | None = None
        self.answer = StopConfirmation(sent=True, acknowledged=True, tick=7)

    def stop(self) -> StopConfirmation:
        self.requests.append("stop")
        return self.answer

    def release(self, stop: int | None = None) -> None:
        self.requests.append("release")
        self.released = stop
        self.during_release()


def make() -> tuple[ArmControl, Written]:
    written = Written()
    return ArmControl(cast(Controller, written)), written


def test_a_stop_while_the_release_is_on_its_way_is_not_undone_by_it() -> None:
    control, written = make()
    written.during_release = lambda: control.stop("now")
    control.stop("before")
    written.requests.clear()
    with pytest.raises(StoppedError, match="now"):
        control.handle(Event.RESET)
    assert written.requests == ["release", "stop", "stop"]


@pytest.mark.parametrize("step", [Event.ARM, Event.START, Event.FINISHED, Event.DISARM])
def test_after_a_stop_no_step_of_a_run_is_taken(step: Event) -> None:
    control, written = make()
    for event in (Event.ARM, Event.START):
        control.handle(event)
    control.stop("now")
    written.requests.clear()
    with pytest.raises(StoppedError, match="now"):
        control.handle(step)
    assert written.requests == []
    assert not control.may_send


def test_set_points_may_be_sent_while_a_run_goes_on_and_not_before_or_after_it() -> None:
    control, _ = make()
    seen = [control.may_send]
    for event in (Event.ARM, Event.START, Event.FINISHED):
        control.handle(event)
        seen.append(control.may_send)
    assert seen == [False, False, True, False]


def test_only_a_reset_ends_a_halt() -> None:
    control, _ = make()
    control.stop("now")
    control.handle(Event.RESET)
    assert control.halted is None
    control.handle(Event.ARM)
    assert control.arm.state is State.ARMED


def test_a_reset_ends_the_stop_that_it_names() -> None:
    control, written = make()
    control.stop("now")
    assert control.handle(Event.RESET, stop=7) is None
    assert written.released == 7


def test_what_became_of_a_freeze_is_the_answer_to_what_asked_for_it() -> None:
    control, written = make()
    assert control.handle(Event.ARM) is None
    assert control.handle(Event.TRIP) is written.answer
    assert (control.halted, control.arm.cause) == ("trip", "guard tripped")
    assert control.stop("now") is written.answer
    assert control.halted == "trip"


def test_a_trip_that_says_why_is_halted_by_that() -> None:
    control, _ = make()
    control.handle(Event.TRIP, "joint 2 strayed")
    with pytest.raises(StoppedError, match=r"^the arm has been stopped: joint 2 strayed$") as caught:
        control.handle(Event.ARM)
    assert (caught.value.cause, caught.value.exit_code) == ("joint 2 strayed", 6)


def test_after_a_reset_an_error_freezes_anew() -> None:
    control, written = make()
    control.stop("now")
    control.handle(Event.RESET)
    written.requests.clear()
    with pytest.raises(RuntimeError), control.frozen_on_error():
        raise RuntimeError("a bug")
    assert written.requests == ["stop"]
    assert (control.halted, control.arm.cause) == ("RuntimeError: a bug", "RuntimeError: a bug")


def test_an_arm_that_was_stopped_names_its_own_cause_when_the_run_ends() -> None:
    control, _ = make()
    with pytest.raises(StoppedError), control.frozen_on_error():
        raise StoppedError("by anna")
    assert control.halted == "by anna"


def test_an_arm_that_has_just_been_connected_is_idle() -> None:
    control, written = make()
    assert (control.arm.state, control.halted, written.requests) == (State.IDLE, None, [])


def test_the_first_cause_is_kept() -> None:
    control, _ = make()
    control.stop("first")
    control.stop("second")
    assert control.halted == "first"


def test_an_error_freezes_before_anything_else_and_once_is_enough() -> None:
    control, written = make()

    def fail() -> None:
        with control.frozen_on_error(), control.frozen_on_error():
            raise RuntimeError("a bug")

    with pytest.raises(RuntimeError):
        fail()
    assert written.requests == ["stop"]


def test_a_freeze_that_was_not_confirmed_is_tried_again() -> None:
    control, written = make()
    written.answer = StopConfirmation(sent=True, acknowledged=False, problem="silence")

    def fail() -> None:
        with control.frozen_on_error(), control.frozen_on_error():
            raise RuntimeError("a bug")

    with pytest.raises(RuntimeError):
        fail()
    assert written.requests == ["stop", "stop"]


@pytest.mark.parametrize(
    ("confirmation", "words"),
    [
        (StopConfirmation(sent=True, acknowledged=True, tick=7), "confirmed: set points are frozen since tick 7"),
        (StopConfirmation(sent=True, acknowledged=False, problem="silence"), "sent but NOT CONFIRMED (silence)"),
        (StopConfirmation(sent=False, acknowledged=False, problem="no port"), "could NOT BE DELIVERED (no port)"),
    ],
    ids=["confirmed", "sent", "not sent"],
)
def test_what_is_said_of_a_stop_is_what_is_known(confirmation: StopConfirmation, words: str) -> None:
    assert words in stop_line(confirmation)
    assert ("emergency stop" in stop_line(confirmation)) == (not confirmation.acknowledged)
