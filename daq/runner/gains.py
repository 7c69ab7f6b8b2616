"""Writes the gains of an experiment before it moves, and restores the previous ones after a complete run.

After a stop or a fault nothing is changed on the board any more: the experiment's gains stay, which the trace states.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from daq.contracts.experiment import Gain
from daq.driver import Controller
from daq.runner.arm_control import StoppedError


@dataclass(frozen=True)
class GainChange:
    """Gains of one joint before and during a run."""

    joint: int
    before: Gain
    during: Gain

    @property
    def message(self) -> str:
        """Message for the trace about the change."""
        return f"joint {self.joint}: gains {_text(self.during)} for this run, {_text(self.before)} before"

    @property
    def kept_message(self) -> str:
        """Message for the trace about gains that were not restored."""
        return f"joint {self.joint}: gains stay at {_text(self.during)}, they were {_text(self.before)} before the run"


def set_gains(
    controller: Controller, wanted: dict[int, Gain], ended: Callable[[], str | None]
) -> tuple[GainChange, ...]:
    """Writes the gains that differ from the board's, and reads each back. Raises StoppedError, GainsNotTakenError,
    LinkError."""
    if not wanted:
        return ()
    before = controller.gains()
    changes = tuple(
        GainChange(joint, before[joint], gain) for joint, gain in sorted(wanted.items()) if before[joint] != gain
    )
    for change in changes:
        _require_going_on(ended)
        controller.set_gains(change.joint, *change.during)
    return changes


def put_back(controller: Controller, changes: tuple[GainChange, ...], ended: Callable[[], str | None]) -> None:
    """Restores the previous gains. Raises as `set_gains`."""
    for change in changes:
        _require_going_on(ended)
        controller.set_gains(change.joint, *change.before)


def _require_going_on(ended: Callable[[], str | None]) -> None:
    cause = ended()
    if cause is not None:
        raise StoppedError(cause)


def _text(gain: Gain) -> str:
    return "/".join(map(str, gain))
