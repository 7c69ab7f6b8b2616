"""One case: the traces of a diagnosis, and what they say about a point: its errors, its refusal, where it disagrees."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from daq.contracts.trace import Trace
from model.arrays import Floats
from model.discrepancy.diagnosis import Candidate, Gap, GapNumber, SignalError, Step, Where
from model.discrepancy.grounds import Refusal
from model.discrepancy.localisation.disagreement import locate
from model.discrepancy.localisation.phases import Residuals
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.output_error.calibration import Calibration, Remembered
from model.discrepancy.output_error.holdout import HeldOut, noise_floor
from model.discrepancy.output_error.noise_model import residuals_of
from model.discrepancy.output_error.observation import Observation, Signals
from model.discrepancy.output_error.search import FEW_STEPS, Point, descend, point_at
from model.discrepancy.thresholds import FEEDBACK_SHARE_FOR_ERRORS, THRESHOLDS, Thresholds
from model.discrepancy.verdict import Errors, excess_removed, gap_numbers, gap_of, rises_too_much
from model.machine_model.model import Model
from model.machine_model.record_verdict import FAR_OFF

Watch = Callable[[tuple[Candidate, ...]], None]
"""Called with the leading candidates of a step, the best first, whenever one of them has been computed."""


@dataclass(frozen=True)
class Case:
    """What stays the same during a diagnosis by output error. It is built once and passed whole.

    Args:
        model: as it was given. given: the point of that model, with the gains that records prove, before any fit.
        traces: the fitted ones. scoring: these traces as errors are reported, with less feedback of the record than
            fits get. floor: (n,) rad, the error that noise alone leaves on them.
        held: the held-out traces, if any. floor_held: the same on those; empty without any.
        excluded: effects that need not be tried. watch: is called with the leading candidates while they are computed.
    """

    model: Model
    given: Point
    traces: tuple[Trace, ...]
    scoring: Observation
    floor: Floats
    held: HeldOut | None
    floor_held: Floats
    options: DiagnosisOptions
    thresholds: Thresholds = THRESHOLDS
    excluded: tuple[str, ...] = ()
    watch: Watch | None = None
    _scored: Remembered[Signals] = field(default_factory=Remembered, init=False, repr=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Identities of the fitted traces."""
        return tuple(t.record.trace_id for t in self.traces)

    @property
    def held_traces(self) -> tuple[Trace, ...]:
        """The held-out traces."""
        return () if self.held is None else self.held.traces

    def with_floors_of(self, point: Point) -> Case:
        """The same with floors that are no less than a point's: with play, noise decides where a joint comes to rest,
        so an added effect may raise the floor."""
        floor = np.maximum(self.floor, noise_floor(self.scoring, point))
        held = self.floor_held if self.held is None else np.maximum(self.floor_held, self.held.floor(point))
        return replace(self, floor=floor, floor_held=held)

    def fitted_errors(self, before: Point, after: Point) -> tuple[SignalError, ...]:
        """Errors of every joint on the fitted traces."""
        return self.scoring.errors(self.scored(before), self.scored(after), self.floor)

    def scored(self, point: Calibration) -> Signals:
        """Residuals of the fitted traces as errors are reported."""
        return self._scored.of(point, lambda: self.scoring.residuals(point))

    def credited_against(self, before: Point, after: Point) -> Calibration:
        """What held-out errors of a point, `after`, are compared with.

        That is the point before, unless it has explained records by an unlikely number of the machine, which the effect
        added since has made likely again: then that number was the effect. So all numbers are as they were given. The
        effects that the point before has already stay as they are: what they explain is no merit of the new one.
        """
        if not before.strain >= FAR_OFF > after.strain:
            return before
        given = {u.name for u in self.given.unknowns if u.deviation is not None}
        as_given = np.array([u.name in given for u in before.unknowns])
        return before.at(np.where(as_given & (before.precision > 0.0), before.expected, before.values))

    def held_residuals(self, before: Calibration, after: Calibration) -> tuple[Signals, Signals]:
        """Residuals of the held-out traces; empty where there are none."""
        return ((), ()) if self.held is None else (self.held.residuals(before), self.held.residuals(after))

    def held_errors(self, before: Signals, after: Signals) -> tuple[SignalError, ...]:
        """Errors of every joint on the held-out traces; empty where there are none."""
        return () if self.held is None else self.held.observation.errors(before, after, self.floor_held)

    def refused(
        self, fitted: Point, evidence: float, current: Point, held: tuple[Signals, Signals], own: Sequence[SignalError]
    ) -> Refusal | None:
        """Why an effect is refused; None unless the held-out traces speak against it.

        Args:
            fitted: the point with it. evidence: of the effect. current: the point without it. held: residuals of these
                traces without and with it. own: their errors on its joints; on others, something else may be missing,
                for which the tolerance parameters bend.
        """
        if self.held is None:
            return None
        removed, lines = excess_removed(own), self.thresholds
        if removed is not None and removed < -lines.grown:
            return Refusal(kind="error-grows", numbers={"share": -removed})
        rise, deviation = self.held.rise(*held)
        share = self.held.observation.samples / self.scoring.samples
        fall = self._square(current) - self._square(fitted)
        if rises_too_much(rise, deviation, fall * share, evidence, lines):
            if not np.isfinite(rise):
                return Refusal(kind="diverges")
            return Refusal(kind="error-rises", numbers={"rise": rise, "deviation": deviation})
        return None

    def where(self, point: Point) -> Where:
        """Where the point disagrees with the fitted traces."""
        return locate(self.residuals_of(point))

    def residuals_of(self, point: Point) -> Residuals:
        """Residuals of the fitted traces as errors are reported."""
        return residuals_of(point.fitted_model, self.scoring, self.scored(point))

    def held_residuals_of(self, point: Point) -> Residuals | None:
        """The same of the held-out traces; None where there are none."""
        if self.held is None:
            return None
        return residuals_of(point.fitted_model, self.held.observation, self.held.residuals(point))

    def _square(self, point: Point) -> float:
        """Weighted sum of squares of a point, on the fitted traces as errors are reported."""
        weighted = self.scoring.weighted(self.scored(point))
        return float(weighted @ weighted)


