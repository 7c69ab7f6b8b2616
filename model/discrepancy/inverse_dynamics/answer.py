"""The answer of a diagnosis by inverse dynamics: its last fit, steps, errors and notes as one record."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from model.discrepancy.diagnosis import UNWRITTEN, Candidate, Diagnosis, SignalError, Step, Suspicion, Verdict
from model.discrepancy.explanation.notes import on_drives_at_limit, on_named_numbers, on_stated_numbers
from model.discrepancy.grounds import Note
from model.discrepancy.inverse_dynamics import holdout
from model.discrepancy.inverse_dynamics.estimates import found_values, signal_errors, standard_deviations
from model.discrepancy.inverse_dynamics.fitting import BalanceFit
from model.discrepancy.inverse_dynamics.gap import torque_gap
from model.discrepancy.inverse_dynamics.judged_controller import JudgedController
from model.discrepancy.inverse_dynamics.left_over import is_left_beside, joints_left_over
from model.discrepancy.inverse_dynamics.localisation import locate, remaining_shapes
from model.discrepancy.inverse_dynamics.standing import Standing
from model.discrepancy.verdict import verdict
from model.fitting.unknowns import Unknown
from model.inverse_dynamics.drive_limits import find_drives_at_limit
from model.inverse_dynamics.drive_timing import expected_timing
from model.inverse_dynamics.recorded_motion import RecordedMotion
from model.machine_model.model import Lineage, Model
from model.machine_model.parameter import Parameter
from model.machine_model.posterior import summarise_posterior


@dataclass(frozen=True)
class Outcome:
    """What a diagnosis has come to.

    first: the fit of the model as given. added: parameters of the effects that are named. stated: numbers that steps
    have named although the file states them, as it states them. tried: ranking of the step that added nothing.
    suspicion: the effect that is suspected. notes: what was noted on the way.
    """

    standing: Standing
    controller: JudgedController
    first: BalanceFit
    added: Mapping[str, Parameter]
    stated: Mapping[str, Parameter]
    tried: tuple[Candidate, ...]
    suspicion: Suspicion | None
    notes: tuple[Note, ...]

    @property
    def unknowns(self) -> list[Unknown]:
        """The unknowns of the last fit that are of the model."""
        return [u for u in self.standing.now.unknowns if not u.nuisance]


def answer_of(outcome: Outcome, traces: Sequence[str], held_out: Sequence[str], cutoff: float) -> Diagnosis:
    """The whole answer, except for its sentences and the times that it took.

    Args:
        traces, held_out: identities of the traces that were fitted to, and that were not. cutoff: of the torques, Hz.
    """
    standing, controller, case = outcome.standing, outcome.controller, outcome.standing.case
    shapes = remaining_shapes(standing.now, case)
    proved, steps = controller.steps(standing.given, case.noise), _as_last_fitted(standing)
    named = any(step.adopted for step in steps)
    missing = bool(shapes) or bool(joints_left_over(standing))
    fit_errors, held_errors = (_errors(standing, records) for records in (case.records, case.held_out))
    shares = _torque_left(standing, outcome.first)
    found = verdict(
        (*proved, *steps),
        unexplained=missing and not named,
        suspected=outcome.suspicion is not None,
        partly=shares["after"] > 1.0 or is_left_beside(standing),
    )
    return Diagnosis(
        verdict=found,
        suspicion=None if named else outcome.suspicion,
        summary=UNWRITTEN,
        method="inverse-dynamics",
        steps=(*proved, *steps),
        rmse_fit=fit_errors,
        rmse_holdout=held_errors,
        gap=torque_gap(standing, outcome.first, fit_errors),
        where=locate(standing.now, case),
        candidates=outcome.tried,
        remaining=shapes,
        not_examined=find_drives_at_limit(case.records, standing.model.machine.modelled_joints).not_examined,
        model_before=standing.given,
        model_after=_resulting_model(outcome, traces),
        traces=tuple(traces),
        holdout=tuple(held_out),
        seconds=0.0,
        robot_seconds=0.0,
        significant=case.options.least_evidence,
        notes_data=_notes(outcome, cutoff, _on_torque_left(shares, standing, found)),
    )


def _as_last_fitted(standing: Standing) -> tuple[Step, ...]:
    """The steps with the parameters of the last fit: a step's own values are biased by effects that were found after
    it."""
    steps = []
    for step in standing.steps:
        own = [standing.model.parameter(name) for name in step.parameters] if step.adopted else []
        steps.append(step.model_copy(update={"parameters": found_values(standing.now, own)}) if own else step)
    return tuple(steps)


def _errors(standing: Standing, records: tuple[RecordedMotion, ...]) -> tuple[SignalError, ...]:
    """Errors of every joint on these records, by the given model and by the one that comes out; none of a joint of
    which no record tells anything."""
    if not records:
        return ()
    untold = np.all([r.not_known for r in records], axis=0)
    before = np.where(
        untold, np.nan, holdout.held_out_squares(standing.given, expected_timing(standing.given), records)
    )
    after = holdout.held_out_squares(standing.model, standing.now.values, records)
    return signal_errors(standing.model, before, after, standing.case.noise)


def _resulting_model(outcome: Outcome, traces: Sequence[str]) -> Model:
    """The model that comes out, with what the controller's numbers prove, and where it comes from."""
    standing = outcome.standing
    known = standing.now.model_values
    estimates = ((name, known[name], d) for name, d in standard_deviations(standing.now).items() if name in known)
    learnt = summarise_posterior(standing.given.lineage, traces, estimates)
    lineage = Lineage(
        parent=standing.given.identity,
        traces=tuple(traces),
        fit={"fitted": [u.name for u in outcome.unknowns], **learnt},
        note="diagnosis",
    )
    found = standing.model.with_values(standing.now.model_values)
    return outcome.controller.with_findings(found).with_lineage(lineage)


