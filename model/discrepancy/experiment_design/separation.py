"""How far apart candidates would be on an experiment that has not been made.

The distance of two candidates is how badly the wrong one would fit a record of the other, after its parameters have
moved as far as the traces made so far and their priors allow: d′² = min over Δ of |δ − TΔ|² + Δᵀ S Δ, with δ the
difference of their readings in deviations of one reading, T the derivatives on the new experiment and S the information
there is already. Either may be the wrong one; the smaller of the two d′ counts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from daq.contracts.errors import DaqError, SpecError
from daq.contracts.experiment import ExperimentSpec, OfferedExperiment
from model import layout as at
from model.arrays import Floats
from model.design.information import Planner, falls_behind, imagined_trace
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.fitting import Fit
from model.discrepancy.engine.priors import prior_rows
from model.discrepancy.engine.residual import Signals
from model.discrepancy.readings.observation import Observation, observe
from model.discrepancy.readings.residual import ReadingResidual, samples_of
from model.discrepancy.thresholds import MOST_ROUNDS, WITHIN_NOISE
from model.drives.sensor import sensed_angle
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model

NOISE_SEED = 2
"""Seed of the readings' noise in an imagined run: without noise, friction would hold where the real arm creeps."""
LOOSE = 1e-9
"""Relative precision that stands for none, so that matrices can be inverted."""


@dataclass(frozen=True)
class Imagined:
    """An imagined experiment, prepared as a diagnosis prepares a trace.

    starts: the unknowns of its initial posture, known within a reading or so. noise: of the readings, counts.
    """

    observation: Observation
    starts: tuple[Unknown, ...]
    noise: Signals

    @property
    def duration(self) -> float:
        """s"""
        inputs = self.observation.records[0].inputs
        return len(inputs) * inputs.period


def imagine(model: Model, spec: ExperimentSpec, plan: Planner, noise_seed: int = NOISE_SEED) -> Imagined | None:
    """The experiment on the grid of control periods; None where the planner refuses it, or nothing would move."""
    try:
        observation, _, unknowns = observe(model, [imagined_trace(model, spec, plan)])
    except DaqError:
        return None
    counts = observation.deviations / observation.unit
    drawn = np.random.default_rng(noise_seed).standard_normal(observation.prepared[0].noise.shape)
    observation = observation.with_drive_as_input(False)  # nothing has been recorded yet
    return Imagined(observation, tuple(u for u in unknowns if u.trace is not None), (drawn * counts,))


@dataclass(frozen=True)
class Prediction:
    """What a fitted model would show on an imagined experiment, by its shared unknowns and the experiment's starts."""

    there: Imagined
    fit: Fit

    @cached_property
    def shared(self) -> tuple[Unknown, ...]:
        """The unknowns that belong to no trace, because they keep their values on the next one."""
        return tuple(u for u in self.fit.unknowns if u.trace is None)

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Those and the starts."""
        return (*self.shared, *self.there.starts)

    @cached_property
    def compared(self) -> ReadingResidual:
        """The model on the experiment's record."""
        own = self.fit.compared
        assert isinstance(own, ReadingResidual)
        forms = {n: u for n, u in own.known.items() if u.trace is None}
        known = {**forms, **{u.name: u for u in self.there.starts}}
        return ReadingResidual(self.fit.model, self.there.observation, samples_of(self.there.observation), known)

    @cached_property
    def begun(self) -> dict[str, float]:
        """The fitted values with the starts, at rest."""
        values = {u.name: self.fit.values[u.name] for u in self.shared}
        vectors, _ = self.compared.state(values)
        return {**values, **starts_at_rest(self.there.observation, vectors[0], self.there.starts)}

    def recorded(self) -> Prediction:
        """The same on the record that an arm like the model would leave. Not finite where its simulation is not."""
        state = self.compared.state(self.begun)
        own = self.there.observation.imagined(self.fit.model, state, self.there.noise)
        compared = self.fit.compared
        assert isinstance(compared, ReadingResidual)
        observation = own.with_drive_as_input(compared.observation.drive_is_input)
        return replace(self, there=replace(self.there, observation=observation))

    @property
    def is_followed(self) -> bool:
        """Whether set points would not pause on an arm that has made the record: a margin is kept."""
        record = self.there.observation.records[0]
        set_points = record.inputs.set_points
        return falls_behind(self.fit.model.machine, set_points, set_points - record.measured) is None

    def _weighted(self, rows: Floats) -> Floats:
        ones = np.ones(len(self.compared.floor))
        return self.compared.weighted(rows, self.compared.floor, ones)

    def left(self, values: Floats | None = None) -> Floats:
        """What the simulation that is given the record leaves of it, (N,) in deviations of a reading; at other values
        (p,) than the fitted ones, if given. Not finite where the simulation is not."""
        return self._weighted(self.compared.samples.flat(self.compared.at(self._named(values))))

    def _named(self, values: Floats | None) -> dict[str, float]:
        return self.begun if values is None else dict(zip((u.name for u in self.unknowns), values, strict=True))

    def tangents(self, known: Mapping[str, Floats], values: Floats | None = None) -> dict[str, Floats]:
        """Derivatives (N,) of the readings by the unknowns, at other values than the fitted ones, if given. known:
        those that are taken over by name, because those by the tolerance parameters change little.

        Raises SpecError when the simulation does not stay finite.
        """
        missing = [u for u in self.unknowns if u.name not in known]
        rows = -self._weighted(self.compared.slopes(self._named(values), missing)) if missing else np.zeros((0, 0))
        if not np.isfinite(rows).all():
            raise SpecError("the simulation does not stay finite: the control loop is unstable")
        found = {**known, **dict(zip((u.name for u in missing), rows, strict=True))}
        return {u.name: found[u.name] for u in self.unknowns}

    def known_so_far(self) -> Floats:
        """Information (p, p) about the shared unknowns from traces and priors, those of single traces marginalised;
        about the new starts, their priors."""
        mine = np.array([u.trace is None for u in self.fit.unknowns])
        slopes = self.fit.slopes()
        T = self.fit.weighted(np.stack([slopes[u.name] for u in self.fit.unknowns]))
        at = np.array([self.fit.values[u.name] for u in self.fit.unknowns])
        rows, _ = prior_rows(self.fit.unknowns, at)
        information = T @ T.T + rows.T @ rows
        information[np.diag_indices_from(information)] *= 1 + LOOSE
        inner, cross = information[np.ix_(~mine, ~mine)], information[np.ix_(~mine, mine)]
        left = information[np.ix_(mine, mine)]
        if len(inner):
            left = left - cross.T @ np.linalg.solve(inner, cross)
        starts = np.array([0.0 if u.deviation is None else u.deviation**-2 for u in self.there.starts])
        size = len(left) + len(starts)
        whole = np.zeros((size, size))
        whole[: len(left), : len(left)] = 0.5 * (left + left.T)
        whole[np.arange(len(left), size), np.arange(len(left), size)] = starts
        diagonal = np.diag(whole)
        whole[np.diag_indices(size)] += LOOSE * np.where(diagonal > 0, diagonal, 1.0)
        return whole


