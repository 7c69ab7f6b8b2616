"""Quantities on which a variation may depend (a joint's position, speed, load and so on), and their correlations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.arrays import Floats
from model.machine_model.model import Model
from model.simulation.chain_of_model import gravity_loads
from model.validation.measured_motion import SmoothedTrace
from model.validation.variation import Correlation

FEWEST = 6
"""Least number of independent samples for a correlation."""


def regressors(model: Model, smoothed: SmoothedTrace) -> dict[str, Floats]:
    """Returns every regressor (samples, joints) of the modelled joints along a motion."""
    motion = smoothed.motion
    return {
        "position": motion.position,
        "speed": motion.speed,
        "magnitude of speed": np.abs(motion.speed),
        "direction": np.sign(motion.speed),
        "load": gravity_loads(model, motion.position),
        "acceleration": smoothed.acceleration,
        "drive": motion.drive,
        "time": np.repeat(motion.time[:, None], motion.position.shape[1], axis=1),
    }


def correlations(
    signal: Floats, present: NDArray[np.bool_], known: dict[str, Floats], joints: list[int], width: float
) -> tuple[Correlation, ...]:
    """Returns correlations of a signal (samples,) with the regressors of some joints, strongest first.

    Args:
        present: (samples,) where the signal is defined.
        known: regressors by name, (samples, joints).
        joints: indices from 0.
        width: the signal was smoothed by a Gaussian of this standard deviation in samples; one sample in 2√π·width
            counts as independent.
    """
    count = present.sum() / max(1.0, 2 * np.sqrt(np.pi) * width)
    if count < FEWEST:
        return ()
    found = []
    for name, values in known.items():
        for j in joints:
            value = _pearson(signal[present], values[present, j])
            if value is not None:
                found.append(Correlation(regressor=name, joint=j + 1, value=value, noise=float(1 / np.sqrt(count))))
    return tuple(sorted(found, key=lambda c: -abs(c.value)))


def _pearson(x: Floats, y: Floats) -> float | None:
    x, y = x - x.mean(), y - y.mean()
    size = float(np.sqrt((x**2).sum() * (y**2).sum()))
    # a constant regressor (one direction only, one posture) has no correlation
    if size <= 1e-9 * len(x) * max(1e-300, float(np.abs(x).max() * np.abs(y).max())):
        return None
    return float((x * y).sum() / size)
