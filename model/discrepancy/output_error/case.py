"""What stays the same during a diagnosis, and what is asked of it at every point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import RemainingShape, SignalError, Where
from model.discrepancy.grounds import Refusal
from model.discrepancy.localisation.disagreement import located
from model.discrepancy.localisation.unexplained_torque import shapes
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.output_error.feedback_share import FOLLOWING_FOR_ERRORS
from model.discrepancy.output_error.holdout import HeldOut, errors
from model.discrepancy.output_error.noise_floor import noise_floor
from model.discrepancy.output_error.observation import Observation, Signals
from model.discrepancy.output_error.refitting import Refitted
from model.discrepancy.output_error.search import Point
from model.discrepancy.thresholds import Thresholds
from model.discrepancy.verdict import excess_removed
from model.machine_model.model import Model

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """The traces of a diagnosis, and what holds for all of its turns.

    floor, floor_held: (n,) rad, what noise alone leaves on the fitted and on the held-out traces; the second is empty
    without any. excluded: effects that need not be tried. told: the fitted traces as errors are told, which is how the
    held-out ones are.
    """

    observation: Observation
    told: Observation
    floor: Floats
    held: HeldOut | None
    floor_held: Floats
    traces: tuple[Trace, ...]
    options: DiagnosisOptions
    thresholds: Thresholds
    excluded: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Identities of the fitted traces."""
        return tuple(t.record.trace_id for t in self.traces)

    def with_floors_of(self, point: Point) -> Case:
        """The same with floors that are no less than a point's: with play, noise decides where a joint comes to rest,
        so what has been added may raise the floor."""
        floor = np.maximum(self.floor, noise_floor(self.told, point))
        held = self.floor_held if self.held is None else np.maximum(self.floor_held, self.held.floor(point))
        return replace(self, floor=floor, floor_held=held)

    def fitted_errors(self, before: Point, after: Point) -> tuple[SignalError, ...]:
        """Of every joint, on the traces fitted to."""
        return errors(self.told, after.model, self._told(before), self._told(after), self.floor)

    def errors_of_fits(self, point: Point) -> tuple[SignalError, ...]:
        """Of every joint, on the traces fitted to, following the record as closely as the fits do."""
        floor = noise_floor(self.observation, point)
        return errors(self.observation, point.model, point.residuals, point.residuals, floor)

    def held_residuals(self, before: Point, after: Point) -> tuple[Signals, Signals]:
        """Residuals of the held-out traces; empty where there are no such traces."""
        return ((), ()) if self.held is None else (self.held.residuals(before), self.held.residuals(after))

    def held_errors(self, model: Model, before: Signals, after: Signals) -> tuple[SignalError, ...]:
        """Of every joint, on the held-out traces; empty where there are none."""
        return () if self.held is None else errors(self.held.observation, model, before, after, self.floor_held)

    def refused(
        self, found: Refitted, current: Point, held: tuple[Signals, Signals], own: Sequence[SignalError]
    ) -> Refusal | None:  # fmt: skip
        """Why an effect is not taken, if held-out traces speak against it.

        Args:
            current: the point without it. held: residuals of these traces without and with it. own: their errors on its
                joints; on others, something else may be missing, which the tolerance parameters bend to make up for.
        """
        if self.held is None:
            return None
        removed, lines = excess_removed(own), self.thresholds
        if removed is not None and removed < -lines.grown:
            return Refusal(kind="error-grows", numbers={"share": -removed})
        rise, deviation = self.held.rise(*held)
        share = self.held.observation.samples / self.observation.samples
        fall = self._square(current) - self._square(found.judged.point)
        by_chance = max(lines.worse * deviation, lines.lost * fall * share, lines.significant)
        if rise > min(by_chance, max(deviation, found.evidence - lines.significant)):
            if not np.isfinite(rise):
                return Refusal(kind="diverges")
            return Refusal(kind="error-rises", numbers={"rise": rise, "deviation": deviation})
        return None

    def where(self, point: Point, *, moving: bool = True) -> Where:
        """Where the point disagrees with the fitted traces. moving: also which parameters would have to move, which
        takes most of the time."""
        driven = tuple(t for t in self.traces if moving and t.drive is not None)
        return located(with_point(point), self.told.records, self._told(point), self.told.deviations, traces=driven)

    def remaining(self, point: Point) -> tuple[RemainingShape, ...]:
        """What the point leaves of the fitted traces, as torques."""
        return shapes(
            with_point(point), self.told.records, self._told(point), self.told.deviations,
            following=FOLLOWING_FOR_ERRORS,
        )  # fmt: skip

    def _square(self, point: Point) -> float:
        """Weighted sum of squares of a point, on the fitted traces as errors are told."""
        weighted = self.told.weighted(self._told(point))
        return float(weighted @ weighted)

    def _told(self, point: Point) -> Signals:
        return self.told.residuals(point.model, point.unknowns, point.values)


def with_point(point: Point) -> Model:
    """A point's model with its values, where they are parameters of it."""
    model = point.model
    named = {u.name: float(v) for u, v in zip(point.unknowns, point.values, strict=True) if u.name in model.by_name}
    return model.with_values(named)
