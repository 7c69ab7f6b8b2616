"""Where simulation and measurement disagree: by joint, time, phase of motion, and what the residual goes with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import UNWRITTEN, Dependence, PhaseCell, Where, WorstPlace
from model.discrepancy.localisation.dependence import AGAINST, dependence, quantities
from model.discrepancy.localisation.phases import HOLD, PHASES, phases_of
from model.discrepancy.localisation.statistics import (
    Correlation,
    chance_significance,
    correlation_of,
    significance_of_chi_square,
    significance_of_squares,
)
from model.discrepancy.localisation.varying_parameters import moving_parameters
from model.fitting.records import Record, resolution
from model.machine_model.model import Model

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

WINDOW = 0.3
"""s of one cell of the map."""
CHANCE = 0.01
"""Probability that noise alone makes any cell of the map significant."""
MEDIAN_OF_NOISE = 0.9
"""Median of a window's mean square where there is noise alone: a little below its mean."""
MOST_NOISE = 1.5
"""Times the stated variance that noise may have."""
LEAST = 0.3
"""Least deviation of a residual, in that of noise, from which its correlation is taken."""


@dataclass(frozen=True)
class _Share:
    """A joint in a phase: mean square of the weighted residual, how far beyond noise, and how many samples."""

    phase: int
    mean_square: float
    significance: float
    count: int

    @property
    def excess(self) -> float:
        """Sum of squares beyond noise."""
        return (self.mean_square - 1.0) * self.count


def located(
    model: Model, records: Sequence[Record], residuals: Sequence[Floats], deviations: Floats, *,
    traces: Sequence[Trace] = (),
) -> Where:  # fmt: skip
    """Where a model's residuals exceed noise.

    Significances take into account that neighbouring samples are alike: each mean square counts as many samples as the
    residual's own autocorrelation leaves independent. A misfit makes the residual more alike, so that it is judged on
    fewer samples than noise of the sensor would be: significances are rather too small than too large.

    Args:
        residuals: per record (m, n) measured − simulated, in the unit of the measurement.
        deviations: (n,) standard deviation of such a residual when nothing is wrong. Where even the quieter half of a
            joint's windows has more, up to 1.5 times the variance, that counts as the noise.
        traces: the same records as traces, where α(t) is wanted; needs the recorded drive (about 0.5 s).

    Raises:
        SpecError: for residuals that do not belong to the records, or deviations that are not positive.
    """
    _check(records, residuals, deviations)
    phases = [phases_of(model, record) for record in records]
    weighted = _quietened([r / deviations for r in residuals], records)
    correlations = [
        correlation_of([w[run, j] for w, record in zip(weighted, records, strict=True) for run in record.runs], LEAST)
        for j in range(model.joint_count)
    ]
    cells = _cells(model, records, weighted, phases, correlations)
    shares = [_shares(j, records, weighted, phases, correlations[j]) for j in range(model.joint_count)]
    dependences = _dependences(model, records, residuals, deviations)
    place = _worst(shares)
    moving = tuple(m for trace in traces[:1] for m in moving_parameters(model, trace))
    worst = _worst_place(model, records, residuals, deviations, phases, place, shares)
    joint = None if place is None else model.machine.modelled_joints[place[0]]
    phase = None if place is None else PHASES[place[1]]
    return Where(
        joint=joint, phase=phase, summary=UNWRITTEN, cells=tuple(cells), dependences=tuple(dependences), moving=moving,
        worst=worst,
    )  # fmt: skip


def _quietened(weighted: Sequence[Floats], records: Sequence[Record]) -> list[Floats]:
    """Weighted residuals in terms of the noise that the record's quieter half shows, between what is stated and
    `MOST_NOISE` times its variance: a sensor a little noisier than stated is no disagreement."""
    squares = [
        np.mean(signal[window] ** 2, axis=0)
        for signal, record in zip(weighted, records, strict=True)
        for run in record.runs for window in _windows(run, record.inputs.period)
    ]  # fmt: skip
    quiet = np.median(np.array(squares), axis=0) / MEDIAN_OF_NOISE
    return [signal / np.sqrt(np.clip(quiet, 1.0, MOST_NOISE)) for signal in weighted]


def _check(records: Sequence[Record], residuals: Sequence[Floats], deviations: Floats) -> None:
    if len(records) != len(residuals):
        raise SpecError(f"{len(residuals)} residuals for {len(records)} records: one (m, n) array a record is needed")
    for record, residual in zip(records, residuals, strict=True):
        if residual.shape != record.measured.shape:
            raise SpecError(
                f"residual of {record.name} has shape {residual.shape}: one (m, n) array a record is needed, here "
                f"{record.measured.shape}"
            )
    if not (np.isfinite(deviations).all() and (deviations > 0).all()):
        raise SpecError(f"deviations of the noise {deviations}: must be positive numbers")


def _cells(
    model: Model, records: Sequence[Record], weighted: Sequence[Floats], phases: Sequence[Integers],
    correlations: Sequence[Correlation],
) -> list[PhaseCell]:  # fmt: skip
    """The map: windows of each record and joint, with the phase that most of their samples belong to."""
    found = []
    for t, (record, signal, phase) in enumerate(zip(records, weighted, phases, strict=True)):
        period = record.inputs.period
        time = record.inputs.rows * period
        for run in record.runs:
            windows = _windows(run, period)
            squares = np.array([np.mean(signal[w] ** 2, axis=0) for w in windows])
            for j, joint in enumerate(model.machine.modelled_joints):
                beyond = _beyond(windows, squares[:, j], correlations[j])
                for window, square, significance in zip(windows, squares[:, j], beyond, strict=True):
                    counts = np.bincount(phase[window, j], minlength=len(PHASES))
                    found.append(PhaseCell(
                        joint=joint, start=round(float(time[window.start]), 4),
                        end=round(float(time[window.stop - 1] + period), 4), phase=PHASES[int(counts.argmax())],
                        mean_square=float(square), significance=float(significance), trace=t,
                    ))  # fmt: skip
    return found


