"""Carries out a stop: through the process that owns the robot's port, or at the port itself if no process owns it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from daq.contracts.service.robot import FleetStopResult, StopResult
from daq.owner.port_stop import stop_at_port
from daq.owner.stop_socket import StopAnswer, request_stop
from daq.transport import SerialPort, Terminal, TransportError, parse_port_url, require_same

SILENT = "the process that owns the port did not answer"


@dataclass(frozen=True)
class Reach:
    """How to reach a robot. `owner`: PID of the process that owns its port, None if there is none. `terminal`: the
    pseudo-terminal at which it was reached, if it is a mock's. `ask`: stops through the owner's pipe and returns None
    without an answer; only the service has it."""

    robot: str
    url: str
    owner: int | None = None
    terminal: Terminal | None = None
    ask: Callable[[], StopAnswer | None] | None = None


def stop_arm(reach: Reach) -> StopResult:
    """Freezes the arm. Never raises: the result contains any error."""
    begun = time.monotonic()
    answer = _ask(reach)
    if answer.confirmed:
        head = "stopped, confirmed by the board"
        detail = f"its set points are frozen. {answer.text}".strip()
        text = f"{head}: set points frozen at tick {answer.tick}. {answer.text}".strip()
    else:
        head = "stop sent, NOT CONFIRMED by the board" if answer.delivered else "stop NOT DELIVERED"
        detail = f"{answer.text}. Use the emergency stop."
        text = f"{head}: {detail}"
    return StopResult(
        delivered=answer.delivered,
        confirmed=answer.confirmed,
        tick=answer.tick,
        seconds=time.monotonic() - begun,
        note=answer.text,
        detail=detail,
        text=text,
    )


def together(results: Mapping[str, StopResult]) -> FleetStopResult:
    """Returns the results of all robots' stops as one, which is as good as the worst of them."""
    every = list(results.values())
    texts = [f"{name}: {result.text}" for name, result in results.items()]
    return FleetStopResult(
        delivered=all(result.delivered for result in every),
        confirmed=all(result.confirmed for result in every),
        seconds=max(result.seconds for result in every),
        note=every[0].note if len(every) == 1 else "",
        detail=every[0].detail if len(every) == 1 else _in_detail(results),
        text=every[0].text if len(every) == 1 else "; ".join(texts),
        robots=dict(results),
    )


def _in_detail(results: Mapping[str, StopResult]) -> str:
    """Returns which arms are not known to be stopped, and which are."""
    stopped = ", ".join(name for name, result in results.items() if result.confirmed)
    others = ", ".join(f"{name} ({result.note})" for name, result in results.items() if not result.confirmed)
    if not others:
        return f"all {len(results)} arms hold their set points."
    return f"not confirmed: {others}. Use the emergency stop. Confirmed: {stopped or 'none'}."


def _ask(reach: Reach) -> StopAnswer:
    """Asks at the stop socket; if there is no answer, by the owner's pipe; if there is no owner, at the port."""
    why = ""
    try:
        attempts = request_stop(reach.robot, reach.owner)
    except OSError as error:  # for example, too many open files for another socket
        attempts, why = [], f"the process that owns the port cannot be asked: {error.strerror or error}"
    answers = [attempt.answer for attempt in attempts if attempt.answer is not None]
    if len(answers) < len(attempts):
        why = SILENT
    elif answers:
        return next((answer for answer in answers if not answer.confirmed), answers[0])
    if reach.ask is not None and (answer := reach.ask()) is not None:
        return answer
    return _undelivered(reach, why) if why else _ask_port(reach)


def _ask_port(reach: Reach) -> StopAnswer:
    port = parse_port_url(reach.url)
    if reach.url.startswith("mock://"):
        return _undelivered(reach, "no robot is connected" if reach.owner is None else SILENT)
    if isinstance(port, SerialPort):
        try:
            require_same(port.device, reach.terminal)
        except TransportError as error:
            return _undelivered(reach, str(error))
    return stop_at_port(reach.robot, reach.url)


def _undelivered(reach: Reach, why: str) -> StopAnswer:
    return StopAnswer(robot=reach.robot, port=reach.url, delivered=False, confirmed=False, text=why)
