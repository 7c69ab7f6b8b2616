"""The entrance to a diagnosis: it chooses the method."""

from __future__ import annotations

from collections.abc import Sequence

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import NoController, SampledPid
from daq.contracts.progress import Cancel, Never, Progress, rising, silent
from daq.contracts.trace import Trace
from model.discrepancy.by_simulation import diagnose_by_simulation
from model.discrepancy.diagnosis import UNWRITTEN, Diagnosis
from model.discrepancy.engine.case import Watch
from model.discrepancy.experiment_design.next_experiment import ExperimentChooser
from model.discrepancy.explanation.answer_words import with_sentences
from model.discrepancy.grounds import Method
from model.discrepancy.options import DiagnosisOptions, check_options
from model.inverse_dynamics.readings import choose_cutoff
from model.inverse_dynamics.recorded_motion import recorded_motions
from model.inverse_dynamics.torque_balance import NOT_IN_TORQUES
from model.machine_model.model import Model
from model.record_check.check import as_used, check_records, require_computable
from model.record_check.finding import RecordFinding, doubts_in
from model.record_check.pieces import in_pieces
from model.simulation.inputs import inputs_of


def choose_method(model: Model, traces: Sequence[Trace], options: DiagnosisOptions, *, designs: bool) -> Method:
    """The method that the options ask for, else the one that suits machine and traces.

    Without a controller or without set points nothing can be simulated. Where a sampled controller's drive was
    recorded, the drive says what acted on the arm, whatever the controller did: torques are balanced (decision 0053).
    The loop is simulated for the board, whose readings are too coarse for accelerations; for effects that torques do
    not show; and where an experiment is to be designed, which needs simulations of the rivals.

    Args:
        designs: whether the next experiment is to be designed.

    Raises:
        SpecError: for a method that this machine or these traces do not allow.
    """
    loop_known = not isinstance(model.machine.controller, NoController) and all(t.set_point is not None for t in traces)
    if options.method == "output-error" and not loop_known:
        raise SpecError(
            "method output-error: simulates the controller, so it needs a machine file that describes one and traces "
            "with set points; leave the method out, or take inverse-dynamics"
        )
    if options.method is not None:
        return options.method
    if not loop_known:
        return "inverse-dynamics"
    unseen = set(options.effects or ()) & set(NOT_IN_TORQUES)
    if designs or unseen or not isinstance(model.machine.controller, SampledPid):
        return "output-error"
    return "inverse-dynamics" if _accelerations_are_known(model, traces) else "output-error"


def _accelerations_are_known(model: Model, traces: Sequence[Trace]) -> bool:
    """Whether the traces hold the drives of all control periods, and accelerations beyond the noise of their readings.
    What a drive was in between is unknown. A record that torques cannot use, as one with a gap or one of half a second,
    may still be simulated."""
    if any(trace.drive is None for trace in traces):
        return False
    try:
        if not all(inputs_of(trace, model.machine).drive_of_every_period for trace in traces):
            return False
        recorded_motions(traces, model.machine, choose_cutoff(traces, model.machine))
    except (SpecError, TraceError):
        return False
    return True


def diagnose(
    model: Model,
    traces: Sequence[Trace],
    holdout: Sequence[Trace] = (),
    options: DiagnosisOptions | None = None,
    progress: Progress = silent,
    cancel: Cancel | None = None,
    chooser: ExperimentChooser | None = None,
    watch: Watch | None = None,
) -> Diagnosis:
    """Where a model and traces disagree, which effects are missing, and what adding them brings.

    Either the closed loop is simulated from the recorded set points, or the recorded drive is balanced against the
    motion in torques: `choose_method` says when. `chooser` knows the experiments that may be run next on a machine with
    a controller; without it, or in torques, nothing is proposed. `watch` is called with the leading candidates while
    the loop is simulated with them.

    The records are checked first. Where units, signs, columns, times or readings are doubted, the verdict is
    `check-the-record`, and nothing is computed unless the options say so.

    Raises:
        TraceError, SpecError: for traces or options that cannot give an answer; one line says why.
        CancelledError: when asked to end.
    """
    options, cancel, progress = options or DiagnosisOptions(), cancel or Never(), rising(progress)
    check_options(options, model)
    _refuse_shared(traces, holdout)
    _refuse_foreign(model, (*traces, *holdout))
    progress(0.0, "checking the records")
    found = check_records(model, (*traces, *holdout))
    if doubts_in(found) and not options.despite_doubts:
        return _doubted(model, traces, holdout, found)
    require_computable(found)
    answer = _computed(model, traces, holdout, options, progress, cancel, chooser, watch)
    doubted = {"verdict": "check-the-record"} if doubts_in(found) else {}
    return with_sentences(answer.model_copy(update={"record": found, **doubted})) if found else answer


def _computed(
    model: Model,
    traces: Sequence[Trace],
    holdout: Sequence[Trace],
    options: DiagnosisOptions,
    progress: Progress,
    cancel: Cancel,
    chooser: ExperimentChooser | None,
    watch: Watch | None,
) -> Diagnosis:
    """The answer of the method that suits, whatever is doubted."""
    designs = chooser is not None and chooser.search is not None
    if choose_method(model, (*traces, *holdout), options, designs=designs) == "inverse-dynamics":
        from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques  # not needed with a controller

        whole, held = (in_pieces(as_used(some, model.machine)) for some in (traces, holdout))
        return diagnose_torques(model, whole, held, options, progress, cancel)
    traces, holdout = (as_used(some, model.machine, "closed") for some in (traces, holdout))
    return diagnose_by_simulation(model, traces, holdout, options, progress, cancel, chooser, watch)


def _doubted(
    model: Model, traces: Sequence[Trace], holdout: Sequence[Trace], found: tuple[RecordFinding, ...]
) -> Diagnosis:
    """The answer to records that are to be checked first."""
    answer = Diagnosis(
        verdict="check-the-record",
        summary=UNWRITTEN,
        steps=(),
        record=found,
        model_before=model,
        model_after=model,
        traces=tuple(t.record.trace_id for t in traces),
        holdout=tuple(t.record.trace_id for t in holdout),
        seconds=0.0,
        robot_seconds=float(sum(t.time[-1] - t.time[0] for t in traces if len(t))),
    )
    return with_sentences(answer)


def _refuse_foreign(model: Model, traces: Sequence[Trace]) -> None:
    """Raises SpecError for a trace that names another machine than the model's."""
    for trace in traces:
        own = trace.record.machine
        if own is not None and own.name != model.machine.name:
            raise SpecError(f"{trace.called}: was made on {own.name}, the model describes {model.machine.name}")


def _refuse_shared(traces: Sequence[Trace], holdout: Sequence[Trace]) -> None:
    """Raises TraceError for a trace that would be both fitted to and held out."""
    for trace in holdout:
        if any(trace.record.trace_id == other.record.trace_id for other in traces):
            raise TraceError(f"{trace.called}: is both fitted to and held out; what is held out must be another trace")
