"""How the gap shrinks: the error of the closed loop with the model as given, fitted, and with each effect added."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from model.discrepancy.diagnosis import Gap, GapStage, Step
from model.discrepancy.output_error.case import Case
from model.discrepancy.output_error.observation import Observation, Signals
from model.discrepancy.output_error.search import Point


def closed_loop_gap(case: Case, first: Point, taken: Sequence[tuple[Step, Point]]) -> Gap:
    """The gap of the closed loop, simulated from set points and initial postures and from nothing else of the record.

    The search itself lets the simulation follow a share of the record, so that a simulation with a wrong effect stays
    near enough to be compared; there the gap is smaller than what anybody sees on the arm.

    Args:
        first: the point before any effect was added. taken: the steps in the resulting model, each with the point after
            it.
    """
    alone = _alone(case.scoring)
    held = None if case.held is None else replace(case.held, observation=_alone(case.held.observation))

    def stage(begun: GapStage, point: Point) -> GapStage:
        own = _errors(alone, alone.residuals(point))
        theirs = () if held is None else _errors(held.observation, held.residuals(point))
        return begun.model_copy(update={"fitted": own, "held_out": theirs})

    joints = case.scoring.machine.modelled_joints
    return Gap(
        measure="closed-loop",
        joints=joints,
        units=tuple(case.scoring.units),
        noise=tuple(float(d) for d in case.scoring.sizes),
        stages=(
            stage(GapStage(kind="given", fitted=()), case.given),
            stage(GapStage(kind="fitted", fitted=()), first),
            *(stage(GapStage(kind="effect", effect=s.effect, joints=s.joints, fitted=()), p) for s, p in taken),
        ),
    )


def _alone(observation: Observation) -> Observation:
    return observation.with_drive_as_input(False).with_feedback_share(0.0)


def _errors(observation: Observation, residuals: Signals) -> tuple[float | None, ...]:
    """Root mean square of every joint; None where it is not finite."""
    return tuple(rms if np.isfinite(rms) else None for rms in observation.rms(residuals))
