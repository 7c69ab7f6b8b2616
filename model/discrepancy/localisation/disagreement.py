"""Where simulation and measurement disagree: by joint, time, phase of motion, and what the residual depends on."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from model.arrays import Floats, Integers
from model.discrepancy.diagnosis import UNWRITTEN, Dependence, PhaseCell, Where, WorstPlace
from model.discrepancy.localisation.phases import HOLD, PHASES, Residuals
from model.discrepancy.localisation.statistics import (
    LEAST,
    Correlation,
    chance_significance,
    correlation_of,
    quantities,
    significance_of_chi_square,
    significance_of_squares,
    table_of,
)
from model.units import joint_unit

WINDOW = 0.3
"""Duration of one cell of the map, s."""
CHANCE = 0.01
"""Probability that noise alone makes any cell of the map significant."""
MEDIAN_OF_NOISE = 0.9
"""Median of a window's mean square where there is noise alone: a little below its mean."""
MOST_NOISE = 1.5
"""Largest variance that counts as noise, relative to the stated one."""


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


@dataclass(frozen=True)
class _Map:
    """Residuals in terms of their noise, and the phase of motion of every sample."""

    residuals: Residuals

    @property
    def joints(self) -> tuple[int, ...]:
        """The joints of the columns."""
        return self.residuals.model.machine.modelled_joints

    @cached_property
    def phases(self) -> list[Integers]:
        """Per record (m, n), index of `PHASES`."""
        return [asked.phases for asked in self.residuals.motions]

    @cached_property
    def weighted(self) -> list[Floats]:
        """Residuals per record (m, n), in terms of the noise that the record's quieter half shows.

        That noise lies between the stated one and `MOST_NOISE` times its variance: a sensor a little noisier than
        stated is no disagreement.
        """
        records = self.residuals.records
        weighted = [r / self.residuals.deviations for r in self.residuals.signals]
        squares = [
            np.mean(signal[window] ** 2, axis=0)
            for signal, record in zip(weighted, records, strict=True)
            for run in record.runs
            for window in _windows(run, record.inputs.period)
        ]
        quiet = np.median(np.array(squares), axis=0) / MEDIAN_OF_NOISE
        return [signal / np.sqrt(np.clip(quiet, 1.0, MOST_NOISE)) for signal in weighted]

    @cached_property
    def correlations(self) -> list[Correlation]:
        """Autocorrelation of each joint's weighted residual."""
        records = self.residuals.records
        return [
            correlation_of([w[run, j] for w, r in zip(self.weighted, records, strict=True) for run in r.runs], LEAST)
            for j in range(len(self.joints))
        ]

    @cached_property
    def shares(self) -> list[list[_Share]]:
        """Shares of each phase in the residual, by joint."""
        return [self._shares(j) for j in range(len(self.joints))]

    def cells(self) -> list[PhaseCell]:
        """Windows of each record and joint, with the phase that most of their samples belong to."""
        found = []
        for t, (record, signal, phase) in enumerate(
            zip(self.residuals.records, self.weighted, self.phases, strict=True)
        ):
            period = record.inputs.period
            time = record.inputs.rows * period
            for run in record.runs:
                windows = _windows(run, period)
                squares = np.array([np.mean(signal[w] ** 2, axis=0) for w in windows])
                for j, joint in enumerate(self.joints):
                    beyond = _beyond(windows, squares[:, j], self.correlations[j])
                    for window, square, significance in zip(windows, squares[:, j], beyond, strict=True):
                        counts = np.bincount(phase[window, j], minlength=len(PHASES))
                        cell = PhaseCell(
                            joint=joint,
                            start=round(float(time[window.start]), 4),
                            end=round(float(time[window.stop - 1] + period), 4),
                            phase=PHASES[int(counts.argmax())],
                            mean_square=float(square),
                            significance=float(significance),
                            trace=t,
                        )
                        found.append(cell)
        return found

    def worst(self) -> tuple[int, int] | None:
        """Joint (index) with the most beyond noise, and its phase in which a sample is furthest off; None where nothing
        is significant."""
        least = chance_significance(sum(len(s) for s in self.shares), CHANCE)
        best: tuple[float, int] | None = None
        for j, own in enumerate(self.shares):
            beyond = sum(s.excess for s in own if s.significance > least)
            if beyond > 0 and (best is None or beyond > best[0]):
                best = beyond, j
        if best is None:
            return None
        own = [s for s in self.shares[best[1]] if s.significance > least]
        # a phase of few samples is named only where it holds a fair part of the disagreement
        weighty = [s for s in own if s.excess > 0.1 * best[0]]
        return best[1], max(weighty, key=lambda s: s.mean_square).phase

    def worst_place(self, place: tuple[int, int] | None) -> WorstPlace:
        """The place in numbers; where nothing is significant, the joint and phase that come nearest."""
        if place is None:
            joint, own = max(
                ((j, s) for j, ss in enumerate(self.shares) for s in ss),
                key=lambda e: e[1].significance,
                default=(0, None),
            )
            nearest, ratio = (HOLD, 1.0) if own is None else (own.phase, math.sqrt(own.mean_square))
            return WorstPlace(joint=self.joints[joint], phase=PHASES[nearest], ratio=ratio)
        j, phase = place
        residuals = self.residuals
        own_residual = np.concatenate(
            [
                r[run, j][p[run, j] == phase]
                for r, p, record in zip(residuals.signals, self.phases, residuals.records, strict=True)
                for run in record.runs
            ]
        )
        rms, floor = float(np.sqrt(np.mean(own_residual**2))), float(residuals.deviations[j])
        sensor = residuals.model.machine.joint(self.joints[j]).sensor
        unit = joint_unit(residuals.model.machine, self.joints[j])
        return WorstPlace(
            joint=self.joints[j],
            phase=PHASES[phase],
            ratio=rms / floor,
            rms=rms,
            floor=floor,
            unit=f"{unit}/s" if sensor is not None and sensor.measures == "velocity" else unit,
        )

    def _shares(self, j: int) -> list[_Share]:
        records, correlation = self.residuals.records, self.correlations[j]
        signal = np.concatenate([w[run, j] for w, r in zip(self.weighted, records, strict=True) for run in r.runs])
        phase = np.concatenate([p[run, j] for p, r in zip(self.phases, records, strict=True) for run in r.runs])
        found = []
        for number in range(len(PHASES)):
            own = signal[phase == number]
            if len(own) == 0:
                continue
            mean_square = float(np.mean(own**2))
            samples = correlation.samples_of_square(len(own))
            found.append(_Share(number, mean_square, significance_of_chi_square(mean_square, samples), len(own)))
        return found


def locate(residuals: Residuals) -> Where:
    """Where a model's residuals exceed noise.

    Significances take into account that neighbouring samples are correlated: each mean square counts as many samples as
    the residual's own autocorrelation leaves independent. A misfit makes the residual more correlated, so that it is
    judged on fewer samples than noise of the sensor would be: significances are rather too small than too large.

    Where even the quieter half of a joint's windows exceeds the stated noise, by up to 1.5 times its variance, that
    larger value counts as the noise.
    """
    found = _Map(residuals)
    place = found.worst()
    return Where(
        joint=None if place is None else found.joints[place[0]],
        phase=None if place is None else PHASES[place[1]],
        summary=UNWRITTEN,
        cells=tuple(found.cells()),
        dependences=tuple(_dependences(residuals)),
        worst=found.worst_place(place),
    )


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


def _dependences(residuals: Residuals) -> Iterator[Dependence]:
    """The residual of every joint against every quantity that varies."""
    known, every = quantities(residuals.motions), np.concatenate(list(residuals.signals))
    for j, joint in enumerate(residuals.model.machine.modelled_joints):
        yield from table_of(every[:, j], j, joint, known, LEAST * float(residuals.deviations[j]))
