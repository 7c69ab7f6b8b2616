"""The least that a residual torque can be: what noise of the readings makes of accelerations.

The recorded drive is taken as it is: its fast part is mostly real, the answer of a controller to noise of the readings.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from daq.contracts.trace import Trace
from model.discrepancy.inverse_dynamics.cutoff import measured_signal
from model.dynamics.recursive import mass_matrix
from model.machine_model.model import Model
from model.simulation.chain_of_model import chain_of

Floats = NDArray[np.float64]

POSTURES = 20
"""Of each record, at which inertia is taken."""


def noise_floor(model: Model, traces: Sequence[Trace], cutoff: float) -> Floats:
    """Standard deviation (n,), N·m or N, of a residual torque of which only noise is left."""
    chain = chain_of(model)
    squares = []
    for trace in traces:
        raw = measured_signal(trace, model.machine)
        step = max(1, len(raw.time) // POSTURES)
        masses = np.mean([mass_matrix(chain, q) ** 2 for q in np.ascontiguousarray(raw.position[::step])], axis=0)
        squares.append(masses @ raw.acceleration_noise(cutoff) ** 2)
    return np.asarray(np.sqrt(np.mean(squares, axis=0)))