def _beyond(windows: Sequence[slice], squares: Floats, correlation: Correlation) -> Floats:
    """Significance of the mean square of every window, each for as many samples as it holds."""
    counts = np.array([w.stop - w.start for w in windows])
    found = np.zeros(len(windows))
    for count in np.unique(counts):
        found[counts == count] = significance_of_squares(squares[counts == count], int(count), correlation)
    return found


def _windows(run: slice, period: float) -> list[slice]:
    """Consecutive windows of a stretch; a rest shorter than half a window belongs to the last one."""
    size = max(1, round(WINDOW / period))
    begins = list(range(run.start, run.stop, size))
    if len(begins) > 1 and run.stop - begins[-1] < size / 2:
        begins.pop()
    return [slice(a, b) for a, b in zip(begins, [*begins[1:], run.stop], strict=True)]


def _shares(
    j: int, records: Sequence[Record], weighted: Sequence[Floats], phases: Sequence[Integers], correlation: Correlation
) -> list[_Share]:
    signal = np.concatenate([w[run, j] for w, r in zip(weighted, records, strict=True) for run in r.runs])
    phase = np.concatenate([p[run, j] for p, r in zip(phases, records, strict=True) for run in r.runs])
    found = []
    for number in range(len(PHASES)):
        own = signal[phase == number]
        if len(own) == 0:
            continue
        mean_square = float(np.mean(own**2))
        samples = correlation.samples_of_square(len(own))
        found.append(_Share(number, mean_square, significance_of_chi_square(mean_square, samples), len(own)))
    return found


def _worst(shares: Sequence[list[_Share]]) -> tuple[int, int] | None:
    """Joint (index) with the most beyond noise, and its phase in which a sample is furthest off; None where nothing is
    significant."""
    least = chance_significance(sum(len(s) for s in shares), CHANCE)
    best: tuple[float, int] | None = None
    for j, own in enumerate(shares):
        beyond = sum(s.excess for s in own if s.significance > least)
        if beyond > 0 and (best is None or beyond > best[0]):
            best = beyond, j
    if best is None:
        return None
    own = [s for s in shares[best[1]] if s.significance > least]
    # a phase of few samples is named only where it holds a fair part of the disagreement
    weighty = [s for s in own if s.excess > 0.1 * best[0]]
    return best[1], max(weighty, key=lambda s: s.mean_square).phase


def _dependences(
    model: Model, records: Sequence[Record], residuals: Sequence[Floats], deviations: Floats
) -> list[Dependence]:
    known = quantities(model, records)
    every = np.concatenate(list(residuals))
    found = []
    for j, joint in enumerate(model.machine.modelled_joints):
        for against in AGAINST:
            bins = dependence(every[:, j], j, against, known, LEAST * float(deviations[j]))
            if bins is None:
                continue
            found.append(Dependence(
                joint=joint, against=against, unit=known.units[against][j], centres=tuple(map(float, bins.centres)),
                residual=optional(bins.mean), deviation=optional(bins.deviation), significance=bins.significance,
            ))  # fmt: skip
    return found


def optional(values: Floats) -> tuple[float | None, ...]:
    """Numbers, None for NaN."""
    return tuple(None if math.isnan(v) else float(v) for v in values)


def _worst_place(
    model: Model, records: Sequence[Record], residuals: Sequence[Floats], deviations: Floats,
    phases: Sequence[Integers], place: tuple[int, int] | None, shares: Sequence[list[_Share]],
) -> WorstPlace:  # fmt: skip
    """The place in numbers; where nothing is significant, the joint and phase that come nearest."""
    joints = model.machine.modelled_joints
    if place is None:
        joint, own = max(
            ((j, s) for j, ss in enumerate(shares) for s in ss), key=lambda e: e[1].significance, default=(0, None)
        )
        nearest, ratio = (HOLD, 1.0) if own is None else (own.phase, math.sqrt(own.mean_square))
        return WorstPlace(joint=joints[joint], phase=PHASES[nearest], ratio=ratio)
    j, phase = place
    own_residual = np.concatenate([
        r[run, j][p[run, j] == phase]
        for r, p, record in zip(residuals, phases, records, strict=True) for run in record.runs
    ])  # fmt: skip
    scale, unit = spoken_unit(model, joints[j])
    rms, floor = float(np.sqrt(np.mean(own_residual**2))), float(deviations[j])
    return WorstPlace(
        joint=joints[j], phase=PHASES[phase], ratio=rms / floor, rms=rms * scale, floor=floor * scale, unit=unit
    )


def spoken_unit(model: Model, joint: int) -> tuple[float, str]:
    """Factor and name of the unit in which people speak of a joint's residual: counts of its sensor, degrees, mm."""
    sensor = model.machine.joint(joint).sensor
    if sensor is not None and sensor.measures == "position":
        return 1.0 / resolution(sensor), "ADC counts"
    speed = "/s" if sensor is not None and sensor.measures == "velocity" else ""
    if model.machine.joint(joint).kind == "revolute":
        return math.degrees(1.0), f"°{speed}"
    return 1e3, f"mm{speed}"
