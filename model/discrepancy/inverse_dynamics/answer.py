"""The answer of a diagnosis by inverse dynamics: its last fit, steps, errors and notes as one record."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import UNWRITTEN, Diagnosis, Gap, SignalError, Step, Verdict
from model.discrepancy.explanation.notes import on_drives_at_limit, on_named_numbers, on_stated_numbers, on_unfinished
from model.discrepancy.grounds import Note
from model.discrepancy.inverse_dynamics import holdout
from model.discrepancy.inverse_dynamics.estimates import found_values, signal_errors, standard_deviations
from model.discrepancy.inverse_dynamics.fitting import BalanceFit, fit
from model.discrepancy.inverse_dynamics.holdout import held_out_squares
from model.discrepancy.inverse_dynamics.judging import is_left_beside, joints_left_over
from model.discrepancy.inverse_dynamics.localisation import locate, remaining_shapes
from model.discrepancy.inverse_dynamics.standing import Standing
from model.discrepancy.inverse_dynamics.workflow import TorqueWorkflow
from model.discrepancy.output_error.controller_evidence import JudgedController
from model.discrepancy.verdict import Errors, gap_numbers, gap_of, verdict
from model.fitting.unknowns import Unknown
from model.inverse_dynamics.drive_limits import find_drives_at_limit
from model.inverse_dynamics.drive_timing import expected_timing
from model.inverse_dynamics.readings import choose_cutoff
from model.inverse_dynamics.recorded_motion import RecordedMotion
from model.inverse_dynamics.shaking import find_shaking
from model.inverse_dynamics.torque_balance import NOT_IN_TORQUES
from model.machine_model.model import Lineage, Model
from model.machine_model.posterior import summarise_posterior


def torque_gap(standing: Standing, first: BalanceFit, told: Sequence[SignalError]) -> Gap:
    """The gap of a diagnosis in torques.

    Args:
        first: the fit before any effect was added. told: errors of the joints of which records tell something.
    """
    case, end = standing.case, (standing.model, standing.now.values)
    columns = [standing.model.machine.modelled_joints.index(e.joint) for e in told]

    def errors(fitted: tuple[Model, Mapping[str, float]]) -> Errors:
        sets = {"fitted": case.records, "held_out": case.held_out}
        return {name: _roots(held_out_squares(*fitted, own), columns) if own else () for name, own in sets.items()}

    taken = [
        (step, (found.balance.model, found.values))
        for number, step in enumerate(standing.adopted, start=1)
        for found in (_within_file(standing, standing.adopted[number:]),)
    ]
    numbers = gap_numbers(standing.model.machine, first.values, standing.now.values)
    given = (standing.given, expected_timing(standing.given))
    joints = [(e.joint, e.unit, e.floor) for e in told]
    return gap_of("torques", joints, errors, given, (standing.given, first.values), taken, end, numbers)


def _within_file(standing: Standing, later: Sequence[Step]) -> BalanceFit:
    """The fit without the effects of later steps, with the numbers within one deviation of what the file states."""
    stated, model = standing.given.by_name, standing.model
    out: set[str] = set()
    for step in later:
        out |= step.parameters.keys()
        back = {name: stated[name].value for name in step.parameters if name in stated}
        model = standing.model_without(step, model.with_values(back))
    known = model.by_name.keys() - out  # a disturbance is named by size and phase, and fitted by sine and cosine
    unknowns = [u.within_stated for u in standing.now.unknowns if u.nuisance or u.name in known]
    now, case = standing.now, standing.case
    return fit(case.balance(model), unknowns, now.values, case.data, now.noise.memory, near=now.derivatives)


def _roots(squares: np.ndarray, columns: Sequence[int]) -> tuple[float | None, ...]:
    return tuple(float(np.sqrt(squares[c])) if np.isfinite(squares[c]) else None for c in columns)


def answer_of(
    work: TorqueWorkflow,
    controller: JudgedController,
    traces: Sequence[Trace],
    held_out: Sequence[Trace],
    cutoff: float,
) -> Diagnosis:
    """The whole answer of a search that has ended, except for its sentences and the time that it took.

    Args:
        traces, held_out: those that were fitted to, and that were not. cutoff: of the torques, Hz.
    """
    standing, case = work.found, work.case
    shapes = remaining_shapes(standing.now, case)
    steps = (*controller.steps, *_as_last_fitted(standing))
    named = bool(standing.adopted)
    missing = bool(shapes) or bool(joints_left_over(standing))
    fit_errors, held_errors = (_errors(standing, records) for records in (case.records, case.held_out))
    shares = _torque_left(standing, work.first)
    found = verdict(
        steps,
        unexplained=missing and not named,
        suspected=work.suspicion is not None,
        partly=shares["after"] > 1.0 or is_left_beside(standing),
    )
    # each once: a trace may be in pieces
    fitted, checked = (tuple(dict.fromkeys(t.record.trace_id for t in some)) for some in (traces, held_out))
    return Diagnosis(
        verdict=found,
        suspicion=None if named else work.suspicion,
        summary=UNWRITTEN,
        method="inverse-dynamics",
        steps=steps,
        rmse_fit=fit_errors,
        rmse_holdout=held_errors,
        gap=torque_gap(standing, work.first, fit_errors),
        where=locate(standing.now, case),
        candidates=work.tried,
        remaining=shapes,
        not_examined=find_drives_at_limit(case.records, standing.model.machine.modelled_joints).not_examined,
        model_before=standing.given,
        model_after=controller.with_findings(_resulting_model(standing, fitted)),
        traces=fitted,
        holdout=checked,
        seconds=0.0,
        robot_seconds=sum(float(t.time[-1] - t.time[0]) for t in traces),
        significant=case.options.least_evidence,
        notes_data=(
            *_on_numbers(standing),
            *_on_torque_left(shares, standing, found),
            Note(kind="cutoff", values={"cutoff": cutoff}),
            Note(kind="resting-left-out"),
            Note(kind="not-looked-for", values={"effects": _unseen(controller)}),
            Note(kind="positions-of-links"),
            *_at_limits(standing),
            *work.notes,
            *on_unfinished((*traces, *held_out)),
            *_on_shaking(standing.given, traces, held_out),
        ),
    )


def _unseen(controller: JudgedController) -> dict[str, str]:
    """Effects that nothing here shows, and why."""
    return {name: why for name, why in NOT_IN_TORQUES.items() if name not in controller.settled}


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


def _of_model(standing: Standing) -> list[Unknown]:
    """The unknowns of the last fit that are of the model."""
    return [u for u in standing.now.unknowns if not u.nuisance]


def _resulting_model(standing: Standing, traces: tuple[str, ...]) -> Model:
    """The model that comes out, and where it comes from."""
    known = standing.now.model_values
    estimates = ((name, known[name], d) for name, d in standard_deviations(standing.now).items() if name in known)
    learnt = summarise_posterior(standing.given.lineage, traces, estimates)
    fit = {"fitted": [u.name for u in _of_model(standing)], **learnt}
    lineage = Lineage(parent=standing.given.identity, traces=traces, fit=fit, note="diagnosis")
    return standing.model.with_values(known).with_lineage(lineage)


def _on_numbers(standing: Standing) -> tuple[Note, ...]:
    """Numbers that came out far from what the file states, and those that steps have named."""
    values, added = standing.now.values, standing.added
    return (
        *on_stated_numbers((u.as_stated for u in _of_model(standing) if u.name not in added), values),
        *on_named_numbers((p for name, p in standing.stated.items() if name in added), values),
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


def _at_limits(standing: Standing) -> tuple[Note, ...]:
    """Where drives were at limits that no file states."""
    joints = standing.model.machine.modelled_joints
    found = find_drives_at_limit((*standing.case.records, *standing.case.held_out), joints)
    return on_drives_at_limit(found.shares, found.unknown)


def _on_shaking(model: Model, traces: Sequence[Trace], held_out: Sequence[Trace]) -> tuple[Note, ...]:
    """A warning about joints that shake faster than torques can be compared; none where none does."""
    try:
        cutoff = choose_cutoff(traces, model.machine)
    except SpecError:  # nothing moves beyond noise, and a cutoff was asked for
        return ()
    shaking = find_shaking((*traces, *held_out), model.machine, cutoff)
    values = {"cutoff": cutoff, "joints": [asdict(one) for one in shaking]}
    return (Note(kind="shakes-above-cutoff", values=values, warning=True),) if shaking else ()
