"""The interface of a trace that tables and figures use. It avoids a circular import with `daq.contracts.trace`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class RecordedEvent(Protocol):
    """An event of a trace, such as `daq.contracts.trace.TraceEvent`."""

    @property
    def time(self) -> float:
        """Time (s) from the record's start."""

    @property
    def kind(self) -> str:
        """Kind of event."""

    @property
    def message(self) -> str:
        """Message, one line."""

    @property
    def joint(self) -> int | None:
        """The joint of the event, if it concerns one."""


class Recorded(Protocol):
    """A trace, such as `daq.contracts.trace.Trace`."""

    @property
    def record(self) -> Any:
        """Metadata of the trace."""

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
        """Set point (rad or m); None if not recorded, as for the next three."""

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
        """Events of the record."""

    def column(self, joint: int) -> int:
        """Column of a joint. Raises TraceError."""

    @property
    def missing(self) -> int:
        """Number of missing samples."""

    @property
    def has_ticks(self) -> bool:
        """Whether periods are counted, so that missing samples are detected."""

    @property
    def missing_text(self) -> str:
        """Text about missing samples, also if their number is unknown."""

    @property
    def drive_unit(self) -> str:
        """Unit of the drive, for people."""

    @property
    def gaps(self) -> list[tuple[int, int]]:
        """Row before each gap, and the number of samples missing in it."""

    def __len__(self) -> int:
        """Number of samples."""
