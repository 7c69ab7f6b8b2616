"""Probes: how much of the residual every hypothesis could remove, with the tolerance parameters free to follow.

A hypothesis is simulated at a few sizes, not differentiated where the effect is absent: backlash, a dead zone or a
limit has no useful derivative there. The difference it makes is compared with the residual, after what the tolerance
parameters can explain at the cost of their priors has been projected out of both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.arrays import Floats
from model.discrepancy.candidates.library import SMALL, Hypothesis
from model.discrepancy.output_error.observation import side_by_side, step_of_derivatives
from model.discrepancy.output_error.search import Point
from model.machine_model.record_verdict import FAR_OFF

LARGEST_STRETCH = 2.0
"""Largest factor by which a trial is scaled: beyond it, the response is no longer proportional."""
LEAST_STRETCH = 0.3
"""Smallest such factor."""
LEAST_RESPONSE = 0.01
"""Norm of a response over the whole record, in deviations of a reading, below which an effect of the expected size
cannot be seen."""


@dataclass(frozen=True)
class Probe:
    """A hypothesis at its best trial.

    gain: the fall of the cost that it promises. start: parameters to begin a fit from. moved: (p,) how far the other
    unknowns would then move. response: (N,) what the trial does to the weighted readings.
    """

    hypothesis: Hypothesis
    gain: float
    start: dict[str, float]
    moved: Floats
    response: Floats


@dataclass(frozen=True)
class Projection:
    """Projects out of signals what the tolerance parameters explain at the cost of their priors."""

    tangents: Floats
    inverse: Floats
    residual: Floats
    pull: Floats

    def gains(self, responses: Floats, columns: slice | NDArray[np.int64] = slice(None)) -> tuple[Floats, Floats]:
        """Inner products with the residual, and squares, of responses (k, N′) after projection, (k,) each. The
        responses are zero outside `columns`."""
        shared = self.tangents[:, columns] @ responses.T
        explained = self.inverse @ shared
        squares = np.einsum("kn,kn->k", responses, responses) - np.einsum("pk,pk->k", shared, explained)
        return responses @ self.residual[columns] - explained.T @ self.pull, np.maximum(squares, 0.0)

    def moves(self, response: Floats) -> Floats:
        """How far the tolerance parameters move, (p,), when a response (N,) is there."""
        return np.asarray(self.inverse @ (self.pull - self.tangents @ response))

    def cross(self, one: Floats, other: Floats, columns: slice | NDArray[np.int64]) -> Floats:
        """Inner products, pair by pair, of responses (k, N′) after projection, (k,)."""
        tangents = self.tangents[:, columns]
        explained = self.inverse @ (tangents @ other.T)
        return np.asarray(np.einsum("kn,kn->k", one, other) - np.einsum("pk,pk->k", tangents @ one.T, explained))


def projection(point: Point) -> Projection:
    """The projection at a point."""
    pull = point.tangents @ point.weighted - point.precision * (point.values - point.expected)
    information = point.information.copy()
    information[np.diag_indices_from(information)] *= 1 + 1e-9
    return Projection(point.tangents, inverse_of(information), point.weighted, pull)


def inverse_of(information: Floats) -> Floats:
    """Inverse (p, p) of what is known of unknowns; a direction of which nothing is known explains nothing.

    An effect whose law never acts on the record, as a cable that is never taut, leaves its numbers without any
    information, and they have no prior.
    """
    try:
        return np.asarray(np.linalg.inv(information), dtype=np.float64)
    except np.linalg.LinAlgError:
        known = np.diag(information) > 0.0
        scale = np.where(known, 1.0 / np.sqrt(np.where(known, np.diag(information), 1.0)), 0.0)
        both = np.outer(scale, scale)  # units differ by many powers of ten
        return np.asarray(np.linalg.pinv(information * both, rcond=1e-12, hermitian=True) * both, dtype=np.float64)


def probe(point: Point, tried: Sequence[Hypothesis]) -> list[Probe]:
    """Every hypothesis at its best trial, the most promising first; those without a response are left out."""
    clear = projection(point)
    step = step_of_derivatives(point.model)
    coarse = point.observation.shown(point, step)
    fine = [r.measured - e for r, e in zip(point.observation.records, point.residuals, strict=True)]

    def best(hypothesis: Hypothesis) -> Probe | None:
        reference = coarse if step_of_derivatives(hypothesis.model) == step else fine
        return _best_trial(point, clear, reference, hypothesis)

    found = [p for p in side_by_side(best, tried) if p is not None]
    return sorted(found, key=lambda p: -p.gain)


def keep_promising(
    point: Point, tried: Sequence[Hypothesis], earlier: Sequence[Probe], least: float
) -> list[Hypothesis]:
    """The hypotheses without those whose response in an earlier probe can no longer explain what is left.

    Args:
        least: gain from which a hypothesis is kept: well below what makes a fit worthwhile, because another trial may
        be
            its best one now.
    """
    clear = projection(point)
    known = {_key(probe.hypothesis): probe.response for probe in earlier}
    kept = []
    for hypothesis in tried:
        response = known.get(_key(hypothesis))
        if response is not None:
            products, squares = clear.gains(response[None])
            if products[0] ** 2 < least * squares[0]:
                continue
        kept.append(hypothesis)
    return kept


def _key(hypothesis: Hypothesis) -> tuple[str, tuple[int, ...], tuple[str, ...]]:
    """Distinguishes hypotheses, also two laws of one name."""
    return hypothesis.name, hypothesis.joints, tuple(p.name for p in hypothesis.free)


def _best_trial(point: Point, clear: Projection, reference: Sequence[Floats], hypothesis: Hypothesis) -> Probe | None:
    if not hypothesis.trials:
        return None
    trials = [_from_here(point, hypothesis, trial) for trial in hypothesis.trials]
    held = {u.name: k for k, u in enumerate(point.unknowns)}
    if all(p.name in held for p in hypothesis.free):
        responses = _along_tangents(point, held, trials)
    else:
        responses = _simulated(point, reference, hypothesis, trials)
    sound = np.asarray(np.isfinite(responses).all(axis=1))
    responses[~sound] = 0.0
    products, squares = clear.gains(responses)
    best: Probe | None = None
    for k, trial in enumerate(trials):
        if not sound[k] or squares[k] < (LEAST_RESPONSE * (SMALL if hypothesis.proportional else 1.0)) ** 2:
            continue
        stretch = products[k] / squares[k]
        if not hypothesis.proportional:
            stretch = float(np.clip(stretch, LEAST_STRETCH, LARGEST_STRETCH))
        start, stretch = _stretched(point, hypothesis, trial, stretch)
        gain = float(2 * stretch * products[k] - stretch**2 * squares[k])
        if best is None or gain > best.gain:
            moved = clear.moves(stretch * responses[k])
            best = Probe(hypothesis, gain, _without_pull(hypothesis, held, start, moved), moved, responses[k])
    return best


def _without_pull(
    hypothesis: Hypothesis, held: Mapping[str, int], start: dict[str, float], moved: Floats
) -> dict[str, float]:
    """The start as a fit counts it. The trial lies beside the parameter that its prior holds, which moves back as
    `moved` (p,) says; a fit has one parameter for both."""
    found = dict(start)
    for p in hypothesis.main:
        if p.name in found and p.name in held:
            found[p.name] = float(np.clip(found[p.name] + moved[held[p.name]], p.low, p.high))
    return found


def _along_tangents(point: Point, held: Mapping[str, int], trials: Sequence[dict[str, float]]) -> Floats:
    """Responses (k, N) of a hypothesis that only lifts priors: along the very derivatives that are projected out. The
    difference between those and a simulation would look like the effect's own response."""
    return np.stack([sum((v - point.values[held[n]]) * point.tangents[held[n]] for n, v in t.items()) for t in trials])


