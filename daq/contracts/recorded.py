"""What of a trace its tables and its picture need, so that a trace can know these without a circle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class RecordedEvent(Protocol):
    """An event of a trace, as `daq.contracts.trace.TraceEvent` has it."""

    @property
    def time(self) -> float:
        """Time (s) from the record's start."""

    @property
    def kind(self) -> str:
        """What happened."""

    @property
    def message(self) -> str:
        """One line."""

    @property
    def joint(self) -> int | None:
        """The joint that it belongs to, if to one."""


class Recorded(Protocol):
    """A trace, as `daq.contracts.trace.Trace` has it."""

    @property
    def record(self) -> Any:
        """What the trace says about itself."""

    @property
    def joints(self) -> tuple[int, ...]:
        """Numbers of the joints, from 1."""

    @property
    def time(self) -> NDArray[np.float64]:
        """Time (s) of each sample."""

    @property
    def position(self) -> NDArray[np.float64]:
        """Position (rad or m) of each sample and joint."""

    @property
    def set_point(self) -> NDArray[np.float64] | None:
        """Set point (rad or m), where it was recorded, as the next three."""

    @property
    def error(self) -> NDArray[np.float64] | None:
        """Set point − position (rad or m)."""

    @property
    def drive(self) -> NDArray[np.float64] | None:
        """Drive, in the record's unit."""

    @property
    def velocity(self) -> NDArray[np.float64] | None:
        """Speed (rad/s or m/s)."""

    @property
    def events(self) -> Sequence[RecordedEvent]:
        """What happened."""

    def column(self, joint: int) -> int:
        """Column of a joint. Raises TraceError."""

    @property
    def missing(self) -> int:
        """Number of samples that are not there."""

    @property
    def has_ticks(self) -> bool:
        """Whether periods are counted, so that missing samples show."""

    @property
    def missing_text(self) -> str:
        """The same for people, also where it is not known."""

    @property
    def drive_unit(self) -> str:
        """Unit of the drive, for people."""

    @property
    def gaps(self) -> list[tuple[int, int]]:
        """Row before each gap, and how many samples are missing in it."""

    def __len__(self) -> int:
        """Number of samples."""
