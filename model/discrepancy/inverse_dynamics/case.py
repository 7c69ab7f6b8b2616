"""What stays the same throughout a diagnosis by inverse dynamics."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from model.discrepancy.inverse_dynamics.fitting import Data
from model.discrepancy.inverse_dynamics.likelihood import Stretches, stretches_of
from model.discrepancy.inverse_dynamics.options import TorqueOptions
from model.inverse_dynamics.recorded_motion import RecordedMotion

FLOOR_SHARE = 0.3
"""Least deviation of a residual, as a share of the estimated noise: the estimate itself is rough."""


@dataclass(frozen=True)
class TorqueCase:
    """The records of a diagnosis, and how it is to be done.

    records, held_out: motions that are fitted to, and that are not. noise: (n,) standard deviation of a residual torque
    of which only noise is left.
    """

    records: tuple[RecordedMotion, ...]
    held_out: tuple[RecordedMotion, ...]
    noise: NDArray[np.float64]
    options: TorqueOptions

    @cached_property
    def data(self) -> Data:
        """The samples of the fitted records, and the least that a residual can be."""
        return Data(stretches_of(self.records), np.maximum(FLOOR_SHARE * self.noise, 1e-12))

    @property
    def stretches(self) -> Stretches:
        """Where joints move in the fitted records."""
        return self.data.stretches
