"""Finite trials of every candidate: what each could take off the residual once the tolerance parameters have moved too.

A candidate is simulated at a few sizes, not differentiated where it is absent: backlash, a dead zone or a limit has no
useful derivative there. The difference it makes is compared with the residual after what the tolerance parameters could
explain has been taken out of both, at the price of their priors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.discrepancy.candidates.library import SMALL, Candidate
from model.discrepancy.output_error.observation import Observation, step_of_derivatives
from model.discrepancy.output_error.search import Point
from model.discrepancy.output_error.side_by_side import side_by_side

Floats = NDArray[np.float64]

LARGEST_STRETCH = 2.0
"""A trial may be scaled so far; beyond, the response is no longer in proportion."""
LEAST_STRETCH = 0.3
LEAST_RESPONSE = 0.01
"""Deviations of a reading, over the whole record: a candidate that does less at its expected size cannot be seen."""


@dataclass(frozen=True)
class Probed:
    """A candidate at its best trial: the fall of the cost that it promises, parameters to start a fit from, how far the
    other unknowns would then move (p,), and what the trial does to the weighted readings (N,)."""

    candidate: Candidate
    gain: float
    start: dict[str, float]
    moved: Floats
    response: Floats


@dataclass(frozen=True)
class Projection:
    """Takes out of signals what the tolerance parameters explain at the price of their priors."""

    tangents: Floats
    inverse: Floats
    residual: Floats
    pull: Floats

    def gains(self, responses: Floats, columns: slice | NDArray[np.int64] = slice(None)) -> tuple[Floats, Floats]:
        """For responses (k, N′), nonzero at `columns` only: the inner product with the residual and the square, both
        after projection, (k,) each."""
        shared = self.tangents[:, columns] @ responses.T
        explained = self.inverse @ shared
        squares = np.einsum("kn,kn->k", responses, responses) - np.einsum("pk,pk->k", shared, explained)
        return responses @ self.residual[columns] - explained.T @ self.pull, np.maximum(squares, 0.0)

    def moves(self, response: Floats, columns: slice | NDArray[np.int64] = slice(None)) -> Floats:
        """How far the tolerance parameters move, (p,), when a response (N′,) is there."""
        return np.asarray(self.inverse @ (self.pull - self.tangents[:, columns] @ response))

    def cross(self, one: Floats, other: Floats, columns: slice | NDArray[np.int64]) -> Floats:
        """Inner products, pair by pair, of responses (k, N′) after projection, (k,)."""
        tangents = self.tangents[:, columns]
        explained = self.inverse @ (tangents @ other.T)
        return np.asarray(np.einsum("kn,kn->k", one, other) - np.einsum("pk,pk->k", tangents @ one.T, explained))


def projection(point: Point) -> Projection:
    """The projection at a point."""
    pull = point.tangents @ point.weighted - point.precision * (point.values - point.expected)
    information = point.information
    information[np.diag_indices_from(information)] *= 1 + 1e-9
    return Projection(point.tangents, np.asarray(np.linalg.inv(information), dtype=np.float64), point.weighted, pull)


def probed(observation: Observation, point: Point, candidates: Sequence[Candidate]) -> list[Probed]:
    """Every candidate at its best trial, the most promising first; those that do nothing are left out."""
    clear = projection(point)
    step = step_of_derivatives(point.model)
    coarse = observation.shown(point.model, point.unknowns, point.values, step)
    fine = [r.measured - e for r, e in zip(observation.records, point.residuals, strict=True)]

    def best(candidate: Candidate) -> Probed | None:
        reference = coarse if step_of_derivatives(candidate.model) == step else fine
        return _best_trial(observation, point, clear, reference, candidate)

    found = [p for p in side_by_side(best, candidates) if p is not None]
    return sorted(found, key=lambda p: -p.gain)


def still_promising(
    point: Point, candidates: Sequence[Candidate], earlier: Sequence[Probed], least: float
) -> list[Candidate]:
    """Candidates but for those whose response, as an earlier probe has seen it, cannot explain what is left any more.

    Args:
        least: gain from which a candidate is kept: well below what a fit is worth, for its best trial may be another
            one now.
    """
    clear = projection(point)
    known = {_key(probe.candidate): probe.response for probe in earlier}
    kept = []
    for candidate in candidates:
        response = known.get(_key(candidate))
        if response is not None:
            products, squares = clear.gains(response[None])
            if products[0] ** 2 < least * squares[0]:
                continue
        kept.append(candidate)
    return kept


def _key(candidate: Candidate) -> tuple[str, tuple[int, ...], tuple[str, ...]]:
    """Tells candidates apart, also two laws of one name."""
    return candidate.name, candidate.joints, tuple(p.name for p in candidate.free)


def _best_trial(
    observation: Observation, point: Point, clear: Projection, reference: Sequence[Floats], candidate: Candidate
) -> Probed | None:
    if not candidate.trials:
        return None
    trials = [_from_here(point, candidate, trial) for trial in candidate.trials]
    held = {u.name: k for k, u in enumerate(point.unknowns)}
    if all(p.name in held for p in candidate.free):
        responses = _along_tangents(point, held, trials)
    else:
        responses = _simulated(observation, point, reference, candidate, trials)
    sound = np.asarray(np.isfinite(responses).all(axis=1))
    responses[~sound] = 0.0
    products, squares = clear.gains(responses)
    best: Probed | None = None
    for k, trial in enumerate(trials):
        if not sound[k] or squares[k] < (LEAST_RESPONSE * (SMALL if candidate.proportional else 1.0)) ** 2:
            continue
        stretch = products[k] / squares[k]
        if not candidate.proportional:
            stretch = float(np.clip(stretch, LEAST_STRETCH, LARGEST_STRETCH))
        start, stretch = _stretched(point, candidate, trial, stretch)
        gain = float(2 * stretch * products[k] - stretch**2 * squares[k])
        if best is None or gain > best.gain:
            best = Probed(candidate, gain, start, clear.moves(stretch * responses[k]), responses[k])
    return best


def _along_tangents(point: Point, held: Mapping[str, int], trials: Sequence[dict[str, float]]) -> Floats:
    """Responses (k, N) of a candidate that only lifts priors: along the very derivatives that are projected away, or
    what those and a simulation differ by would look like the candidate's own."""
    return np.stack([sum((v - point.values[held[n]]) * point.tangents[held[n]] for n, v in t.items()) for t in trials])


