"""Diagnosis by inverse dynamics: the missing effects that recorded drive and motion show."""

from __future__ import annotations

import time
from collections.abc import Sequence

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.progress import Cancel, Never, Progress, silent
from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.explanation.answer_words import with_sentences
from model.discrepancy.inverse_dynamics.answer import answer_of
from model.discrepancy.inverse_dynamics.fitting import TorqueCase
from model.discrepancy.inverse_dynamics.workflow import TorqueWorkflow
from model.discrepancy.options import DiagnosisOptions, TorqueOptions, check_options, torque_options
from model.discrepancy.output_error.controller_evidence import judge_controller
from model.inverse_dynamics.readings import choose_cutoff
from model.inverse_dynamics.recorded_motion import recorded_motions
from model.inverse_dynamics.repeats import noise_left
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
    noise = noise_left(model, traces, TorqueBalance(model, records), cutoff)
    work = TorqueWorkflow(model, TorqueCase(records, held, noise, chosen), progress, cancel or Never())
    work.run()
    found = with_sentences(answer_of(work, controller, traces, held_out, cutoff))
    return found.model_copy(update={"seconds": time.perf_counter() - begun})


def _refuse_unseen(options: TorqueOptions, settled: Sequence[str]) -> None:
    """Raises SpecError for a named effect that torques do not show: not finding it would say nothing."""
    for name in options.effects or ():
        if name in NOT_IN_TORQUES and name not in settled:
            raise SpecError(f"effect {name}: cannot be found in torques: {NOT_IN_TORQUES[name]}; leave it out")