def _notes(outcome: Outcome, cutoff: float, torque: tuple[Note, ...]) -> tuple[Note, ...]:
    """What an answer notes, below a cutoff in Hz. torque: what of it is left."""
    standing = outcome.standing
    values = standing.now.values
    return (
        *on_stated_numbers((u.as_stated for u in outcome.unknowns if u.name not in outcome.added), values),
        *on_named_numbers((p for name, p in outcome.stated.items() if name in outcome.added), values),
        *torque,
        *_assumptions(cutoff, outcome.controller.not_looked_for),
        *_at_limits(standing),
        *outcome.notes,
    )


def _torque_left(standing: Standing, first: BalanceFit) -> dict[str, float]:
    """Residual as a share of the recorded torque, by the model as given, with its numbers fitted, and after: the figure
    that the literature usually gives. NaN where nothing is driven."""
    records = standing.case.held_out or standing.case.records
    fits = {
        "given": (standing.given, expected_timing(standing.given)),
        "before": (standing.given, first.values),
        "after": (standing.model, standing.now.values),
    }
    return {name: holdout.relative_torque_error(*fit, records) for name, fit in fits.items()}


def _on_torque_left(shares: Mapping[str, float], standing: Standing, found: Verdict) -> tuple[Note, ...]:
    """These shares; none where nothing is driven. A warning where more is left than there is, and nothing explains why:
    a spring that is named takes away a torque that the model as given has to supply."""
    if not math.isfinite(shares["given"]):
        return ()
    doubted = max(shares.values()) > 1.0 and found not in ("named", "ambiguous")
    values = {"held_out": bool(standing.case.held_out), **shares, "doubted": doubted}
    return (Note(kind="torque-left", values=values, warning=doubted),)


def _assumptions(cutoff: float, not_looked_for: Mapping[str, str]) -> tuple[Note, ...]:
    return (
        Note(kind="cutoff", values={"cutoff": cutoff}),
        Note(kind="resting-left-out"),
        Note(kind="not-looked-for", values={"effects": dict(not_looked_for)}),
        Note(kind="positions-of-links"),
    )


def _at_limits(standing: Standing) -> tuple[Note, ...]:
    """Where drives were at limits that no file states."""
    joints = standing.model.machine.modelled_joints
    found = find_drives_at_limit((*standing.case.records, *standing.case.held_out), joints)
    return on_drives_at_limit(found.shares, found.unknown)
