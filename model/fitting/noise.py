"""The sensor's noise, put back into the simulated loop.

The real controller acts on readings with noise and rounding, and that keeps an arm creeping where a simulation without
noise would stick. What the record shows of the noise is given to the simulated controller: the residual less its
three-point mean. A longer mean would also carry what the model lacks into the simulation, and hide it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from model.fitting.problem import Evaluation
from model.fitting.records import Record

Floats = NDArray[np.float64]


def noise_of(evaluations: Sequence[Evaluation], records: Sequence[Record]) -> list[Floats]:
    """Per record (k, n) the noise of the readings on the grid of control periods, rad; 0 where a sample is missing."""
    found = []
    for evaluation, record in zip(evaluations, records, strict=True):
        noise = np.zeros((len(record.inputs), record.measured.shape[1]))
        rows = np.round(record.inputs.rows).astype(np.int64)
        for run in record.runs:
            error = -evaluation.residual[run]
            noise[rows[run]] = error - three_point_mean(error)
        found.append(noise)
    return found


def three_point_mean(signal: Floats) -> Floats:
    """Mean of each sample (n, …) with its neighbours; at the ends with the one there is."""
    padded = np.concatenate([signal[:1], signal, signal[-1:]])
    return (padded[:-2] + padded[1:-1] + padded[2:]) / 3.0
