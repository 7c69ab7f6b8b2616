"""The owner's main loop: an order when one waits, else the next sample; back to the robot when the link was lost."""

from __future__ import annotations

import time
from dataclasses import dataclass

from daq.acquisition.guardian import EndCause
from daq.contracts import exit_codes
from daq.contracts.errors import DaqError, ReachError
from daq.driver import ControllerRestartedError, NoSampleError
from daq.link import LinkError, LinkState
from daq.safety import Event, State
from firmware_protocol.commands import StatusFlag
from firmware_protocol.errors import ProtocolError
from server.owner import long_orders
from server.owner.desk import Desk
from server.owner.messages import Answer, JogBegin, LeadBegin, Long, Quick, RunExperiment
from server.owner.watched_controller import is_frozen

LEAVING = (EndCause.SIGNAL, EndCause.ORPHANED, EndCause.DEAF)
"""Ends of the work that are ends of this process too."""


@dataclass
class _BetweenAttempts:
    """Waits between two attempts to connect again; whoever asks for something meanwhile is told how it is."""

    desk: Desk

    def wait(self, timeout: float) -> bool:
        """True when the service wants the port back, or somebody ends this process."""
        until = time.monotonic() + timeout
        while not _leaving(self.desk):
            self.desk.tell_arm()
            order = self.desk.inbox.take(max(0.0, min(1.0, until - time.monotonic())))
            if order is not None:
                _refuse(self.desk, order, _being_tried(self.desk), ReachError.exit_code)
            elif time.monotonic() >= until:
                return _leaving(self.desk)
        return True


def serve(desk: Desk) -> None:
    """Until the service wants the port back. Raises what is no DaqError: a fault of this program; the arm is frozen."""
    _notice_a_stop_before_us(desk)
    last: int | None = None
    with desk.control.frozen_on_error():
        while not _leaving(desk):
            order = desk.inbox.take(desk.controller.period_s if desk.controller.link.lock_step else 0.0)
            try:
                if order is not None:
                    _carry_out(desk, order)
                    last = None
                elif _is_away(desk):
                    last = None
                    _come_back(desk)
                else:
                    last = _watch(desk, last)
            except ControllerRestartedError as error:
                desk.control.handle(Event.TRIP, str(error))
                desk.controller.hello()
                last = None
            except (LinkError, NoSampleError) as error:
                _link_lost(desk, str(error))
            desk.tell_arm()


def _watch(desk: Desk, last: int | None) -> int:
    """The next sample of an arm that nobody moves. Returns its tick."""
    snapshot = desk.controller.next_snapshot(last)
    if is_frozen(snapshot) and desk.control.arm.state is State.IDLE:
        desk.control.stop("stopped on the board by somebody else")
    return snapshot.tick


def _carry_out(desk: Desk, order: Long | Quick) -> None:
    if isinstance(order, Quick):
        answer = long_orders.answered_quickly(desk, order)
        # Before the answer, since who has heard of a reset may resume the queue at once; and also where it looks as it
        # did when it was told last: the service may have noted a stop since, which this process never came to tell.
        desk.tell_arm(anew=True)
        desk.speaker.ended(answer)
        return
    try:
        if _is_away(desk):
            raise ReachError(_being_tried(desk))
        long_orders.require_in_time(order)
        desk.activity = order.activity
        desk.tell_arm()  # at once: what cannot be done meanwhile is refused by the service
        answer = _moved(desk, order)
    except DaqError as error:
        answer = Answer(number=order.number, problem=str(error), exit_code=error.exit_code)
    except ProtocolError as error:
        answer = Answer(number=order.number, problem=str(error), exit_code=exit_codes.WRONG_INPUT)
    desk.activity = "none"
    desk.inbox.done()
    desk.tell_arm()
    desk.speaker.ended(answer)
    if not _is_away(desk):
        desk.read_gains()


def _moved(desk: Desk, order: Long) -> Answer:
    if isinstance(order, RunExperiment):
        return long_orders.run(desk, order)
    if isinstance(order, JogBegin):
        return long_orders.jog_until_finished(desk, order)
    if isinstance(order, LeadBegin):
        return long_orders.lead(desk, order)
    return long_orders.perform(desk, order)


def _link_lost(desk: Desk, why: str) -> None:
    if desk.control.arm.connected:
        desk.control.handle(Event.LINK_LOST, why)


def _is_away(desk: Desk) -> bool:
    """Whether the link has been lost, or the robot was silent for so long that it counted as lost."""
    return desk.controller.link.state is LinkState.LOST or not desk.control.arm.connected


def _being_tried(desk: Desk) -> str:
    return f"{desk.controller.link.url}: the link is lost; it is being tried again"


def _come_back(desk: Desk) -> None:
    """Tries until the link is there again. A stop that could not be delivered is delivered before anything else."""
    _link_lost(desk, "link lost")
    try:
        if desk.controller.link.state is LinkState.LOST:
            desk.controller.link.reconnect(_BetweenAttempts(desk))
        else:
            _answers_again(desk)
    except (LinkError, NoSampleError):
        return
    desk.control.handle(Event.CONNECTED)
    desk.controller.hello()
    desk.read_gains()
    _notice_a_stop_before_us(desk)


def _answers_again(desk: Desk) -> None:
    """One that was silent has to give a sample before it counts as there. Raises LinkError, NoSampleError."""
    if (cause := desk.control.halted) is not None:
        desk.control.stop(cause)
    desk.controller.next_snapshot()


def _notice_a_stop_before_us(desk: Desk) -> None:
    if StatusFlag.FROZEN in desk.controller.status().flags and desk.control.arm.state is State.IDLE:
        desk.control.stop("stopped before this connection")


def _refuse(desk: Desk, order: Long | Quick, line: str, exit_code: int) -> None:
    if not isinstance(order, Quick):
        desk.inbox.done()
    desk.speaker.ended(Answer(number=order.number, problem=line, exit_code=exit_code))


def _leaving(desk: Desk) -> bool:
    return desk.inbox.closing.is_set() or desk.guardian.cause in LEAVING
