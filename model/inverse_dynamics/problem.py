"""A fit of torques as a problem for the numerics of fitting: residual torques and their derivatives by the unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from model.arrays import Floats
from model.fitting.problem import Evaluation
from model.fitting.unknowns import Unknown
from model.inverse_dynamics.recorded_motion import RecordedMotion
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model

DIFFERENCE = 1e-3
"""Step of the finite differences, as a share of a parameter's natural size. With smaller steps, derivatives by
parameters without influence are rounding errors (such as the mass of a link that only turns about itself). A fit
without priors then ends where it began."""


@dataclass(frozen=True)
class TorqueProblem:
    """Torque that the motion needs − torque that was applied, N·m (N), for records of one machine."""

    model: Model
    records: tuple[RecordedMotion, ...]
    unknowns: tuple[Unknown, ...]
    floor: Floats

    @cached_property
    def balance(self) -> TorqueBalance:
        """The torque balance of all records."""
        return TorqueBalance(self.model, self.records, difference=DIFFERENCE)

    @property
    def runs(self) -> Sequence[Sequence[slice]]:
        """Per record, all of its compared samples."""
        return [[slice(0, len(record.moving))] for record in self.records]

    def evaluate(self, values: Floats, derivatives: bool) -> list[Evaluation]:
        """Returns residuals of every record, with their derivatives on request."""
        named = {u.name: float(v) for u, v in zip(self.unknowns, values, strict=True)}
        residual = self.balance.residual(named)
        if not derivatives:
            return [Evaluation(r, None) for r in residual]
        slopes = [self.balance.slope(named, residual, u) for u in self.unknowns]
        return [Evaluation(r, np.stack([slope[i] for slope in slopes])) for i, r in enumerate(residual)]
