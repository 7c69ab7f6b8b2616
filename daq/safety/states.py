"""State machine of the arm: for each event, the next state and the actions. Pure.

Only an explicit reset ends a freeze on the board. Arming never releases, so it cannot undo anybody's stop.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

from daq.contracts.errors import DaqError


class State(StrEnum):
    """Set points are sent only in RUNNING. Only an explicit reset leaves FAULT."""

    DISCONNECTED = "disconnected"
    IDLE = "idle"
    ARMED = "armed"
    RUNNING = "running"
    STOPPED = "stopped"
    FAULT = "fault"


class Event(StrEnum):
    """Events that change the state."""

    CONNECTED = "connected"
    LINK_LOST = "link lost"
    ARM = "arm"
    """An operator wants to move the arm, and the plan passed every check."""
    DISARM = "disarm"
    START = "start"
    FINISHED = "finished"
    STOP = "stop"
    """A stop was requested. Any program may request one at any moment."""
    TRIP = "trip"
    """A guard found a reason for a fault."""
    RESET = "reset"


class Action(StrEnum):
    """Actions of the caller, in the order given."""

    CEASE = "cease"
    """Send no more set points."""
    FREEZE = "freeze"
    """Make the measured position the set points, on the board, ahead of every queue. Sent even if the link seems
    dead."""
    RELEASE = "release"
    """Ends the board's freeze; set points stay where the freeze put them."""
    SEND = "send"
    """Begin to send set points."""


class IllegalEventError(DaqError):
    """The state does not allow this event; nothing has changed."""


@dataclass(frozen=True)
class Arm:
    """State of the arm and of the link, and the cause of a stop or fault."""

    state: State = State.DISCONNECTED
    connected: bool = False
    cause: str | None = None


Outcome = tuple[Arm, tuple[Action, ...]]

_HALT = (Action.CEASE, Action.FREEZE)
_ORDERLY: dict[tuple[State, Event], tuple[State, tuple[Action, ...]]] = {
    (State.IDLE, Event.ARM): (State.ARMED, ()),
    (State.ARMED, Event.DISARM): (State.IDLE, ()),
    (State.ARMED, Event.START): (State.RUNNING, (Action.SEND,)),
    (State.RUNNING, Event.FINISHED): (State.ARMED, (Action.CEASE,)),
    (State.STOPPED, Event.RESET): (State.IDLE, (Action.RELEASE,)),
}
_ADVICE = {
    Event.CONNECTED: "the link is up already",
    Event.ARM: "possible when idle; reset a stop or a fault first, connect when disconnected",
    Event.DISARM: "possible when armed",
    Event.START: "arm first",
    Event.FINISHED: "nothing is running",
    Event.RESET: "possible when stopped or at fault",
}


def advance(arm: Arm, event: Event, cause: str | None = None) -> Outcome:
    """Returns the state and the actions after `event`. `cause`: a few words, for a stop or a fault.

    STOP, TRIP and LINK_LOST are accepted in every state. Raises IllegalEventError for any other event that the state
    does not allow.
    """
    match event:
        case Event.STOP:
            return _stop(arm, cause or "on request")
        case Event.TRIP:
            return replace(arm, state=State.FAULT, cause=_first(arm, cause or "guard tripped")), _HALT
        case Event.LINK_LOST:
            return _link_lost(arm, cause or "link lost")
        case Event.CONNECTED if not arm.connected:
            return _connected(arm)
        case Event.RESET if arm.state is State.FAULT:
            return _reset(arm)
    if (arm.state, event) not in _ORDERLY:
        raise IllegalEventError(f"cannot {event} while {arm.state}: {_ADVICE[event]}")
    state, actions = _ORDERLY[arm.state, event]
    return Arm(state, arm.connected), actions


def _stop(arm: Arm, cause: str) -> Outcome:
    if arm.state is State.FAULT:
        return arm, _HALT
    if arm.state is State.DISCONNECTED:
        return replace(arm, cause=arm.cause or cause), _HALT
    return replace(arm, state=State.STOPPED, cause=_first(arm, cause)), _HALT


def _link_lost(arm: Arm, cause: str) -> Outcome:
    if arm.state in (State.ARMED, State.RUNNING):
        return Arm(State.FAULT, False, cause), _HALT
    if arm.state is State.FAULT:
        return replace(arm, connected=False), ()
    return Arm(cause=arm.cause), ()


def _connected(arm: Arm) -> Outcome:
    if arm.state is State.FAULT:
        return replace(arm, connected=True), (Action.FREEZE,)
    if arm.cause is not None:
        # The arm was stopped before, or while there was no link: the stop may not have arrived.
        return replace(arm, state=State.STOPPED, connected=True), (Action.FREEZE,)
    return Arm(State.IDLE, True), ()


def _reset(arm: Arm) -> Outcome:
    if not arm.connected:
        # Without a link the board's freeze cannot be ended: after reconnecting, the arm is stopped.
        return replace(arm, state=State.DISCONNECTED), ()
    return Arm(State.IDLE, connected=True), (Action.RELEASE,)


def _first(arm: Arm, cause: str) -> str:
    """Returns the first cause: later ones are its consequences. A fault replaces the cause of a stop."""
    return arm.cause if arm.state is State.FAULT and arm.cause else cause
