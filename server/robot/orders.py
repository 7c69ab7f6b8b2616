"""Sends quick orders, which the robot's owner carries out between two samples."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from daq.contracts.errors import ReachError
from daq.owner.messages import Answer
from server.problems import ProblemError, conflict, of_exit_code
from server.robot.robot import ANSWER_WITHIN, Robot


def answer_of(robot: Robot, order: Callable[..., Any], arrived: float, **fields: object) -> Answer:
    """Sends an order that arrived at this time (s, monotonic), and returns the owner's answer.

    Raises a 409 at once during an experiment, a program or hand guiding, or if the order itself took ANSWER_WITHIN or
    longer to arrive; a 429 if too many orders wait; the problem in the answer; ReachError if there is no answer within
    ANSWER_WITHIN of its arrival.
    """
    activity = "experiment" if robot.experiment is not None else robot.arm.activity if robot.arm else "none"
    if activity not in ("none", "jog"):
        raise conflict("arm-busy", f"the arm is busy: {activity}", "wait for its end, or stop it")
    if (left := arrived + ANSWER_WITHIN - robot.clock.monotonic()) <= 0.0:
        line = f"this order took {ANSWER_WITHIN - left:.1f} s to come whole"
        line += f": after {ANSWER_WITHIN:g} s it is not carried out"
        raise conflict("order-late", line, "send it again if it is still wanted")
    if not robot.room_for_orders.acquire(blocking=False):
        line = f"too many orders are waiting already: robot {robot.name} does not answer"
        raise ProblemError(429, "too-many", line, "ask less often", (), {"Retry-After": "1"})
    try:
        answer = robot.ask(order, asked=arrived, **fields).result(left)
    except TimeoutError:
        raise ReachError(f"the robot's process did not answer within {ANSWER_WITHIN:g} s") from None
    finally:
        robot.room_for_orders.release()
    if answer.problem:
        raise of_exit_code(answer.exit_code, answer.problem)
    return answer
