"""The residuals that a model leaves of records, from which all of this package computes where it disagrees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from daq.contracts.errors import SpecError
from model.arrays import Floats
from model.discrepancy.localisation.phases import AskedMotion
from model.fitting.records import Record, Signal
from model.machine_model.model import Model


@dataclass(frozen=True)
class Residuals:
    """Residuals of a model's simulation, record by record.

    Args:
        signals: (m, n) measured − simulated per record, in the unit of the measurement.
        deviations: (n,) standard deviation of such a residual when nothing is wrong.
        quantity: what the sensors measure. feedback_share: share of the recorded readings that the simulation
            was given.

    Raises:
        SpecError: for residuals that do not belong to the records, or deviations that are not positive.
    """

    model: Model
    records: Sequence[Record]
    signals: Sequence[Floats]
    deviations: Floats
    quantity: Signal = "position"
    feedback_share: float = 0.0

    def __post_init__(self) -> None:
        if len(self.records) != len(self.signals):
            raise SpecError(
                f"{len(self.signals)} residuals for {len(self.records)} records: one (m, n) array a record is needed"
            )
        for record, residual in zip(self.records, self.signals, strict=True):
            if residual.shape != record.measured.shape:
                raise SpecError(
                    f"residual of {record.name} has shape {residual.shape}: one (m, n) array a record is needed, here "
                    f"{record.measured.shape}"
                )
        if not (np.isfinite(self.deviations).all() and (self.deviations > 0).all()):
            raise SpecError(f"deviations of the noise {self.deviations}: must be positive numbers")

    @cached_property
    def motions(self) -> tuple[AskedMotion, ...]:
        """What the joints were asked to do in each record."""
        return tuple(AskedMotion(self.model.machine, record) for record in self.records)

    def of_joint(self, column: int) -> Floats:
        """The compared samples of one joint (index from 0), all records in a row."""
        return np.concatenate(
            [s[run, column] for s, record in zip(self.signals, self.records, strict=True) for run in record.runs]
        )