def _simulated(
    observation: Observation, point: Point, reference: Sequence[Floats], candidate: Candidate,
    trials: Sequence[dict[str, float]],
) -> Floats:  # fmt: skip
    """Responses (k, N) of trials of a candidate, each simulated at its size; not finite where a simulation is not.
    They are simulated as derivatives are, for derivatives are projected out of them."""
    vector, initials = observation.state(candidate.model, point.unknowns, point.values)
    vectors = np.tile(vector, (len(trials), 1))
    for row, trial in zip(vectors, trials, strict=True):
        for name, value in trial.items():
            row[list(candidate.model.parameter(name).slots)] = value
    starts = [np.tile(i, (len(vectors), 1, 1)) for i in initials]
    shown = observation.readings(candidate.model, vectors, starts, step_of_derivatives(candidate.model))
    return observation.weighted([y - y0 for y, y0 in zip(shown, reference, strict=True)])


def _from_here(point: Point, candidate: Candidate, trial: dict[str, float]) -> dict[str, float]:
    """A trial of a parameter that the point has found already, with a prior: as far from where it is now."""
    if not candidate.proportional:
        return trial
    held = {u.name: float(v) for u, v in zip(point.unknowns, point.values, strict=True)}
    moved = dict(trial)
    for p in candidate.main:
        if p.name in trial and p.name in held:
            size = trial[p.name] - p.value
            inside = p.low <= held[p.name] + size <= p.high
            moved[p.name] = held[p.name] + (size if inside else -size)
    return moved


def _stretched(
    point: Point, candidate: Candidate, trial: dict[str, float], stretch: float
) -> tuple[dict[str, float], float]:
    """Parameters for a trial of `stretch` times its size, kept within bounds, and the stretch that is left."""
    start = dict(trial)
    held = {u.name: float(v) for u, v in zip(point.unknowns, point.values, strict=True)}
    for p in candidate.main:
        if p.name in trial:
            absent = held.get(p.name, p.value if p.effect != "motor_inductance" or p.null is None else p.null)
            size = trial[p.name] - absent
            value = float(np.clip(absent + stretch * size, p.low, p.high))
            stretch = (value - absent) / size if size else stretch
            start[p.name] = value
    return start, stretch
