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
from model.discrepancy.candidates.candidate_fit import CandidateFit
from model.discrepancy.output_error.calibration import Calibration
from model.discrepancy.output_error.observation import Observation, Signals, observe
from model.discrepancy.output_error.search import Point
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
        observation, given = observe(model, [imagined_trace(model, spec, plan)])
    except DaqError:
        return None
    counts = observation.deviations / observation.unit
    drawn = np.random.default_rng(noise_seed).standard_normal(observation.prepared[0].noise.shape)
    observation = observation.with_drive_as_input(False)  # nothing has been recorded yet
    return Imagined(observation, tuple(u for u in given.unknowns if u.trace is not None), (drawn * counts,))


@dataclass(frozen=True)
class Prediction:
    """What a point's model would show on an imagined experiment, by its shared unknowns and the experiment's starts."""

    there: Imagined
    point: Point

    @cached_property
    def begun(self) -> Calibration:
        """The point with those of its unknowns that belong to no trace, because they keep their values on the next one,
        and with the starts, at rest."""
        shared = self.point.only([k for k, u in enumerate(self.point.unknowns) if u.trace is None])
        starts = self.there.starts
        values = np.concatenate([shared.values, starts_at_rest(self.there.observation, shared, starts)])
        return Calibration(shared.model, (*shared.unknowns, *starts), values)

    def named(self, derivatives: Floats) -> dict[str, Floats]:
        """Rows of derivatives by the unknowns' names."""
        return dict(zip((u.name for u in self.begun.unknowns), derivatives, strict=True))

    def recorded(self) -> Prediction:
        """The same on the record that an arm like the point's model would leave. Not finite where its simulation is
        not."""
        own = self.there.observation.imagined(self.begun, self.there.noise)
        observation = own.with_drive_as_input(self.point.observation.drive_is_input)
        return replace(self, there=replace(self.there, observation=observation))

    @property
    def is_followed(self) -> bool:
        """Whether set points would not pause on an arm that has made the record: a margin is kept."""
        record = self.there.observation.records[0]
        set_points = record.inputs.set_points
        return falls_behind(self.point.model.machine, set_points, set_points - record.measured) is None

    def shown(self, values: Floats | None = None) -> Floats:
        """The simulation that is given the record, (N,) in deviations of a reading; at other values (p,) than the
        point's, if given. Not finite where the simulation is not."""
        own = self.begun if values is None else self.begun.at(values)
        return self.there.observation.weighted(self.there.observation.shown(own))

    def tangents(self, known: Mapping[str, Floats], values: Floats | None = None) -> Floats:
        """Derivatives (p, N) of that by the unknowns, at other values than the point's, if given. known: rows that are
        taken over by name, because those by the tolerance parameters change little.

        Raises SpecError when the simulation does not stay finite.
        """
        rows, unknowns = dict(known), self.begun.unknowns
        missing = [k for k, u in enumerate(unknowns) if u.name not in rows]
        if missing:
            own = self.begun if values is None else self.begun.at(values)
            new = self.there.observation.tangents(own, missing)
            rows |= {unknowns[k].name: row for k, row in zip(missing, new, strict=True)}
        return np.stack([rows[u.name] for u in unknowns])

    def known_so_far(self) -> Floats:
        """Information (p, p) about the shared unknowns from traces and priors, those of single traces marginalised;
        about the new starts, their priors."""
        mine = np.array([u.trace is None for u in self.point.unknowns])
        information = self.point.information.copy()
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


def starts_at_rest(observation: Observation, shared: Calibration, starts: Sequence[Unknown]) -> Floats:
    """Values of the starts of an observation's last record with which the arm's readings begin where the record does:
    there its controller holds it.

    An arm that began at the angles that are read would first make up for the error of its potentiometers, a motion that
    no record holds; and a fit that begins there ends in another minimum.
    """
    vector, _ = observation.state(shared)
    read = observation.records[-1].inputs.initial[:, 0]
    found = []
    for start in starts:
        (joint,) = start.joints
        first = at.slot(joint, 0)
        angle = wanted = read[joint - 1]
        for _ in range(MOST_ROUNDS):
            angle += wanted - sensed_angle(angle, vector[first : first + at.PER_JOINT])
        found.append(float(np.clip(angle - wanted, start.low, start.high)))
    return np.array(found)


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


def recorded_by(rivals: Sequence[CandidateFit], there: Imagined) -> list[Prediction]:
    """The rivals on the records that arms like them would leave of an experiment."""
    return [Prediction(there, r.fit.point).recorded() for r in rivals]


def separations(
    rivals: Sequence[CandidateFit], experiment: OfferedExperiment, own: Sequence[Prediction]
) -> Separations | None:
    """How far apart the rivals would be on an experiment; None where a simulation does not stay finite.

    Args:
        own: each rival on the record that an arm like it would leave.
    """
    points = [r.fit.point for r in rivals]
    signals = [prediction.shown() for prediction in own]
    if not all(np.isfinite(s).all() for s in signals):
        return None
    sizes, left = {}, {}
    try:
        first = own[0].named(own[0].tangents({}))
        for a, b in combinations(range(len(rivals)), 2):
            sides = [
                _unhidden(Prediction(own[true].there, points[wrong]), rivals[wrong], signals[true], first)
                for wrong, true in ((a, b), (b, a))
            ]
            sizes[a, b], left[a, b] = min(sides, key=lambda side: side[0])
    except SpecError:
        return None
    return Separations(experiment, own[0].there, sizes, left)


def _unhidden(
    predicted: Prediction, wrong: CandidateFit, target: Floats, known: dict[str, Floats]
) -> tuple[float, Floats]:
    """d′ of a rival that is wrong from what the record's own model would show, and what of the difference is left once
    its parameters have moved. They move twice: what an effect does is not proportional to its parameters.

    Raises SpecError when the simulation does not stay finite.
    """
    information, begun = predicted.known_so_far(), predicted.begun.values
    derivatives = predicted.tangents(known)
    delta = target - predicted.shown()
    moved = begun + np.linalg.solve(information + derivatives @ derivatives.T, derivatives @ delta)
    unknowns = predicted.begun.unknowns
    moved = np.clip(moved, [u.low for u in unknowns], [u.high for u in unknowns])
    own = {p.name for p in wrong.hypothesis.free}
    kept = {name: row for name, row in predicted.named(derivatives).items() if name not in own}
    derivatives = predicted.tangents(kept, moved)
    delta, distance = target - predicted.shown(moved), moved - begun
    if not np.isfinite(delta).all():
        raise SpecError("the simulation does not stay finite: the control loop is unstable")
    gradient = derivatives @ delta - information @ distance
    step = np.linalg.solve(information + derivatives @ derivatives.T, gradient)
    square = float(delta @ delta + distance @ information @ distance - gradient @ step)
    return float(np.sqrt(max(square, 0.0))), delta - step @ derivatives
