"""What of a trace its tables and its picture need, so that a trace can know these without a circle."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray


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
    def missing(self) -> int:
        """Number of samples that are not there."""

    def __len__(self) -> int:
        """Number of samples."""
