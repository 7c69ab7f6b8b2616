"""Whitens residuals by autoregression, so that correlated samples do not count as independent.

The residual of a closed loop is not white: the controller reacts to the sensor's noise, so slow errors are suppressed
and fast ones are not. An autoregressive model, estimated from the residual itself, reverses that. Residual and Jacobian
are filtered alike (generalised least squares).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_banded

from model.arrays import Floats


@dataclass(frozen=True)
class Whitener:
    """Predictors of every order up to p and the standard deviations of their errors.

    Args:
        predictors: predictors[k] is (k,), weights of the last k samples, latest first.
        deviations: (p + 1,) standard deviation of the error of each predictor, in the residual's unit.
    """

    predictors: tuple[Floats, ...]
    deviations: Floats

    @property
    def order(self) -> int:
        """Number of samples that the full predictor uses."""
        return len(self.predictors) - 1

    def whitened(self, signal: Floats) -> Floats:
        """Filters (n, …) along its first axis. The first samples are predicted from as many as precede them."""
        result = np.empty_like(signal)
        for k in range(min(self.order, len(signal))):
            past = signal[:k][::-1]
            result[k] = (signal[k] - np.tensordot(self.predictors[k], past, 1)) / self.deviations[k]
        if len(signal) > self.order:
            full = signal[self.order :].copy()
            for lag, weight in enumerate(self.predictors[-1], start=1):
                full -= weight * signal[self.order - lag : len(signal) - lag]
            result[self.order :] = full / self.deviations[-1]
        return result

    def coloured(self, signal: Floats) -> Floats:
        """Filters (n, …) along its first axis inversely, from rest: white noise of unit variance becomes noise like the
        fitted one.
        """
        bands = np.tile(np.append(1.0, -self.predictors[-1])[:, None], len(signal))
        return np.asarray(solve_banded((self.order, 0), bands, self.deviations[-1] * signal))


def white(deviation: float) -> Whitener:
    """Returns the whitener of independent noise of one standard deviation."""
    return Whitener((np.zeros(0),), np.array([deviation]))


def autocovariance(runs: Sequence[Floats], lags: int) -> Floats:
    """Returns the pooled autocovariance (lags + 1,) of several uninterrupted runs (n,) about zero.

    It is divided by the total count at every lag, which keeps the sequence positive definite.
    """
    total = sum(len(run) for run in runs)
    sums = np.zeros(lags + 1)
    for run in runs:
        for lag in range(min(lags, len(run) - 1) + 1):
            sums[lag] += float(run[lag:] @ run[: len(run) - lag])
    return sums / max(total, 1)


def fitted_whitener(runs: Sequence[Floats], longest: int, floor: float) -> Whitener:
    """Fits an autoregression of the order (up to `longest`) that Akaike's criterion chooses, by Levinson's recursion.

    `floor` is the least standard deviation of a prediction: the sensor's own noise. Without it, an arm at rest would
    count as measured without noise.
    """
    count = sum(len(run) for run in runs)
    longest = min(longest, max(0, count // 20))
    covariance = autocovariance(runs, longest)
    if covariance[0] <= floor**2:
        return white(floor)
    predictors, variances = _levinson(covariance, longest)
    criteria = [count * np.log(max(v, floor**2)) + 2 * k for k, v in enumerate(variances)]
    order = int(np.argmin(criteria))
    deviations = np.sqrt(np.maximum(variances[: order + 1], floor**2))
    return Whitener(tuple(predictors[: order + 1]), deviations)


def _levinson(covariance: Floats, longest: int) -> tuple[list[Floats], Floats]:
    predictors = [np.zeros(0)]
    variances = [float(covariance[0])]
    for k in range(1, longest + 1):
        last = predictors[-1]
        reflection = (covariance[k] - last @ covariance[k - 1 : 0 : -1]) / variances[-1]
        reflection = float(np.clip(reflection, -0.999, 0.999))
        predictors.append(np.append(last - reflection * last[::-1], reflection))
        variances.append(variances[-1] * (1.0 - reflection**2))
    return predictors, np.array(variances)