def build_case(
    model: Model,
    given: Point,
    fitted: Point,
    traces: Sequence[Trace],
    held: HeldOut | None = None,
    options: DiagnosisOptions | None = None,
    excluded: tuple[str, ...] = (),
    watch: Watch | None = None,
) -> Case:
    """The case of traces that a point was fitted to, with the floors that this point gives them."""
    scoring = fitted.observation.with_feedback_share(FEEDBACK_SHARE_FOR_ERRORS)
    if held is not None:  # they are weighed with the noise that the fitted ones show
        held = replace(held, observation=replace(held.observation, noise=fitted.observation.noise))
    return Case(
        model=model,
        given=given,
        traces=tuple(traces),
        scoring=scoring,
        floor=noise_floor(scoring, fitted),
        held=held,
        floor_held=np.zeros(0) if held is None else held.floor(fitted),
        options=options or DiagnosisOptions(),
        excluded=excluded,
        watch=watch,
    )


def errors_of_fit(point: Point) -> tuple[SignalError, ...]:
    """Errors of every joint on the fitted traces as the fit itself sees them, with its own feedback share."""
    floor = noise_floor(point.observation, point)
    return point.observation.errors(point.residuals, point.residuals, floor)


def closed_loop_gap(case: Case, first: Point, taken: Sequence[tuple[Step, Point]], end: Point) -> Gap:
    """The gap of a diagnosis by output error.

    The search itself lets the simulation follow a share of the record, so that a simulation with a wrong effect stays
    near enough to be compared; there the gap is smaller than what anybody sees on the arm.

    Args:
        first: the point before any effect was added. taken: the steps in the resulting model, each with the point after
            it. end: the point of the resulting model.
    """
    alone = _alone(case.scoring)
    held = None if case.held is None else replace(case.held, observation=_alone(case.held.observation))

    def errors(point: Point) -> Errors:
        theirs = () if held is None else _errors(held.observation, held.residuals(point))
        return {"fitted": _errors(alone, alone.residuals(point)), "held_out": theirs}

    joints = zip(case.scoring.machine.modelled_joints, case.scoring.units, map(float, case.scoring.sizes), strict=True)
    within = [(step, _within_file(point)) for step, point in taken]
    return gap_of("closed-loop", tuple(joints), errors, case.given, first, within, end, _numbers(first, end))


def _numbers(first: Point, end: Point) -> tuple[GapNumber, ...]:
    return gap_numbers(end.model.machine, first.by_name, end.by_name)


def _within_file(point: Point) -> Point:
    """The point fitted again with its numbers within one deviation of what the machine file states."""
    unknowns = tuple(u.within_stated for u in point.unknowns)
    values = np.clip(point.values, [u.low for u in unknowns], [u.high for u in unknowns])
    begun = point_at(point.observation, Calibration(point.model, unknowns, values), point.tangents)
    return descend(begun, FEW_STEPS) if begun.is_finite else begun


def _alone(observation: Observation) -> Observation:
    return observation.with_drive_as_input(False).with_feedback_share(0.0)


def _errors(observation: Observation, residuals: Signals) -> tuple[float | None, ...]:
    """Root mean square of every joint; None where it is not finite."""
    return tuple(rms if np.isfinite(rms) else None for rms in observation.rms(residuals))
