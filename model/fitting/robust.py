"""Huber's loss: quadratic for ordinary residuals, linear for outliers, so that a crackling sensor decides nothing."""

from __future__ import annotations

import numpy as np

from model.arrays import Floats

THRESHOLD = 4.0
"""Standard deviations beyond which a residual counts as an outlier; Gaussian noise reaches it once in 16 000
samples."""


def huber(squares: Floats, samples: int, threshold: float = THRESHOLD) -> Floats:
    """ρ, ρ′, ρ″ (3, m) of squared residuals for `scipy.optimize.least_squares`.

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
    """ψ(r): the residual, outliers cut to the threshold."""
    return np.clip(residual, -threshold, threshold)
