"""Covariance of fitted parameters whose residuals are correlated, or larger than the noise model states.

Whitening removes correlation that is the same everywhere. Other correlation remains: an arm that comes to rest with an
error keeps it for the whole hold, and the noise differs between motion and rest. The sandwich A⁻¹ B A⁻¹ accounts for
that, with A = JᵀJ + prior and B from sums of neighbouring scores (Newey and West 1987). B is itself estimated from few
independent stretches, so each deviation is at least that from A alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from model.arrays import Floats

BANDWIDTH = 50
"""Samples over which scores count as correlated: one second at 50 Hz, longer than a reversal, shorter than a hold."""


def score_covariance(scores: Sequence[Floats], bandwidth: int = BANDWIDTH) -> Floats:
    """Returns the covariance (p, p) of the sum of scores of all runs, with Bartlett weights up to `bandwidth` samples.

    Bartlett's weights are those with which samples meet in a window of `bandwidth` + 1 that slides over a run, so the
    mean product of the sums in the window is the same in one product of matrices.

    Args:
        scores: one array (n, p) per run: at each sample the gradient of half the squared residual, summed over joints.
    """
    size, width = scores[0].shape[1], bandwidth + 1
    total = np.zeros((size, size))
    for run in scores:
        sums = np.cumsum(np.concatenate([np.zeros((width, size)), run, np.zeros((bandwidth, size))]), axis=0)
        windows = sums[width:] - sums[:-width]
        total += windows.T @ windows / width
    return total


def sandwich(information: Floats, scores: Sequence[Floats], prior: Floats, bandwidth: int = BANDWIDTH) -> Floats:
    """Returns the covariance (p, p) of the estimates.

    Args:
        information: (p, p) JᵀJ of the whitened data. Together with the prior it must be positive definite.
        prior: (p,) 1 / prior variance, 0 for none.
        scores: as for `score_covariance`, whitened.
    """
    count, size = sum(len(run) for run in scores), information.shape[0]
    bread = inverse(information + np.diag(prior))
    middle = score_covariance(scores, bandwidth) * count / max(1, count - size) + np.diag(prior)
    eigenvalues, vectors = np.linalg.eigh(middle)
    half = bread @ (vectors * np.sqrt(np.maximum(eigenvalues, 0.0)))
    robust = half @ half.T
    ratio = np.sqrt(np.diag(bread) / np.diag(robust))
    stretch = np.maximum(1.0, ratio)
    return robust * np.outer(stretch, stretch)


def inverse(information: Floats) -> Floats:
    """Returns the inverse (p, p) of a positive semidefinite matrix, positive definite despite rounding.

    In a direction without information, rounding may leave a slightly negative eigenvalue. It is replaced by the
    smallest value above rounding. Rows and columns are scaled to one size first.
    """
    sizes = np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))
    eigenvalues, vectors = np.linalg.eigh(information / np.outer(sizes, sizes))
    least = len(sizes) * np.finfo(float).eps
    half = vectors / np.sqrt(np.maximum(eigenvalues, least)) / sizes[:, None]
    return np.asarray(half @ half.T)
