"""Huber's loss: quadratic for ordinary residuals, linear for outliers, so that a sensor's spikes have little weight."""

from __future__ import annotations

import numpy as np

from model.arrays import Floats

THRESHOLD = 4.0
"""Residual, in standard deviations, beyond which a sample counts as an outlier. Gaussian noise reaches it once in
16 000 samples."""


def huber(squares: Floats, samples: int, threshold: float = THRESHOLD) -> Floats:
    """Returns ρ, ρ′, ρ″ (3, m) of squared residuals, the form that `scipy.optimize.least_squares` expects.

    The first `samples` are data; the rest (priors) stay quadratic.
    """
    result = np.stack([squares, np.ones_like(squares), np.zeros_like(squares)])
    outliers = np.flatnonzero(squares[:samples] > threshold**2)
    z = squares[outliers]
    result[0, outliers] = 2 * threshold * np.sqrt(z) - threshold**2
    result[1, outliers] = threshold / np.sqrt(z)
    result[2, outliers] = -0.5 * threshold * z**-1.5
    return result


def influence(residual: Floats, threshold: float = THRESHOLD) -> Floats:
    """Returns ψ(r): the residual, with outliers cut to the threshold."""
    return np.clip(residual, -threshold, threshold)