def starts_at_rest(observation: Observation, vector: Floats, starts: Sequence[Unknown]) -> dict[str, float]:
    """Values of the starts of an observation's last record with which the readings of an arm with these numbers begin
    where the record does: there its controller holds it.

    An arm that began at the angles that are read would first make up for the error of its potentiometers, a motion that
    no record holds; and a fit that begins there ends in another minimum.
    """
    read = observation.records[-1].inputs.initial[:, 0]
    found = {}
    for start in starts:
        (joint,) = start.joints
        first = at.slot(joint, 0)
        angle = wanted = read[joint - 1]
        for _ in range(MOST_ROUNDS):
            angle += wanted - sensed_angle(angle, vector[first : first + at.PER_JOINT])
        found[start.name] = float(np.clip(angle - wanted, start.low, start.high))
    return found


Pair = tuple[int, int]
"""Two rivals, by their places in a list, the first place first."""

ENOUGH = 10.0
"""Separation beyond which a shorter experiment is better than more separation, in deviations."""


@dataclass(frozen=True)
class Separations:
    """An experiment with its pairs' separations, and the part of each difference that could not be hidden, (N,)."""

    experiment: OfferedExperiment
    there: Imagined
    sizes: dict[Pair, float]
    left: dict[Pair, Floats]

    def worth(self, pairs: Sequence[Pair]) -> tuple[bool, float]:
        """Its rank for some pairs: experiments that separate them come first, then the most separation (up to `ENOUGH`)
        per second."""
        separation = min(self.sizes[p] for p in pairs)
        return separation >= WITHIN_NOISE, min(separation, ENOUGH) ** 2 / self.there.duration


def recorded_by(rivals: Sequence[Fitted], there: Imagined) -> list[Prediction]:
    """The rivals on the records that arms like them would leave of an experiment."""
    return [Prediction(there, r.fit).recorded() for r in rivals]


def separations(
    rivals: Sequence[Fitted], experiment: OfferedExperiment, own: Sequence[Prediction]
) -> Separations | None:
    """How far apart the rivals would be on an experiment; None where a simulation does not stay finite.

    Args:
        own: each rival on the record that an arm like it would leave.
    """
    signals = [prediction.left() for prediction in own]
    if not all(np.isfinite(s).all() for s in signals):
        return None
    sizes, left = {}, {}
    try:
        first = own[0].tangents({})
        for a, b in combinations(range(len(rivals)), 2):
            sides = [
                _unhidden(Prediction(own[true].there, rivals[wrong].fit), rivals[wrong], signals[true], first)
                for wrong, true in ((a, b), (b, a))
            ]
            sizes[a, b], left[a, b] = min(sides, key=lambda side: side[0])
    except SpecError:
        return None
    return Separations(experiment, own[0].there, sizes, left)


def _unhidden(predicted: Prediction, wrong: Fitted, target: Floats, known: dict[str, Floats]) -> tuple[float, Floats]:
    """d′ of a rival that is wrong from what the record's own model would leave, and what of the difference is left once
    its parameters have moved. They move twice: what an effect does is not proportional to its parameters.

    Raises SpecError when the simulation does not stay finite.
    """
    information, unknowns = predicted.known_so_far(), predicted.unknowns
    begun = np.array([predicted.begun[u.name] for u in unknowns])
    shared = {u.name for u in unknowns}
    rows = predicted.tangents({n: row for n, row in known.items() if n in shared})
    derivatives = np.stack(list(rows.values()))
    delta = predicted.left() - target
    moved = begun + np.linalg.solve(information + derivatives @ derivatives.T, derivatives @ delta)
    moved = np.clip(moved, [u.low for u in unknowns], [u.high for u in unknowns])
    own = {p.name for p in wrong.parameters}
    rows = predicted.tangents({name: row for name, row in rows.items() if name not in own}, moved)
    derivatives = np.stack(list(rows.values()))
    delta, distance = predicted.left(moved) - target, moved - begun
    if not np.isfinite(delta).all():
        raise SpecError("the simulation does not stay finite: the control loop is unstable")
    gradient = derivatives @ delta - information @ distance
    step = np.linalg.solve(information + derivatives @ derivatives.T, gradient)
    square = float(delta @ delta + distance @ information @ distance - gradient @ step)
    return float(np.sqrt(max(square, 0.0))), delta - step @ derivatives
