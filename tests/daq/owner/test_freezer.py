"""Whoever asks for a stop is answered in time, with what is known by then."""

from __future__ import annotations

import threading
from typing import Any, cast

import pytest

from daq.driver import StopConfirmation
from daq.owner import freezer as module
from daq.owner.freezer import Freezer
from daq.runner.arm_control import ArmControl


class SlowControl:
    """An arm whose board confirms when the test says so."""

    def __init__(self) -> None:
        self.confirm = threading.Event()
        self.stops = 0
        self.answer = StopConfirmation(sent=True, acknowledged=True, tick=9, frozen={1: 500})

    def stop(self, _cause: str) -> StopConfirmation:
        self.stops += 1
        assert self.confirm.wait(10)
        return self.answer


def controlled(freezer: Freezer) -> SlowControl:
    control = SlowControl()
    freezer.control = cast(ArmControl, cast(Any, control))
    return control


def test_before_the_robot_is_reached_nothing_is_delivered_and_that_is_said() -> None:
    with Freezer("arm", "serial:///dev/x") as freezer:
        answer = freezer.freeze("now")
    assert (answer.robot, answer.port, answer.delivered) == ("arm", "serial:///dev/x", False)
    assert "ends before anything moves" in answer.text


def test_a_confirmed_stop_says_where_the_arm_is_frozen() -> None:
    with Freezer("arm", "") as freezer:
        controlled(freezer).confirm.set()
        answer = freezer.freeze("now")
    assert (answer.delivered, answer.confirmed, answer.tick, answer.postures) == (True, True, 9, (500,))


def test_a_stop_that_could_not_be_sent_says_why() -> None:
    with Freezer("arm", "") as freezer:
        control = controlled(freezer)
        control.answer = StopConfirmation(sent=False, acknowledged=False, problem="no line")
        control.confirm.set()
        answer = freezer.freeze("now")
    assert (answer.delivered, answer.confirmed, answer.text) == (False, False, "no line")


def test_a_board_that_does_not_confirm_keeps_nobody_waiting_and_the_stop_goes_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "ANSWER_WITHIN", 0.01)
    with Freezer("arm", "") as freezer:
        control = controlled(freezer)
        first, second = freezer.freeze("now"), freezer.freeze("again")
        assert control.stops == 1, "the second request waits for the stop that is under way"
        control.confirm.set()
    assert (first.delivered, first.confirmed) == (second.delivered, second.confirmed) == (True, False)
    assert "no confirmation within" in first.text
