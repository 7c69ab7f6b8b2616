"""Ends teaching early: freezes the arm, then returns one line with the reason and the result of the freeze."""

from __future__ import annotations

from daq.runner.arm_control import ArmControl, StoppedError, stop_line
from daq.safety import Event
from daq.teaching.arm import TeachingError


def freeze_for_stop(control: ArmControl, cause: str) -> StoppedError:
    """Freezes the arm on request. A repeated request is harmless: the board confirms its state."""
    return StoppedError(cause, f"the arm has been stopped: {cause}{_frozen(control, Event.STOP, cause)}")


def freeze_for_fault(control: ArmControl, cause: str, event: Event = Event.TRIP) -> TeachingError:
    """Freezes the arm because of a fault."""
    return TeachingError(f"the arm has been stopped by a fault: {cause}{_frozen(control, event, cause)}")


def _frozen(control: ArmControl, event: Event, cause: str) -> str:
    confirmation = control.handle(event, cause)
    return "" if confirmation is None else f"; {stop_line(confirmation)}"
