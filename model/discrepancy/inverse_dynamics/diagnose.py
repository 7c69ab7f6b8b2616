"""Diagnosis by inverse dynamics: the missing effects that recorded drive and motion show."""

from __future__ import annotations

import time
from collections.abc import Sequence

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.progress import Cancel, Never, Progress, silent
from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.explanation.answer_words import with_sentences
from model.discrepancy.inverse_dynamics.judged_controller import judge_controller
from model.discrepancy.inverse_dynamics.options import TorqueOptions, torque_options
from model.discrepancy.inverse_dynamics.records import Records
from model.discrepancy.options import DiagnosisOptions, check_options
from model.inverse_dynamics.torque_balance import NOT_IN_TORQUES
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
    that are predicted from the others.

    Raises:
        TraceError, SpecError: for traces or options that cannot give an answer. CancelledError: when asked to end.
    """
    begun = time.perf_counter()
    if not traces:
        raise TraceError("no traces: a diagnosis needs at least one")
    chosen = torque_options(options)
    check_options(chosen, model)
    controller = judge_controller(model, traces)
    _refuse_unseen(chosen, controller.settled)
    records = Records(model, tuple(traces), tuple(held_out), chosen, controller, cancel or Never())
    found = records.answer(progress)
    return with_sentences(found.model_copy(update={"seconds": time.perf_counter() - begun}))


def _refuse_unseen(options: TorqueOptions, settled: Sequence[str]) -> None:
    """Raises SpecError for a named effect that torques do not show: not finding it would say nothing."""
    for name in options.effects or ():
        if name in NOT_IN_TORQUES and name not in settled:
            raise SpecError(f"effect {name}: cannot be found in torques: {NOT_IN_TORQUES[name]}; leave it out")