def _simulated(
    point: Point, reference: Sequence[Floats], hypothesis: Hypothesis, trials: Sequence[dict[str, float]]
) -> Floats:
    """Responses (k, N) of trials, each simulated at its size; not finite where a simulation is not.

    They are simulated with the step of derivatives, because derivatives are projected out of them.
    """
    observation = point.observation
    model = hypothesis.model
    states = [observation.state(point.of(model)) for _ in trials]
    for (vector, _), trial in zip(states, trials, strict=True):
        for name, value in trial.items():
            vector[list(model.parameter(name).slots)] = value
    shown = observation.readings(model, states, step_of_derivatives(model))
    return observation.weighted([y - y0 for y, y0 in zip(shown, reference, strict=True)])


def _from_here(point: Point, hypothesis: Hypothesis, trial: dict[str, float]) -> dict[str, float]:
    """The trial; where the point has already fitted a parameter under its prior, the trial is as far from that
    value."""
    if not hypothesis.proportional:
        return trial
    held = {u.name: float(v) for u, v in zip(point.unknowns, point.values, strict=True)}
    moved = dict(trial)
    for p in hypothesis.main:
        if p.name in trial and p.name in held:
            size = trial[p.name] - p.value
            inside = p.low <= held[p.name] + size <= p.high
            moved[p.name] = held[p.name] + (size if inside else -size)
    return moved


