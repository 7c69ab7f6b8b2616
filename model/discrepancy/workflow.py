"""The entrance to a diagnosis: it chooses the method."""

from __future__ import annotations

from collections.abc import Sequence

from daq.contracts.errors import TraceError
from daq.contracts.progress import Cancel, Never, Progress, silent
from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.experiment_design.next_experiment import ExperimentChooser
from model.discrepancy.method_choice import choose_method
from model.discrepancy.options import DiagnosisOptions, check_options
from model.discrepancy.selection.diagnose import diagnose_by_simulation
from model.machine_model.model import Model


def diagnose(
    model: Model,
    traces: Sequence[Trace],
    holdout: Sequence[Trace] = (),
    options: DiagnosisOptions | None = None,
    progress: Progress = silent,
    cancel: Cancel | None = None,
    chooser: ExperimentChooser | None = None,
) -> Diagnosis:
    """Where a model and traces disagree, which effects are missing, and what adding them brings.

    Either the closed loop is simulated from the recorded set points, or the recorded drive is balanced against the
    motion in torques: `method_choice` says when. `chooser` knows the experiments that may be run next on a machine with
    a controller; without it, or in torques, nothing is proposed.

    Raises:
        TraceError, SpecError: for traces or options that cannot give an answer; one line says why.
        CancelledError: when asked to end.
    """
    options, cancel = options or DiagnosisOptions(), cancel or Never()
    check_options(options, model)
    _refuse_shared(traces, holdout)
    designs = chooser is not None and chooser.search is not None
    if choose_method(model, (*traces, *holdout), options, designs=designs) == "inverse-dynamics":
        from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques  # not needed with a controller

        return diagnose_torques(model, traces, holdout, options, progress, cancel)
    return diagnose_by_simulation(model, traces, holdout, options, progress, cancel, chooser)


def _refuse_shared(traces: Sequence[Trace], holdout: Sequence[Trace]) -> None:
    """Raises TraceError for a trace that would be both fitted to and held out."""
    for trace in holdout:
        if any(trace.record.trace_id == other.record.trace_id for other in traces):
            raise TraceError(f"{trace.called}: is both fitted to and held out; what is held out must be another trace")
