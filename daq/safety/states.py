"""The states of an arm under this host, and what each event does to them. Pure: events in, state and actions out.

A freeze on the board is ended by an explicit reset alone: arming never releases, so it cannot undo anybody's stop.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

from daq.contracts.errors import DaqError


class State(StrEnum):
    """Only in RUNNING are set points sent. FAULT is left by an explicit reset alone."""

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
    """An operator wants to move the arm, and the plan has passed every check."""
    DISARM = "disarm"
    START = "start"
    FINISHED = "finished"
    STOP = "stop"
    """A stop was requested. Anyone may request one, at any moment."""
    TRIP = "trip"
    """A guard has found a reason for a fault."""
    RESET = "reset"


class Action(StrEnum):
    """What the caller must do, in the order given."""

    CEASE = "cease"
    """Send no further set point."""
    FREEZE = "freeze"
    """Set points := measured position, on the board, ahead of every queue. Sent even when the link is thought dead."""
    RELEASE = "release"
    """End the board's freeze; set points stay where it put them."""
    SEND = "send"
    """Begin to send set points."""


class IllegalEventError(DaqError):
    """An event that the state does not allow; nothing has changed."""


@dataclass(frozen=True)
class Arm:
    """The state, whether the link is up, and why the arm was stopped or is at fault."""

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
    """State and actions after `event`; `cause` says in a few words why, for a stop or a fault.

    STOP, TRIP and LINK_LOST are taken in every state. Raises IllegalEventError for any other event that the state does
    not allow.
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
        # Stopped before, or while there was no link: the stop may never have arrived.
        return replace(arm, state=State.STOPPED, connected=True), (Action.FREEZE,)
    return Arm(State.IDLE, True), ()


def _reset(arm: Arm) -> Outcome:
    if not arm.connected:
        # The board's freeze cannot be ended without a link: the arm comes back as stopped.
        return replace(arm, state=State.DISCONNECTED), ()
    return Arm(State.IDLE, connected=True), (Action.RELEASE,)


def _first(arm: Arm, cause: str) -> str:
    """Keeps the first cause, which its consequences would hide; a fault replaces the cause of a stop."""
    return arm.cause if arm.state is State.FAULT and arm.cause else cause
