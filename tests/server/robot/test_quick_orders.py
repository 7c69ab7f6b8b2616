"""Gains, signals, gripper and reset: carried out soon, or not at all."""

import time
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from daq.contracts.errors import ReachError
from daq.contracts.machine import load_machine
from daq.contracts.service.robot import Activity
from daq.owner import long_orders
from daq.owner.messages import WAITS_AT_MOST, Answer, ArmReport, MoveGripper, Reset
from daq.runner.arm_control import StoppedError
from server.problems import ProblemError
from server.robot.orders import answer_of
from server.robot.robot import ANSWER_WITHIN, ORDERS_AT_ONCE, Robot, RobotPlace
from tests.server.clocks import HandClock

MACHINE = load_machine("ma2000")
NOW = HandClock().monotonic()


@dataclass
class Asked:
    """A robot that keeps what its owner is asked for, and answers at once."""

    robot: Robot = field(default_factory=lambda: Robot(RobotPlace("ma2000", "mock://", MACHINE, Path()), HandClock()))
    orders: list[Any] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.robot.ask = self._ask  # type: ignore[method-assign]
        self.does("none")

    def does(self, activity: Activity) -> None:
        """The owner's report of it."""
        report = ArmReport(arm="idle", cause="", activity=activity, limp=(), link="connected", counters={})
        self.robot._on_report(report)

    def _ask(self, kind: Any, **fields: object) -> Future[Answer]:
        self.orders.append(kind(number=1, **fields))
        answer: Future[Answer] = Future()
        answer.set_result(Answer(number=1, data={"gripper": "open"}))
        return answer


@pytest.mark.parametrize("activity", ["experiment", "program", "step", "lead"])
def test_what_cannot_be_done_between_samples_is_refused_before_it_is_asked_for(activity: Activity) -> None:
    asked = Asked()
    asked.does(activity)
    with pytest.raises(ProblemError) as refused:
        answer_of(asked.robot, MoveGripper, NOW, closed=False)
    assert (refused.value.status, refused.value.kind) == (409, "arm-busy")
    assert activity in refused.value.detail
    assert asked.orders == []
    asked.does("none")
    asked.robot.experiment = "77be01d3aa42"  # of the queue: it counts before its owner reports it
    with pytest.raises(ProblemError, match="the arm is busy: experiment"):
        answer_of(asked.robot, Reset, NOW, stop=1, here=False)


def test_an_order_says_when_it_arrived_and_not_when_its_turn_came() -> None:
    asked = Asked()
    asked.does("jog")
    assert answer_of(asked.robot, MoveGripper, NOW - 1.5, closed=False).data == {"gripper": "open"}
    assert [order.asked for order in asked.orders] == [NOW - 1.5]
    with pytest.raises(ProblemError, match=r"took 5\.0 s to come whole: after 5 s it is not carried out") as late:
        answer_of(asked.robot, MoveGripper, NOW - ANSWER_WITHIN, closed=False)
    assert (late.value.status, late.value.kind, len(asked.orders)) == (409, "order-late", 1)


def test_a_silent_robot_holds_up_no_more_than_so_many() -> None:
    asked = Asked()
    for _ in range(ORDERS_AT_ONCE):
        assert asked.robot.room_for_orders.acquire(blocking=False)
    with pytest.raises(ProblemError) as refused:
        answer_of(asked.robot, MoveGripper, NOW, closed=False)
    assert (refused.value.status, refused.value.kind, asked.orders) == (429, "too-many", [])
    asked.robot.room_for_orders.release()
    answer_of(asked.robot, MoveGripper, NOW, closed=False)
    answer_of(asked.robot, MoveGripper, NOW, closed=False)


# ---- in the owner's process


def _gripper_of(moved: list[bool]) -> SimpleNamespace:
    return SimpleNamespace(
        link=SimpleNamespace(stops=0),
        set_gripper=lambda *, closed, before_stop: moved.append(closed and before_stop == 0),
        process=lambda: SimpleNamespace(inputs=0, outputs=0, gripper=True),
    )


def _robot(moved: list[bool], ended: str | None = None, halted: str | None = None) -> SimpleNamespace:
    control = SimpleNamespace(halted=halted)
    guardian = SimpleNamespace(is_older_than_stop=lambda _asked: False)
    return SimpleNamespace(
        opening=SimpleNamespace(watched=True),
        activity="none",
        controller=_gripper_of(moved),
        control=control,
        guardian=guardian,
        end_cause=lambda: ended,
    )


@pytest.mark.parametrize(("ended", "halted"), [("daq stop", None), (None, "following error")])
def test_a_stopped_arms_gripper_is_moved_only_for_who_knows_of_the_stop(ended: str | None, halted: str | None) -> None:
    moved: list[bool] = []
    robot = cast(Any, _robot(moved, ended, halted))
    order = MoveGripper(number=1, asked=time.monotonic(), closed=False)
    refused = long_orders.answered_quickly(robot, order)
    assert (refused.exit_code, moved) == (StoppedError.exit_code, [])
    assert f"the arm has been stopped ({ended or halted}): nothing was switched" in refused.problem
    assert long_orders.answered_quickly(robot, order.model_copy(update={"while_stopped": True})).problem == ""
    assert moved == [False]


def test_an_order_that_waited_too_long_is_never_carried_out() -> None:
    moved: list[bool] = []
    robot = cast(Any, _robot(moved))
    stale = MoveGripper(number=1, asked=time.monotonic() - WAITS_AT_MOST - 0.1, closed=True)
    refused = long_orders.answered_quickly(robot, stale)
    assert (refused.exit_code, moved) == (ReachError.exit_code, [])
    assert "nothing was done" in refused.problem
    assert long_orders.answered_quickly(robot, stale.model_copy(update={"asked": time.monotonic()})).problem == ""
    assert moved == [True]
