"""How the gap shrinks: the error of the closed loop with the model as given, fitted, and with each effect added."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from model.discrepancy.diagnosis import Gap, GapNumber, GapStage, GapWithout, Step
from model.discrepancy.explanation.fitted_numbers import gap_numbers
from model.discrepancy.output_error.calibration import Calibration
from model.discrepancy.output_error.case import Case
from model.discrepancy.output_error.observation import Observation, Signals
from model.discrepancy.output_error.search import Point, descend, point_at

MOST_STEPS = 6
"""Steps of the fit within what a file states: it begins near its end."""


def closed_loop_gap(case: Case, first: Point, taken: Sequence[tuple[Step, Point]], end: Point) -> Gap:
    """The gap of the closed loop, simulated from set points and initial postures and from nothing else of the record.

    The search itself lets the simulation follow a share of the record, so that a simulation with a wrong effect stays
    near enough to be compared; there the gap is smaller than what anybody sees on the arm.

    Args:
        first: the point before any effect was added. taken: the steps in the resulting model, each with the point after
            it, its numbers within what the file states. end: the point of the resulting model.
    """
    alone = _alone(case.scoring)
    held = None if case.held is None else replace(case.held, observation=_alone(case.held.observation))

    def errors(point: Point) -> dict[str, tuple[float | None, ...]]:
        theirs = () if held is None else _errors(held.observation, held.residuals(point))
        return {"fitted": _errors(alone, alone.residuals(point)), "held_out": theirs}

    effects = [GapStage(kind="effect", effect=s.effect, joints=s.joints, **errors(p)) for s, p in taken]
    joints, last = case.scoring.machine.modelled_joints, GapStage(kind="refitted" if taken else "fitted", **errors(end))
    return Gap(
        measure="closed-loop",
        joints=joints,
        units=tuple(case.scoring.units),
        noise=tuple(float(d) for d in case.scoring.sizes),
        stages=(GapStage(kind="given", **errors(case.given)), *effects, last),
        without=GapWithout(**errors(first), numbers=_numbers(first, end)) if taken else None,
    )


def within_file(point: Point) -> Point:
    """The point fitted again with its numbers within one deviation of what the machine file states."""
    unknowns = tuple(u.within_stated for u in point.unknowns)
    values = np.clip(point.values, [u.low for u in unknowns], [u.high for u in unknowns])
    begun = point_at(point.observation, Calibration(point.model, unknowns, values), point.tangents)
    return descend(begun, MOST_STEPS) if begun.is_finite else begun


def _numbers(first: Point, end: Point) -> tuple[GapNumber, ...]:
    return gap_numbers(end.model.machine, first.by_name, end.by_name)


def _alone(observation: Observation) -> Observation:
    return observation.with_drive_as_input(False).with_feedback_share(0.0)


def _errors(observation: Observation, residuals: Signals) -> tuple[float | None, ...]:
    """Root mean square of every joint; None where it is not finite."""
    return tuple(rms if np.isfinite(rms) else None for rms in observation.rms(residuals))
