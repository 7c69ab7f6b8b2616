"""Held-out traces: what a fit leaves of them, with initial postures and phases of their own, and how far that rises.

The floor is the error that noise and rounding alone would leave, if a model were the truth. It is more than the noise
of one reading: the part of that noise which the simulated controller is not given goes round the real loop and moves
the arm a little near standstill.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.discrepancy.output_error.calibration import Calibration, Remembered
from model.discrepancy.output_error.observation import Observation, Signals, observe, side_by_side
from model.discrepancy.output_error.search import STEPS, Point, descend, point_at
from model.discrepancy.thresholds import FEEDBACK_SHARE, FEEDBACK_SHARE_FOR_ERRORS
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model
from model.machine_model.parameter import Kind

REPLICAS, SEED = 6, 1991


def noise_floor(observation: Observation, truth: Calibration, refitted: Sequence[int] = ()) -> Floats:
    """Root mean square of each joint's residual, (n,) rad, over simulated records of an arm that is this model.

    Where its simulations in closed loop do not stay finite: the noise of a reading.

    Args:
        refitted: indices of the unknowns that are estimated from every record anew. Noise moves them by so little that
            derivatives say what that takes off the residual.
    """
    stated = replace(observation, noise=None)
    try:
        tangents = stated.tangents(truth, refitted) if refitted else np.zeros((0, observation.samples))
    except SpecError:
        return observation.deviations.copy()
    information = tangents @ tangents.T + np.diag(truth.precision[list(refitted)])
    rng = np.random.default_rng(SEED)
    drawn = [[rng.normal(size=p.noise.shape) for p in observation.prepared] for _ in range(REPLICAS)]

    def squares(noise: Sequence[Floats]) -> Floats:
        replica = _replica(observation, truth, noise)
        left = stated.in_deviations(replica.residuals(truth))
        left = left - np.linalg.lstsq(information, tangents @ left, rcond=None)[0] @ tangents
        return np.array([np.mean(np.concatenate(runs) ** 2) for runs in stated.by_joint(left)])

    found = np.mean(side_by_side(squares, drawn), axis=0)
    return observation.deviations * (np.sqrt(found) if np.isfinite(found).all() else 1.0)


def _replica(observation: Observation, truth: Calibration, noise: Sequence[Floats]) -> Observation:
    """The same experiments on an arm that is this model, with that white noise (k, n) of unit size in each record made
    as large as stated, or as the records show it."""
    scale = observation.deviations / observation.unit
    if observation.noise is not None:
        whiteners = observation.noise.whiteners
        noise = [
            np.stack([w.coloured(own) for w, own in zip(whiteners, each.T, strict=True)], axis=1) for each in noise
        ]
    return observation.imagined(truth, [scale * each for each in noise])


BLOCK = 0.2
"""Time over which errors may be correlated, s."""
NEARER = (FEEDBACK_SHARE, 0.95)
"""Feedback shares that are tried in turn where the simulation of a held-out trace does not stay finite."""


@dataclass(frozen=True)
class HeldOut:
    """Traces that no parameter is fitted to. starts: the unknowns of their initial postures, each of one trace."""

    traces: tuple[Trace, ...]
    observation: Observation
    starts: tuple[Unknown, ...]
    _left: Remembered[Signals] = field(default_factory=Remembered, init=False, repr=False)

    def floor(self, point: Calibration) -> Floats:
        """(n,) rad, as `noise_floor`, with the initial postures estimated here as well."""
        here = _values_here(point, self.starts)
        count = len(here.unknowns)
        return noise_floor(self.observation, here, range(count - len(self.starts), count))

    def residuals(self, point: Calibration) -> Signals:
        """Measured − simulated (m, n) rad of every held-out trace, with the point's values.

        Each trace itself gives what no other trace can: its initial posture, within a count or so, because friction
        holds the arm there; and its phase of a periodic disturbance, whose amplitude and frequency are kept.
        """
        return self._left.of(point, lambda: self._residuals(point))

    def _residuals(self, point: Calibration) -> Signals:
        return tuple(
            _residuals(
                replace(self.observation, records=(record,), prepared=(prepared,)),
                point,
                tuple(replace(u, trace=0) for u in self.starts if u.trace == t),
            )
            for t, (record, prepared) in enumerate(
                zip(self.observation.records, self.observation.prepared, strict=True)
            )
        )

    def rise(self, before: Signals, after: Signals) -> tuple[float, float]:
        """Rise of the weighted sum of squares of residuals, and the standard deviation that noise alone gives it.

        The deviation is taken from the scatter of blocks of 0.2 s or so, which are nearly independent. The rise is
        infinite where the simulation does not stay finite.
        """
        old, new = (self.observation.weighted(residuals) for residuals in (before, after))
        if not np.isfinite(new).all():
            return float("inf"), 0.0
        risen = new**2 - old**2
        period = self.observation.records[0].inputs.period
        width = max(1, round(BLOCK / period)) * len(self.observation.deviations)
        blocks = np.add.reduceat(risen, np.arange(0, len(risen), width))
        return float(risen.sum()), float(np.sqrt(len(blocks)) * blocks.std())


def hold_out(model: Model, traces: Sequence[Trace]) -> HeldOut | None:
    """The held-out traces, prepared for simulation; None if there are none. Raises TraceError and SpecError as for the
    fitted ones."""
    if not traces:
        return None
    observation, given = observe(model, traces, FEEDBACK_SHARE_FOR_ERRORS)
    return HeldOut(tuple(traces), observation, tuple(u for u in given.unknowns if u.kind is Kind.INITIAL_POSITION))


def _residuals(observation: Observation, point: Calibration, starts: tuple[Unknown, ...]) -> Floats:
    """Measured − simulated (m, n) rad of the one record of an observation."""
    phases = _phases(point)
    if phases:
        point = _with_phases(point, phases, _fitted_here(observation, point, (*starts, *phases)))
    return _fitted_here(observation, point, starts).residuals[0]


def _fitted_here(observation: Observation, point: Calibration, own: tuple[Unknown, ...]) -> Point:
    """The point with the record's own unknowns at their best. They are not searched for where there are none, or where
    the simulation does not stay finite.

    A simulation that runs away follows the record more, as in the fits.
    """
    here = _values_here(point, own)
    count = len(here.unknowns)
    for share in (None, *NEARER):
        followed = observation if share is None else observation.with_feedback_share(share)
        begun = point_at(followed, here, np.zeros((count, observation.samples)))
        if begun.is_finite:
            break
    if not own or not begun.is_finite:
        return begun
    try:
        return descend(begun, STEPS, range(count - len(own), count))
    except SpecError:
        return begun  # on the verge of instability, as where a delay is missing: no derivative exists


def _values_here(point: Calibration, own: tuple[Unknown, ...]) -> Calibration:
    """The same for held-out traces: with their own unknowns in place of the fitted traces' initial postures."""
    names = {u.name for u in own}
    kept = [k for k, u in enumerate(point.unknowns) if u.kind is not Kind.INITIAL_POSITION and u.name not in names]
    held = [replace(point.unknowns[k], deviation=None) for k in kept]  # no prior and no derivative: they stay
    values = np.concatenate([point.values[kept], [u.start for u in own]])
    return Calibration(point.model, (*held, *own), values)


def _phases(point: Calibration) -> tuple[Unknown, ...]:
    """Sine and cosine of every periodic disturbance of a point, in pairs, free but for a prior of their amplitude."""
    fitted, found = point.by_name, []
    for pair in point.model.disturbances:
        values = [float(fitted.get(p.name, p.value)) for p in pair]
        size = math.hypot(*values)
        if size > 0.0:
            found += [Unknown(p, v, deviation=size) for p, v in zip(pair, values, strict=True)]
    return tuple(found)


def _with_phases(point: Calibration, phases: Sequence[Unknown], fitted: Calibration) -> Calibration:
    """The same with its disturbances at the fitted phases.

    The amplitude is kept fixed, so that a spurious disturbance cannot be fitted away on held-out data.
    """
    turned: list[Unknown] = []
    for sine, cosine in zip(phases[::2], phases[1::2], strict=True):
        size = math.hypot(sine.start, cosine.start)
        angle = math.atan2(fitted.value(cosine.name), fitted.value(sine.name))
        turned += [
            replace(u, start=size * part, deviation=None)
            for u, part in ((sine, math.cos(angle)), (cosine, math.sin(angle)))
        ]
    return _values_here(point, tuple(turned))
