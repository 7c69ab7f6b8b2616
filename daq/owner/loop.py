"""The owner's main loop: carries out the next order or else reads a sample, and restores a lost link.

An arm that is not monitored (`Open.watched`) is not read between two orders.
"""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError, ReachError
from daq.driver import ControllerRestartedError, HardwareFaultError, NoSampleError
from daq.link import LinkError, LinkState
from daq.owner import long_orders
from daq.owner.guardian import EndCause
from daq.owner.messages import BEGINS_WITHIN, Answer, JogBegin, LeadBegin, LongOrder, QuickOrder, RunExperiment
from daq.owner.owned_robot import OwnedRobot
from daq.owner.quick_orders import require_current
from daq.owner.watched_controller import is_frozen
from daq.safety import Event, State
from firmware_protocol.commands import StatusFlag
from firmware_protocol.errors import ProtocolError

LOOK_EVERY = 0.1
"""Time (s) between two checks for the end of this process while nothing else is to be done."""
LEAVING = (EndCause.SIGNAL, EndCause.ORPHANED, EndCause.LISTENER_FAILED)
"""Causes that end the whole process, and not only the current work."""


@dataclass
class _BetweenAttempts:
    """Waits between two attempts to reconnect, and refuses orders meanwhile."""

    robot: OwnedRobot

    def wait(self, timeout: float) -> bool:
        """Returns True if the client returns the port, or this process must end."""
        until = time.monotonic() + timeout
        while not _leaving(self.robot):
            self.robot.report_arm()
            order = self.robot.inbox.take(max(0.0, min(1.0, until - time.monotonic())))
            if order is not None:
                _refuse(self.robot, order, _being_tried(self.robot), ReachError.exit_code)
            elif time.monotonic() >= until:
                return _leaving(self.robot)
        return True


def serve(robot: OwnedRobot) -> None:
    """Runs until the client returns the port. A program fault freezes the arm and is raised."""
    watched = robot.opening.watched
    if watched:
        _notice_a_stop(robot, "before this connection")
    last: int | None = None
    with robot.control.frozen_on_error():
        while not _leaving(robot):
            between_samples = robot.controller.period_s if robot.controller.link.lock_step else 0.0
            order = robot.inbox.take(between_samples if watched else LOOK_EVERY)
            try:
                if order is not None:
                    _carry_out(robot, order)
                    last = None
                elif not watched:
                    continue
                elif _is_away(robot):
                    last = None
                    _come_back(robot)
                else:
                    last = _watch(robot, last)
            except ControllerRestartedError as error:
                robot.control.handle(Event.TRIP, str(error))
                robot.controller.hello()
                last = None
            except HardwareFaultError as error:
                _trip_once(robot, str(error))
                with suppress(LinkError):  # the next round of the loop handles it
                    robot.number_stop()  # no sample arrives, but releasing the stop needs its number
                last = None
            except (LinkError, NoSampleError) as error:
                _link_lost(robot, str(error))
            robot.report_arm()


def _watch(robot: OwnedRobot, last: int | None) -> int:
    """Reads the next sample of an arm at rest. Returns its tick."""
    every = robot.controller.line_rate().every
    snapshot = robot.controller.next_snapshot(None if last is None else last + every - 1)
    if is_frozen(snapshot):  # its period may have begun before a release
        _notice_a_stop(robot, "on the board, by another host")
    robot.number_stop()
    return snapshot.tick


def _carry_out(robot: OwnedRobot, order: LongOrder | QuickOrder) -> None:
    if isinstance(order, QuickOrder):
        answer = long_orders.answered_quickly(robot, order)
        # Report before answering: a client that knows of the reset may resume the queue at once. Report even an
        # unchanged state: the service may have noted a stop that this process never reported.
        robot.report_arm(anew=True)
        robot.speaker.ended(answer)
        return
    try:
        if _is_away(robot):
            raise ReachError(_being_tried(robot))
        require_current(robot, order, BEGINS_WITHIN)
        robot.activity = order.activity
        robot.report_arm()  # at once, so that the service refuses the orders that are not possible now
        answer = _moved(robot, order)
    except DaqError as error:
        answer = Answer(number=order.number, problem=str(error), exit_code=error.exit_code)
    except ProtocolError as error:
        answer = Answer(number=order.number, problem=str(error), exit_code=exit_codes.WRONG_INPUT)
    robot.activity = "none"
    robot.inbox.done()
    robot.report_arm()
    robot.speaker.ended(answer)
    if robot.opening.watched and not _is_away(robot):
        robot.read_gains()


def _moved(robot: OwnedRobot, order: LongOrder) -> Answer:
    if isinstance(order, RunExperiment):
        return long_orders.run(robot, order)
    if isinstance(order, JogBegin):
        return long_orders.jog_until_finished(robot, order)
    if isinstance(order, LeadBegin):
        return long_orders.lead(robot, order)
    return long_orders.perform(robot, order)


def _trip_once(robot: OwnedRobot, why: str) -> None:
    """Freezes the arm once for a damaged drive, which every sample reports."""
    if robot.control.arm.state is not State.FAULT:
        robot.control.handle(Event.TRIP, why)


def _link_lost(robot: OwnedRobot, why: str) -> None:
    if robot.control.arm.connected:
        robot.control.handle(Event.LINK_LOST, why)


def _is_away(robot: OwnedRobot) -> bool:
    """Whether the link is lost, or the robot has been silent so long that it counts as lost."""
    return robot.controller.link.state is LinkState.LOST or not robot.control.arm.connected


def _being_tried(robot: OwnedRobot) -> str:
    return f"{robot.controller.link.url}: the link is lost; the service tries to reconnect"


def _come_back(robot: OwnedRobot) -> None:
    """Tries to restore the link. An undelivered stop is delivered before anything else."""
    _link_lost(robot, "link lost")
    try:
        if robot.controller.link.state is LinkState.LOST:
            robot.controller.link.reconnect(_BetweenAttempts(robot))
        else:
            _answers_again(robot)
    except (LinkError, NoSampleError):
        return
    robot.control.handle(Event.CONNECTED)
    robot.controller.hello()
    robot.read_gains()
    _notice_a_stop(robot, "before this connection")


def _answers_again(robot: OwnedRobot) -> None:
    """Checks that a silent robot answers again, by reading a sample. Raises LinkError, NoSampleError."""
    if (cause := robot.control.halted) is not None:
        robot.control.stop(cause)
    with suppress(HardwareFaultError):  # the robot answers; the next sample trips the guard
        robot.controller.next_snapshot()


def _notice_a_stop(robot: OwnedRobot, cause: str) -> None:
    if robot.control.arm.state is State.IDLE and StatusFlag.FROZEN in robot.controller.status().flags:
        robot.control.stop(cause)


def _refuse(robot: OwnedRobot, order: LongOrder | QuickOrder, line: str, exit_code: int) -> None:
    if not isinstance(order, QuickOrder):
        robot.inbox.done()
    robot.speaker.ended(Answer(number=order.number, problem=line, exit_code=exit_code))


def _leaving(robot: OwnedRobot) -> bool:
    return robot.inbox.closing.is_set() or robot.guardian.cause in LEAVING
