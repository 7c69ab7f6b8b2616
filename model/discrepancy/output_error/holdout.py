"""What a step brings on traces it was not fitted to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import SignalError
from model.discrepancy.output_error.feedback_share import FOLLOWING_FOR_ERRORS
from model.discrepancy.output_error.noise_floor import noise_floor
from model.discrepancy.output_error.observation import Observation, Signals, observed
from model.discrepancy.output_error.search import Point, point_at, searched
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model
from model.machine_model.parameter import Kind

Floats = NDArray[np.float64]

DISTURBANCE = "periodic_disturbance"
BLOCK = 0.2
"""s over which errors may be alike."""
START_STEPS = 8
"""Of the search for where a held-out trace begins: with play in a gear, that is not a smooth problem."""


@dataclass(frozen=True)
class HeldOut:
    """Traces that no parameter is fitted to; `starts`: unknowns that are the postures they begin at, each of one
    trace."""

    observation: Observation
    starts: tuple[Unknown, ...]

    def floor(self, point: Point) -> Floats:
        """(n,) rad, as `noise_floor`, where each arm starts being estimated here as well."""
        unknowns, values = _here(point, self.starts)
        here = replace(point, unknowns=unknowns, values=values)
        return noise_floor(self.observation, here, lambda made: replace(self, observation=made).residuals(point))

    def residuals(self, point: Point) -> Signals:
        """Measured − simulated (m, n) rad of every held-out trace, with the point's values.

        What nothing that was fitted elsewhere can know is estimated from each trace itself: where its arm starts,
        within a count or so, for friction holds it there; and at which phase it meets a periodic disturbance, whose
        size and frequency stay.
        """
        return tuple(
            _residuals(
                _only(self.observation, t), point, tuple(replace(u, trace=0) for u in self.starts if u.trace == t)
            )
            for t in range(len(self.observation.records))
        )

    def rise(self, before: Signals, after: Signals) -> tuple[float, float]:
        """How much the weighted sum of squares of residuals rises, and the standard deviation that noise
        alone gives that number: from the scatter of its blocks of 0.2 s or so, which are nearly independent. Infinite
        where the simulation does not stay finite."""
        old, new = (self.observation.weighted(residuals) for residuals in (before, after))
        if not np.isfinite(new).all():
            return float("inf"), 0.0
        risen = new**2 - old**2
        period = self.observation.records[0].inputs.period
        width = max(1, round(BLOCK / period)) * len(self.observation.deviations)
        blocks = np.add.reduceat(risen, np.arange(0, len(risen), width))
        return float(risen.sum()), float(np.sqrt(len(blocks)) * blocks.std())


def _only(observation: Observation, number: int) -> Observation:
    """One record of several."""
    own = slice(number, number + 1)
    return replace(observation, records=observation.records[own], prepared=observation.prepared[own])


def _residuals(observation: Observation, point: Point, starts: tuple[Unknown, ...]) -> Floats:
    """Measured − simulated (m, n) rad of the one record of an observation."""
    phases = _phases(point)
    if phases:
        point = _turned(point, phases, _searched(observation, point, (*starts, *phases)))
    return _searched(observation, point, starts).residuals[0]


def _searched(observation: Observation, point: Point, own: tuple[Unknown, ...]) -> Point:
    """The point with unknowns of the record's own at their best; not searched for where it has none, or where no
    simulation stays finite."""
    unknowns, values = _here(point, own)
    none = np.zeros((len(unknowns), observation.samples))
    begun = point_at(observation, point.model, unknowns, values, none)
    if not own or not np.isfinite(begun.weighted).all():
        return begun
    return searched(observation, begun, START_STEPS, range(len(unknowns) - len(own), len(unknowns)))


def _here(point: Point, own: tuple[Unknown, ...]) -> tuple[tuple[Unknown, ...], Floats]:
    """A point's unknowns and values for held-out traces: unknowns of their own in place of where the fitted ones
    begin."""
    names = {u.name for u in own}
    kept = [k for k, u in enumerate(point.unknowns) if u.kind is not Kind.INITIAL_POSITION and u.name not in names]
    held = [replace(point.unknowns[k], deviation=None) for k in kept]  # no prior and no derivative: they stay
    return (*held, *own), np.concatenate([point.values[kept], [u.start for u in own]])


def _phases(point: Point) -> tuple[Unknown, ...]:
    """Sine and cosine of every periodic disturbance of a point, in pairs, free but for a prior of their size."""
    fitted = dict(zip((u.name for u in point.unknowns), point.values, strict=True))
    found: list[Unknown] = []
    for sine in (p for p in point.model.parameters if p.effect == DISTURBANCE and p.name.endswith(".sine")):
        cosine = point.model.by_name.get(sine.name.removesuffix("sine") + "cosine")
        if cosine is None:  # tied under another name: what is said of it there holds everywhere
            continue
        values = [float(fitted.get(p.name, p.value)) for p in (sine, cosine)]
        size = math.hypot(*values)
        if size > 0.0:
            found += [Unknown(p, v, deviation=size) for p, v in zip((sine, cosine), values, strict=True)]
    return tuple(found)


def _turned(point: Point, phases: Sequence[Unknown], met: Point) -> Point:
    """The point with its disturbances at the phases that were met. Their size stays: one that is not there may not
    vanish from the traces that are to show it."""
    turned: list[Unknown] = []
    for sine, cosine in zip(phases[::2], phases[1::2], strict=True):
        size = math.hypot(sine.start, cosine.start)
        angle = math.atan2(met.value(cosine.name), met.value(sine.name))
        turned += [
            replace(u, start=size * part, deviation=None)
            for u, part in ((sine, math.cos(angle)), (cosine, math.sin(angle)))
        ]
    unknowns, values = _here(point, tuple(turned))
    return replace(point, unknowns=unknowns, values=values)


def held_out(model: Model, traces: Sequence[Trace]) -> HeldOut | None:
    """The held-out traces, ready; None without any. Raises TraceError and SpecError as for the fitted ones."""
    if not traces:
        return None
    observation, _, unknowns = observed(model, traces, FOLLOWING_FOR_ERRORS)
    return HeldOut(observation, tuple(u for u in unknowns if u.kind is Kind.INITIAL_POSITION))


def errors(
    observation: Observation, model: Model, before: Signals, after: Signals, floor: Floats
) -> tuple[SignalError, ...]:
    """Root mean square of every joint before and after, beside the floor (n,) rad."""
    found = []
    for column, joint in enumerate(model.machine.modelled_joints):
        sizes = []
        for signals in (before, after):
            parts = [s[run, column] for s, r in zip(signals, observation.records, strict=True) for run in r.runs]
            sizes.append(float(np.sqrt(np.mean(np.concatenate(parts) ** 2))))
        unit = "rad" if model.machine.joint(joint).kind == "revolute" else "m"
        least = float(floor[column])
        found.append(SignalError(joint=joint, unit=unit, before=sizes[0], after=sizes[1], floor=least))
    return tuple(found)
