"""Statistics of correlated residuals: how many independent samples a stretch is worth, and means in bins.

Neighbouring residuals of a closed loop are correlated, so m samples are not m observations. An autoregression fitted to
the residual itself (the one that whitening uses) gives its autocorrelation ρ. The mean square of m neighbours is a sum
of squares weighted by the eigenvalues of their correlation; of many samples it has the spread of one over m / (1 + 2 Σ
(1 − k/m) ρ_k²) independent ones. The covariance of the mean in one bin with that in another is σ² Σ_k ρ_k times the
number of sample pairs k apart, one in each.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np
from scipy.special import ndtri

from daq.contracts.machine import Machine, NoController
from model.arrays import Floats
from model.discrepancy.diagnosis import AgainstWhat, Dependence
from model.discrepancy.localisation.phases import AskedMotion
from model.fitting.whitening import fitted_whitener

LONGEST_MEMORY = 12
"""Largest order of the autoregression, samples."""
LAGS = 100
"""Largest lag of the autocorrelation, samples; correlation beyond is neglected."""
LARGEST = 1000.0
"""Cap of a significance in standard deviations; larger values mean nothing."""
BISECTIONS = 100
"""Steps of the bisection for the saddle point."""
LEAST = 0.3
"""Least deviation of a residual, relative to that of noise: the noise itself is known roughly."""
FEWEST = 3.0
"""Independent samples that a bin needs to be reported."""


@dataclass(frozen=True)
class Correlation:
    """Variance of a residual, and its autocorrelation (LAGS + 1,), beginning with 1."""

    variance: float
    values: Floats

    def samples_of_square(self, count: int) -> float:
        """Number of independent samples with the same spread of the mean square as `count` neighbours."""
        lags = np.arange(1, min(count, len(self.values)))
        return float(count / (1 + 2 * np.sum((1 - lags / count) * self.values[lags] ** 2)))


def correlation_of(runs: Sequence[Floats], floor: float) -> Correlation:
    """Correlation of a residual given as stretches (m,) without gaps; `floor` is its least standard deviation."""
    whitener = fitted_whitener(runs, LONGEST_MEMORY, floor)
    every = np.concatenate(runs)
    variance = max(float(every @ every) / max(len(every), 1), floor**2)
    response = np.zeros(3 * LAGS)
    response[0] = 1.0
    predictor = whitener.predictors[-1]
    for k in range(1, len(response)):
        reach = min(k, len(predictor))
        response[k] = predictor[:reach] @ response[k - reach : k][::-1]
    covariance = np.array([response[lag:] @ response[: len(response) - lag] for lag in range(LAGS + 1)])
    return Correlation(variance, covariance / covariance[0])


def significance_of_squares(mean_squares: Floats, count: int, correlation: Correlation) -> Floats:
    """Standard deviations by which mean squares (any shape) of `count` neighbours exceed their expectation of 1.

    A mean square of correlated samples is a weighted sum of squares, its weights the eigenvalues of their correlation.
    Its tail follows by the saddle point (Lugannani and Rice 1980; Barndorff-Nielsen's r*), which holds far out, where
    matching the variance alone would find noise significant too often.
    """
    lags = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    known = np.append(correlation.values, 0.0)[np.minimum(lags, len(correlation.values))]
    weights = np.maximum(np.linalg.eigvalsh(known), 0.0) / count
    weights = weights / weights.sum()
    x = np.maximum(np.asarray(mean_squares, dtype=np.float64), 1e-6)
    low, high = np.full(x.shape, -0.5 / (weights.max() * 1e-9)), np.full(x.shape, 0.5 / weights.max())
    for _ in range(BISECTIONS):
        s = 0.5 * (low + high)
        above = np.sum(weights / (1 - 2 * weights * s[..., None]), axis=-1) > x
        low, high = np.where(above, low, s), np.where(above, s, high)
    s = 0.5 * (low + high)
    factor = 1 - 2 * weights * s[..., None]
    generating = -0.5 * np.sum(np.log(factor), axis=-1)
    curvature = 2 * np.sum((weights / factor) ** 2, axis=-1)
    return _saddle_point(np.sign(s) * np.sqrt(np.maximum(2 * (s * x - generating), 0.0)), s * np.sqrt(curvature))


def significance_of_chi_square(mean_square: float, freedom: float) -> float:
    """The same for the mean of `freedom` independent squares, by the same approximation in closed form."""
    x = max(mean_square, 1e-6)
    w = np.sign(x - 1) * np.sqrt(freedom * max(x - 1 - np.log(x), 0.0))
    return float(_saddle_point(np.array(w), np.sqrt(0.5 * freedom) * (x - 1)))


def chance_significance(trials: int, chance: float = 0.01) -> float:
    """Significance that the largest of `trials` independent trials exceeds with probability `chance`."""
    return -float(ndtri(chance / max(trials, 1)))


def _saddle_point(w: Floats, u: Floats) -> Floats:
    """r* = w + ln(u/w)/w, a standard Gaussian; near the mean, where that is 0/0, w itself."""
    far = np.abs(w) > 1e-3
    safe = np.where(far, w, 1.0)
    return np.minimum(np.where(far, w + np.log(np.where(far, u, 1.0) / safe) / safe, w), LARGEST)


@dataclass(frozen=True)
class Bins:
    """Mean of a signal in bins of a quantity, (b,) each; NaN where there are too few samples.

    significance: of the whole dependence, in standard deviations. explained: share of the signal's variance that the
    bins explain, beyond what as many bins of noise would.
    """

    centres: Floats
    mean: Floats
    deviation: Floats
    significance: float
    explained: float


def binned(signal: Floats, quantity: Floats, edges: Floats, stretches: Sequence[slice], floor: float) -> Bins:
    """Means of a signal (m,) in bins of a quantity (m,), NaN where the quantity does not count.

    The correlation is that of the remainder after the bins, so that a strong dependence does not count as its own
    noise. Only differences between bins matter: a constant offset depends on nothing.

    Args:
        edges: (b + 1,) of the bins. stretches: without gaps. floor: least standard deviation of the signal.
    """
    place = np.where(np.isnan(quantity), -1, np.digitize(np.nan_to_num(quantity), edges[1:-1]))
    member = (place[:, None] == np.arange(len(edges) - 1)).astype(np.float64)
    kept = np.zeros(len(signal), dtype=bool)
    for stretch in stretches:
        kept[stretch] = True
    member[~kept] = 0.0
    counts = member.sum(axis=0)
    means = np.where(counts > 0, member.T @ np.where(kept, signal, 0.0) / np.maximum(counts, 1), 0.0)
    used = member.sum(axis=1) > 0
    left = np.where(used, signal - member @ means, 0.0)
    correlation = correlation_of([left[s] for s in stretches], floor)
    pairs = sum(_pairs(member[s], correlation.values) for s in stretches)
    spread = correlation.variance * np.asarray(pairs) / np.maximum(np.outer(counts, counts), 1.0)
    deviation = np.sqrt(np.maximum(np.diag(spread), 0.0))
    known = (counts > 0) & (np.square(deviation) < correlation.variance / FEWEST)
    significance = _significance(means[known], spread[np.ix_(known, known)])
    explained = _explained(signal[used], left[used], spread, counts)
    shown = np.where(known, means, np.nan)
    return Bins(0.5 * (edges[1:] + edges[:-1]), shown, np.where(known, deviation, np.nan), significance, explained)


def _pairs(member: Floats, correlation: Floats) -> Floats:
    """Σ over lags of ρ times the number of pairs of samples, (b, b)."""
    total = member.T @ member
    for lag in range(1, min(len(correlation), len(member))):
        one_way = member[lag:].T @ member[:-lag]
        total += correlation[lag] * (one_way + one_way.T)
    return np.asarray(total)


def _significance(means: Floats, spread: Floats) -> float:
    """Significance of the differences between means with this covariance: their chi-square about the best common
    value."""
    if len(means) < 2:
        return 0.0
    values, vectors = np.linalg.eigh(spread)
    useful = values > 1e-9 * max(values.max(), 1e-300)
    basis = vectors[:, useful].T / np.sqrt(values[useful])[:, None]
    scores, ones = basis @ means, basis @ np.ones(len(means))
    scores = scores - ones * (ones @ scores) / (ones @ ones)
    freedom = max(1, int(useful.sum()) - 1)
    return max(0.0, significance_of_chi_square(float(scores @ scores) / freedom, freedom))


def _explained(signal: Floats, left: Floats, spread: Floats, counts: Floats) -> float:
    """1 − left/whole about the mean, less the share that bins of noise would take."""
    whole = float(np.sum((signal - signal.mean()) ** 2)) if len(signal) else 0.0
    if whole <= 0.0:
        return 0.0
    by_chance = float(np.sum(np.diag(spread) * counts))
    return float(np.clip((whole - float(left @ left) - by_chance) / whole, 0.0, 1.0))


AGAINST: tuple[AgainstWhat, ...] = get_args(AgainstWhat)
"""The quantities, in the order in which they are examined."""
BINS = 12
"""Most bins of a quantity."""
BIN_SECONDS = 1.0
"""Least duration of a bin of time, s."""
DIRECTION_EDGES = np.array([-1.5, -0.5, 0.5, 1.5])
"""Edges of the bins of direction: backwards, not yet moved, forwards."""


@dataclass(frozen=True)
class Quantities:
    """Quantities that a signal may depend on, all records of a machine in a row.

    values: by name (m, n), NaN where it is not known. stretches: rows without gaps.
    """

    values: dict[AgainstWhat, Floats]
    units: dict[AgainstWhat, tuple[str, ...]]
    stretches: tuple[slice, ...]


def quantities(motions: Sequence[AskedMotion]) -> Quantities:
    """The quantities of a machine's records. Time is each record's own; the drive is the recorded one."""
    per_record = [_of_record(asked) for asked in motions]
    stretches, begin = [], 0
    for record in (asked.record for asked in motions):
        stretches += [slice(begin + run.start, begin + run.stop) for run in record.runs]
        begin += len(record.measured)
    values = {name: np.concatenate([q[name] for q in per_record]) for name in AGAINST}
    return Quantities(values, units_of(motions[0].machine), tuple(stretches))


def units_of(machine: Machine) -> dict[AgainstWhat, tuple[str, ...]]:
    """Units of the quantities, joint by joint; of a drive that is a plain gain, of its torque or force."""
    joints = [machine.joint(j) for j in machine.modelled_joints]
    angle = tuple("rad" if j.kind == "revolute" else "m" for j in joints)
    gain = {"revolute": "N·m", "prismatic": "N"}
    return {
        "time": ("s",) * len(joints),
        "position": angle,
        "speed": tuple(f"{a}/s" for a in angle),
        "direction": ("1",) * len(joints),
        "drive": tuple({"dc_motor": "V", "current": "A"}.get(j.drive.kind, gain[j.kind]) for j in joints),
    }


def dependence(signal: Floats, joint: int, against: AgainstWhat, known: Quantities, floor: float) -> Bins | None:
    """Means of a signal (m,) of joint (index from 0) against a quantity; None where that does not vary."""
    quantity = known.values[against][:, joint]
    edges = _edges(quantity, against, known.stretches)
    return None if edges is None else binned(signal, quantity, edges, known.stretches, floor)


def dependences(signal: Floats, joint: int, known: Quantities, floor: float) -> Iterator[tuple[AgainstWhat, Bins]]:
    """The same against every quantity that varies."""
    for against in AGAINST:
        if (bins := dependence(signal, joint, against, known, floor)) is not None:
            yield against, bins


def table_of(signal: Floats, column: int, joint: int, known: Quantities, floor: float) -> list[Dependence]:
    """The same as an answer records it. column: index of the joint."""
    return [
        Dependence(
            joint=joint,
            against=against,
            unit=known.units[against][column],
            centres=tuple(map(float, bins.centres)),
            residual=optional(bins.mean),
            deviation=optional(bins.deviation),
            significance=bins.significance,
        )
        for against, bins in dependences(signal, column, known, floor)
    ]


def optional(values: Floats) -> tuple[float | None, ...]:
    """Numbers, None for NaN."""
    return tuple(None if math.isnan(v) else float(v) for v in values)


def _of_record(asked: AskedMotion) -> dict[AgainstWhat, Floats]:
    inputs = asked.record.inputs
    rows = np.round(inputs.rows).astype(np.int64)
    # A controller's drive contains the noise of the reading it responds to; one period later they are uncorrelated.
    late = 0 if isinstance(asked.machine.controller, NoController) else 1
    drive = inputs.drive[np.maximum(rows - late, 0)] if np.any(inputs.drive) else np.full_like(asked.position, np.nan)
    return {
        "time": np.repeat((inputs.time[rows] - inputs.time[0])[:, None], asked.position.shape[1], axis=1),
        "position": asked.position,
        "speed": asked.speed,
        "direction": asked.direction.astype(np.float64),
        "drive": drive,
    }


def _edges(quantity: Floats, against: AgainstWhat, stretches: Sequence[slice]) -> Floats | None:
    """Edges of the bins: equally spaced in time and position, equally filled in speed and drive, where most values are
    near zero."""
    values = np.concatenate([quantity[s] for s in stretches])
    values = values[np.isfinite(values)]
    if len(values) == 0 or np.ptp(values) < 1e-9:
        return None
    if against == "direction":
        return DIRECTION_EDGES
    low, high = float(values.min()), float(values.max())
    if against == "time":
        return np.linspace(low, high + 1e-9, 1 + int(np.clip((high - low) // BIN_SECONDS, 2, BINS)))
    if against == "position":
        return np.linspace(low, high + 1e-9, BINS + 1)
    moving = values[np.abs(values) > 0.02 * np.abs(values).max()]
    inner = np.quantile(moving, np.linspace(0, 1, BINS + 1)) if len(moving) > BINS else np.linspace(low, high, BINS + 1)
    edges = np.unique(np.concatenate([[low], inner[1:-1], [high + 1e-9]]))
    return edges if len(edges) > 2 else None
