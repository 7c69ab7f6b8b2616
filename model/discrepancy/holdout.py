"""What a step brings on traces it was not fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from daq.contracts.trace import Trace
from model.discrepancy.answer import SignalError
from model.discrepancy.noise_floor import noise_floor
from model.discrepancy.observation import Observation, Signals, observed
from model.discrepancy.search import Point, point_at, searched
from model.fitting.simulated import INITIAL
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model

Floats = NDArray[np.float64]

BLOCK = 10
"""Samples whose errors may be alike."""
START_STEPS = 8
"""Of the search for where a held-out trace begins: with play in a gear, that is not a smooth problem."""


@dataclass(frozen=True)
class HeldOut:
    """Traces that no parameter is fitted to; `starts`: unknowns that are the postures they begin at."""

    observation: Observation
    starts: tuple[Unknown, ...]

    def floor(self, point: Point) -> Floats:
        """(n,) rad, as `noise_floor`, where each arm starts being estimated here as well."""
        unknowns, values = self._here(point)
        here = replace(point, unknowns=unknowns, values=values)
        return noise_floor(self.observation, here, lambda made: replace(self, observation=made).residuals(point))

    def residuals(self, point: Point) -> Signals:
        """Measured − simulated (m, n) rad of every held-out trace, with the point's values.

        Where each arm starts, within a count or so, is estimated from the trace itself: friction holds the arm there,
        and nothing that was fitted elsewhere can know it.
        """
        unknowns, values = self._here(point)
        observation = self.observation
        none = np.zeros((len(unknowns), observation.samples))
        begun = point_at(observation, point.model, unknowns, values, observation.quiet, none)
        if not np.isfinite(begun.weighted).all():
            return begun.residuals
        return searched(
            observation, begun, START_STEPS, range(len(unknowns) - len(self.starts), len(unknowns))
        ).residuals

    def _here(self, point: Point) -> tuple[tuple[Unknown, ...], Floats]:
        """A point's unknowns and values for the held-out traces: where these begin, in place of the fitted ones."""
        kept = [k for k, u in enumerate(point.unknowns) if not u.name.startswith(INITIAL + ".")]
        held = [replace(point.unknowns[k], deviation=None) for k in kept]  # no prior and no derivative: they stay
        return (*held, *self.starts), np.concatenate([point.values[kept], [u.start for u in self.starts]])

    def rise(self, before: Signals, after: Signals) -> tuple[float, float]:
        """How much the weighted sum of squares of residuals rises, and the standard deviation that noise
        alone gives that number: from the scatter of its blocks of 0.2 s or so, which are nearly independent. Infinite
        where the simulation does not stay finite."""
        old, new = (self.observation.weighted(residuals) for residuals in (before, after))
        if not np.isfinite(new).all():
            return float("inf"), 0.0
        risen = new**2 - old**2
        width = BLOCK * len(self.observation.deviations)
        blocks = np.add.reduceat(risen, np.arange(0, len(risen), width))
        return float(risen.sum()), float(np.sqrt(len(blocks)) * blocks.std())


def held_out(model: Model, traces: Sequence[Trace]) -> HeldOut | None:
    """The held-out traces, ready; None without any. Raises TraceError and SpecError as for the fitted ones."""
    if not traces:
        return None
    observation, _, unknowns = observed(model, traces)
    return HeldOut(observation, tuple(u for u in unknowns if u.name.startswith(INITIAL + ".")))


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
