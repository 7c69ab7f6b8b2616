"""The answer of a diagnosis: its last fit, steps, errors and notes as one record."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import UNWRITTEN, Candidate, Diagnosis, Gap, SignalError, Step
from model.discrepancy.engine.case import Case
from model.discrepancy.engine.fitting import Fit, evaluate, fit, found_values
from model.discrepancy.engine.judging import is_left_beside
from model.discrepancy.engine.standing import Standing
from model.discrepancy.engine.step_record import signal_errors
from model.discrepancy.engine.workflow import Workflow
from model.discrepancy.explanation.notes import on_named_numbers, on_stated_numbers, on_unfinished
from model.discrepancy.grounds import Note
from model.discrepancy.verdict import gap_numbers, gap_of, verdict
from model.fitting.unknowns import Unknown
from model.machine_model.model import Lineage, Model
from model.machine_model.posterior import summarise_posterior


def answer_of(
    work: Workflow,
    proved: Sequence[Step],
    traces: Sequence[Trace],
    held_out: Sequence[Trace],
    *,
    doubted: bool = False,
) -> Diagnosis:
    """The answer of a search that has ended, without its sentences, the time that it took and what its kind of
    comparison notes.

    Args:
        proved: steps that need no fit. traces, held_out: those that were fitted to, and that were not. doubted: whether
            more is left than there is, or what is left has the form of an effect that was added.
    """
    standing, case = work.found, work.case
    named = bool(standing.adopted)
    given = given_fit(case)
    steps = (*proved, *_as_last_fitted(standing))
    missing = bool(work.left) and not named
    found = verdict(
        steps,
        unexplained=missing,
        suspected=work.suspicion is not None,
        partly=doubted or is_left_beside(standing),
    )
    rmse_fit = signal_errors(case, given.squares, standing.now.squares, case.noise)
    rmse_held: tuple[SignalError, ...] = ()
    if case.held_out is not None:
        before, after = (case.held_squares(f) for f in (given, standing.now))
        rmse_held = signal_errors(case, before, after, case.noise_held)
    # each once: a trace may be in pieces
    fitted, checked = (tuple(dict.fromkeys(t.record.trace_id for t in some)) for some in (traces, held_out))
    return Diagnosis(
        verdict=found,
        suspicion=None if named else work.suspicion,
        summary=UNWRITTEN,
        method=case.method,
        steps=steps,
        unexplained_joints=work.left if found == "unknown-effect" else (),
        rmse_fit=rmse_fit,
        rmse_holdout=rmse_held,
        gap=_gap(standing, given, [e.joint for e in rmse_fit]),
        where=case.where(standing.now),
        candidates=work.tried,
        remaining=case.shapes(standing.now),
        model_before=standing.case.given,
        model_after=_resulting_model(standing, fitted),
        traces=fitted,
        holdout=checked,
        seconds=0.0,
        robot_seconds=sum(float(t.time[-1] - t.time[0]) for t in traces),
        significant=case.options.least_evidence,
        notes_data=(*_on_the_search(case), *_on_numbers(standing), *work.notes, *on_unfinished((*traces, *held_out))),
    )


def given_fit(case: Case) -> Fit:
    """The model as it was given, with nothing fitted."""
    unknowns = case.unknowns(case.given, {})
    values = {u.name: u.start if u.deviation is None else u.expected for u in unknowns}
    return evaluate(case.compared.of_model(case.given), unknowns, values, np.ones(len(case.noise)))


def _gap(standing: Standing, given: Fit, joints: Sequence[int]) -> Gap:
    """How the error shrinks from stage to stage. joints: those of which records tell something."""
    case = standing.case
    taken = [(step, _within_file(standing, standing.adopted[k:])) for k, step in enumerate(standing.adopted, start=1)]
    numbers = gap_numbers(case.given.machine, standing.first.values, standing.now.values)
    columns = [case.given.machine.modelled_joints.index(j) for j in joints]
    noise, most = case.noise_of_errors(standing.now)
    told = [(j, case.unit(j), float(noise[c]), float(most[c])) for j, c in zip(joints, columns, strict=True)]

    def errors(one: Fit) -> dict[str, tuple[float | None, ...]]:
        return {name: tuple(own[c] for c in columns) if own else () for name, own in case.errors(one).items()}

    return gap_of(case.measure, told, errors, given, standing.first, taken, standing.now, numbers)


def _within_file(standing: Standing, later: Sequence[Step]) -> Fit:
    """The fit without the effects of later steps, with the numbers within one deviation of what the file states."""
    stated, model = standing.case.given.by_name, standing.model
    out: set[str] = set()
    for step in later:
        out |= step.parameters.keys()
        back = {name: stated[name].value for name in step.parameters if name in stated}
        model = standing.model_without(step, model.with_values(back))
    now = standing.now
    # a disturbance is named by size and phase, and fitted by sine and cosine
    known = model.by_name.keys() - out
    unknowns = [u.within_stated for u in now.unknowns if u.name not in now.model.by_name or u.name in known]
    return fit(now.compared.of_model(model), unknowns, now.values, now.memory, now.known)


def _as_last_fitted(standing: Standing) -> tuple[Step, ...]:
    """The steps with the parameters of the last fit: a step's own values are biased by effects that were found after
    it."""
    steps = []
    for step in standing.steps:
        own = [standing.model.parameter(name) for name in step.parameters] if step.adopted else []
        bias = standing.case.bias(standing.now, own) if own else {}
        values = found_values(standing.now, own, bias) if own else {}
        told = {"parameters": values, "group": _still_open(step, standing)}
        steps.append(step.model_copy(update=told) if own else step)
    return tuple(steps)


def _still_open(step: Step, standing: Standing) -> tuple[Candidate, ...]:
    """The candidates of a step that leave its name open: none that was found too, by another step, which the effect
    stands beside, and not in the place of."""
    found = [(s.effect, set(s.joints)) for s in standing.adopted if s is not step]
    group = [c for c in step.group if not any(c.effect == name and set(c.joints) <= joints for name, joints in found)]
    return tuple(group) if len(group) > 1 else ()


def _of_model(standing: Standing) -> list[Unknown]:
    """The unknowns of the last fit that are of the machine or of stated effects."""
    return [u for u in standing.now.unknowns if not u.nuisance]


def _resulting_model(standing: Standing, traces: tuple[str, ...]) -> Model:
    """The model that comes out, and where it comes from."""
    given, known = standing.case.given, standing.now.model_values
    estimates = ((name, known[name], d) for name, d in standing.now.standard_deviations.items() if name in known)
    learnt = summarise_posterior(given.lineage, traces, estimates)
    record = {"fitted": [u.name for u in _of_model(standing)], **learnt}
    lineage = Lineage(parent=given.identity, traces=traces, fit=record, note="diagnosis")
    return standing.model.with_lineage(lineage)


def _on_the_search(case: Case) -> tuple[Note, ...]:
    """That not every known effect was looked for, or not on every joint; nothing follows for the others."""
    effects, joints = case.options.effects, case.options.joints
    if set(joints or ()) >= set(case.given.machine.modelled_joints):
        joints = None
    values = {"effects": effects and [*effects], "joints": joints and [*joints]}
    return () if effects is None and joints is None else (Note(kind="limited-search", values=values),)


def _on_numbers(standing: Standing) -> tuple[Note, ...]:
    """Numbers that came out far from what the file states, and those that steps have named."""
    values, added = standing.now.values, standing.added
    return (
        *on_stated_numbers((u.as_stated for u in _of_model(standing) if u.name not in added), values),
        *on_named_numbers((p for name, p in standing.stated.items() if name in added), values),
    )
