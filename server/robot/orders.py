"""Waiting for the answer to an order."""

from __future__ import annotations

from concurrent.futures import Future

from daq.contracts.errors import ReachError
from server.owner.messages import Answer
from server.problems import of_exit_code
from server.robot.robot import ANSWER_WITHIN


def answer_of(asked: Future[Answer], within: float = ANSWER_WITHIN) -> Answer:
    """The answer. Raises the problem that it tells of, or ReachError when none comes in time."""
    try:
        answer = asked.result(within)
    except TimeoutError:
        raise ReachError(f"the robot's process did not answer within {within:g} s") from None
    if answer.problem:
        raise of_exit_code(answer.exit_code, answer.problem)
    return answer