def _stretched(
    point: Point, hypothesis: Hypothesis, trial: dict[str, float], stretch: float
) -> tuple[dict[str, float], float]:
    """Parameters of a trial scaled by `stretch`, kept within bounds, and the factor that is left of it."""
    start = dict(trial)
    held = {u.name: float(v) for u, v in zip(point.unknowns, point.values, strict=True)}
    for p in hypothesis.main:
        if p.name in trial:
            absent = held.get(p.name, p.value if p.effect != "motor_inductance" or p.null is None else p.null)
            size = trial[p.name] - absent
            value = float(np.clip(absent + stretch * size, p.low, p.high))
            stretch = (value - absent) / size if size else stretch
            start[p.name] = value
    return start, stretch


_NUMBERS = {
    "link_mass": ("mass",),
    "payload": ("mass",),
    "input_delay": ("delay",),
    "weakened_magnet": ("torque_constant", "back_emf_constant"),
}
"""By effect, the parts of a machine's numbers that it changes."""


def as_effect(point: Point, hypothesis: Hypothesis) -> Probe | None:
    """A start of a hypothesis that has all of the distance of a number far from its expectation, while that number is
    as expected; None where the hypothesis changes no such number.

    The gain is what the priors cost at the point.
    """
    parts = _NUMBERS.get(hypothesis.name)
    main = hypothesis.main
    if parts is None or len(main) != 1:
        return None
    own = [
        k
        for k, u in enumerate(point.unknowns)
        if u.parameter.part in parts
        and u.parameter.effect is None
        # a controller's delay is of every joint
        and (u.joints == hypothesis.joints or (hypothesis.name == "input_delay" and not u.joints))
    ]
    away = (point.values - point.expected) * np.sqrt(point.precision)
    far = [k for k in own if abs(away[k]) >= FAR_OFF]
    if not far:
        return None
    most = max(far, key=lambda k: abs(away[k]))
    distance = float(point.values[most] - point.expected[most])
    if hypothesis.name == "weakened_magnet":
        distance /= -float(point.expected[most])
    parameter = main[0]
    size = float(np.clip((parameter.null or 0.0) + distance, parameter.low, parameter.high))
    moved = np.zeros_like(point.values)
    moved[own] = (point.expected - point.values)[own]
    return Probe(
        hypothesis, float(np.sum(away[own] ** 2)), {parameter.name: size}, moved, np.zeros_like(point.weighted)
    )
