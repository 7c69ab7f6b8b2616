"""Residuals of torque and their exact derivatives: D(q̈ − f), f the model's acceleration at the recorded torque."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.dynamics.compilation import compiled
from model.dynamics.dual import DUAL_STEP
from model.dynamics.recursive import mass_matrix
from model.fitting.problem import Evaluation
from model.fitting.unknowns import Unknown
from model.kinematics.chain import ChainArrays
from model.machine_model.model import Model
from model.simulation.chain_of_model import chain_of
from model.torque_space.recorded_motion import RecordedMotion
from model.validation.acceleration_model import expected_accelerations

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class TorqueProblem:
    """Torque that the motion needs less torque that was recorded, N·m (N), for records of one machine."""

    model: Model
    records: tuple[RecordedMotion, ...]
    unknowns: tuple[Unknown, ...]
    floor: Floats

    @property
    def runs(self) -> Sequence[Sequence[slice]]:
        """Per record, the whole of it."""
        return [[slice(0, r.kept.stop - r.kept.start)] for r in self.records]

    def evaluate(self, values: Floats, derivatives: bool) -> list[Evaluation]:
        """Residuals of every record, with exact derivatives when asked for."""
        names = [u.name for u in self.unknowns]
        model = self.model.with_values(dict(zip(names, map(float, values), strict=True)))
        return [self._evaluation(model, record, names if derivatives else []) for record in self.records]

    def _evaluation(self, model: Model, record: RecordedMotion, names: Sequence[str]) -> Evaluation:
        expected, slopes = expected_accelerations(model, record.motion, names)
        masses, changes = masses_along(model, record.motion.position, names)
        missing = record.acceleration - expected
        residual = record.low_passed(np.einsum("kij,kj->ki", masses, missing))[record.kept]
        if not names:
            return Evaluation(residual, None)
        jacobian = np.einsum("pkij,kj->kpi", changes, missing) - np.einsum("kij,pkj->kpi", masses, slopes)
        jacobian = record.low_passed(jacobian)[record.kept]
        return Evaluation(residual, np.ascontiguousarray(jacobian.transpose(1, 0, 2)))

    def with_records(self, records: Sequence[RecordedMotion]) -> TorqueProblem:
        """The same unknowns on other records."""
        return replace(self, records=tuple(records))


def masses_along(model: Model, position: Floats, names: Sequence[str]) -> tuple[Floats, Floats]:
    """D (k, n, n) along positions (k, n), and its derivatives (p, k, n, n) by the named parameters."""
    plain = _masses(chain_of(model, model.vector.astype(np.complex128)), position.astype(np.complex128))
    changes = np.zeros((len(names), *plain.shape))
    for row, name in enumerate(names):
        vector: NDArray[Any] = model.vector.astype(np.complex128)
        vector[list(model.parameter(name).slots)] += 1j * DUAL_STEP
        changes[row] = _masses(chain_of(model, vector), position.astype(np.complex128)).imag / DUAL_STEP
    return np.ascontiguousarray(plain.real), changes


@compiled
def _masses(chain: ChainArrays, position: NDArray[Any]) -> NDArray[Any]:
    count, n = position.shape
    result = np.empty((count, n, n), dtype=np.complex128)
    for k in range(count):
        result[k] = mass_matrix(chain, position[k])
    return result
