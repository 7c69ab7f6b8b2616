"""Diagnosis by inverse dynamics: the missing effects that recorded drive and motion show."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import asdict

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.progress import Cancel, Never, Progress, silent
from daq.contracts.trace import Trace
from model.discrepancy.controller.evidence import judge_controller
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.engine.answer import answer_of, given_fit
from model.discrepancy.engine.workflow import Workflow
from model.discrepancy.explanation.answer_words import with_sentences
from model.discrepancy.explanation.notes import on_drives_at_limit
from model.discrepancy.grounds import Note
from model.discrepancy.inverse_dynamics.case import TorqueCase, torque_case
from model.discrepancy.inverse_dynamics.tolerances import FITTED_SHARE, tolerances
from model.discrepancy.options import DiagnosisOptions, TorqueOptions, check_options, torque_options
from model.inverse_dynamics.drive_limits import find_drives_at_limit
from model.inverse_dynamics.readings import choose_cutoff
from model.inverse_dynamics.recorded_motion import recorded_motions
from model.inverse_dynamics.repeats import noise_of_torques
from model.inverse_dynamics.shaking import find_shaking
from model.inverse_dynamics.torque_balance import NOT_IN_TORQUES, TorqueBalance
from model.machine_model.model import Model


def diagnose_torques(
    model: Model,
    traces: Sequence[Trace],
    held_out: Sequence[Trace] = (),
    options: DiagnosisOptions | TorqueOptions | None = None,
    progress: Progress = silent,
    cancel: Cancel | None = None,
) -> Diagnosis:
    """Name the effects that recorded drive and motion show and the model lacks, add them, and show what that removes.

    No controller and no simulation is needed. Where nothing is held out, an effect must hold on quarters of the traces
    that are predicted from the others. Torques are compared below the cutoff that was asked for, or the highest one
    that accelerations of the traces to fit to bear.

    Raises:
        TraceError, SpecError: for traces that cannot be compared in torques, or in which nothing moves beyond the noise
            of its readings, and for options that cannot give an answer. CancelledError: when asked to end.
    """
    begun = time.perf_counter()
    if not traces:
        raise TraceError("no traces: a diagnosis needs at least one")
    chosen = torque_options(options)
    check_options(chosen, model)
    controller = judge_controller(model, traces)
    _refuse_unseen(chosen, controller.settled)
    cutoff = chosen.cutoff or choose_cutoff(traces, model.machine)
    progress(0.0, f"low-passing the records at {cutoff:g} Hz")
    records, held = (recorded_motions(some, model.machine, cutoff) for some in (traces, held_out))
    noise = noise_of_torques(model, traces, TorqueBalance(model, records), cutoff)
    case = torque_case(model, records, held, noise, chosen)
    recorded = sum(float(r.time[-1] - r.time[0]) for r in (*records, *held))
    work = Workflow(case, recorded, progress, cancel or Never())
    work.run()
    shares = _torque_left(case, work)
    unlike = any(case.is_unlike(work.found.now, step, work.left) for step in work.found.adopted)
    answer = answer_of(work, controller.steps, traces, held_out, doubted=unlike or shares["after"] > 1.0)
    unseen = {name: why for name, why in NOT_IN_TORQUES.items() if name not in controller.settled}
    limits = find_drives_at_limit((*records, *held), model.machine.modelled_joints)
    notes = (
        *answer.notes_data[: len(answer.notes_data) - len(work.notes)],
        *_on_torque_left(case, shares, named=answer.verdict in ("named", "ambiguous")),
        Note(kind="cutoff", values={"cutoff": cutoff}),
        Note(kind="resting-left-out"),
        Note(kind="not-looked-for", values={"effects": unseen}),
        Note(kind="positions-of-links"),
        *on_drives_at_limit(limits.shares, limits.unknown),
        _on_tolerances(case),
        *work.notes,
        *_on_shaking(model, (*traces, *held_out), traces),
    )
    found = answer.model_copy(
        update={
            "notes_data": notes,
            "model_after": controller.with_findings(answer.model_after),
            "not_examined": find_drives_at_limit(records, model.machine.modelled_joints).not_examined,
        }
    )
    return with_sentences(found).model_copy(update={"seconds": time.perf_counter() - begun})


def _refuse_unseen(options: TorqueOptions, settled: Sequence[str]) -> None:
    """Raises SpecError for a named effect that torques do not show: not finding it would say nothing."""
    for name in options.effects or ():
        if name in NOT_IN_TORQUES and name not in settled:
            raise SpecError(f"effect {name}: cannot be found in torques: {NOT_IN_TORQUES[name]}; leave it out")


def _on_tolerances(case: TorqueCase) -> Note:
    values = {"source": tolerances(case.given)[1], "share": FITTED_SHARE, "fitted": len(case.earlier or {})}
    return Note(kind="tolerance-source", values=values)


def _torque_left(case: TorqueCase, work: Workflow) -> dict[str, float]:
    """Residual as a share of the recorded torque, by the model as given, with its numbers fitted, and after: the figure
    that the literature usually gives. NaN where nothing is driven."""
    fits = {"given": given_fit(case), "before": work.found.first, "after": work.found.now}
    return {name: case.torque_left(one) for name, one in fits.items()}


def _on_torque_left(case: TorqueCase, shares: dict[str, float], *, named: bool) -> tuple[Note, ...]:
    """These shares; none where nothing is driven. A warning where more is left than there is, and nothing explains why:
    a spring that is named takes away a torque that the model as given has to supply."""
    if not math.isfinite(shares["given"]):
        return ()
    doubted = max(shares.values()) > 1.0 and not named
    values = {"held_out": case.held_out is not None, **shares, "doubted": doubted}
    return (Note(kind="torque-left", values=values, warning=doubted),)


def _on_shaking(model: Model, every: Sequence[Trace], traces: Sequence[Trace]) -> tuple[Note, ...]:
    """A warning about joints that shake faster than torques can be compared; none where none does."""
    try:
        cutoff = choose_cutoff(traces, model.machine)
    except SpecError:  # nothing moves beyond noise, and a cutoff was asked for
        return ()
    shaking = find_shaking(every, model.machine, cutoff)
    values = {"cutoff": cutoff, "joints": [asdict(one) for one in shaking]}
    return (Note(kind="shakes-above-cutoff", values=values, warning=True),) if shaking else ()
