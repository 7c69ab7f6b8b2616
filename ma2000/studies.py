"""Design, validation, diagnosis and feedforward with the defaults of the commands of the same names.

`progress` of each says whether a bar shows how far it is: docs/python.md.
"""

from __future__ import annotations

from collections.abc import Sequence

from daq.contracts.errors import TraceError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import Machine, load_machine
from daq.contracts.progress import Cancel
from daq.contracts.trace import Trace
from daq.safety.planned import motion_of, planned
from daq.trajectories.presets import preset
from ma2000.progress import Shown, told
from model.design import search
from model.design.search import DesignedExperiments, DesignOptions
from model.discrepancy import workflow
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.options import DiagnosisOptions
from model.feedforward import inverse, learning, tracking
from model.feedforward.tracking import Followed
from model.fitting.options import FitOptions
from model.machine_model.model import Model
from model.simulation.prepared import Options
from model.validation.criterion import Fidelity
from model.validation.fidelity import validate_by_distortion
from model.validation.names import names_to_validate
from server.jobs.next_experiment import experiment_chooser


def validate(
    model: Model,
    traces: Sequence[Trace],
    parameters: Sequence[str] | None = None,
    *,
    progress: Shown = True,
    cancel: Cancel | None = None,
) -> Fidelity:
    """Whether expected deviations of the parameters explain the model's errors, by distortion: Σλ² (thesis, chapter 4).

    Args:
        parameters: names or patterns (`joint2.*`); None for those that were fitted, or else for all uncertain ones.

    Raises SpecError, TraceError; CancelledError when asked to end.
    """
    names = names_to_validate(model, parameters)
    options = Options(quantise=False)
    with told(progress, "validating") as tell:
        return validate_by_distortion(model, traces, names, options=options, progress=tell, cancel=cancel)


def diagnose(
    model: Model,
    traces: Sequence[Trace],
    holdout: Sequence[Trace] = (),
    options: DiagnosisOptions | None = None,
    *,
    design: bool = False,
    progress: Shown = True,
    cancel: Cancel | None = None,
) -> Diagnosis:
    """Where a model and traces disagree, which effects are missing, and, where the loop is simulated, what to measure
    next.

    Args:
        options: `DiagnosisOptions(method="output-error")` simulates; by default torques are balanced where a sampled
            controller's drive was recorded (unless `design` is set), and they propose no experiment.
        design: what to measure next may be a motion that is designed for the candidates; it takes some 10 s more.

    Raises TraceError, SpecError for input that cannot give an answer; CancelledError when asked to end.
    """
    chooser = experiment_chooser(model.machine, design=design)
    with told(progress, "diagnosing") as tell:
        return workflow.diagnose(model, traces, holdout, options, tell, cancel, chooser)


def design(
    model: Model,
    options: DesignOptions | None = None,
    fit_options: FitOptions | None = None,
    *,
    progress: Shown = True,
    cancel: Cancel | None = None,
) -> DesignedExperiments:
    """Experiments within the machine's limits that make the parameters of `fit_options` best known together.

    Raises SpecError when no candidate is within the limits; CancelledError when asked to end.
    """
    with told(progress, "designing") as tell:
        return search.design(model, lambda spec: planned(spec, model.machine), options, fit_options, tell, cancel)


def feedforward(
    model: Model,
    experiment: ExperimentSpec | str = "ramp",
    machine: Machine | None = None,
    *,
    progress: Shown = True,
) -> ExperimentSpec:
    """The experiment whose set points make the arm follow the motion of `experiment`, as the model knows the arm.

    Args:
        experiment: or the name of a preset.
        machine: the machine that carries it out; None for the MA2000. Its limits hold.

    `result.feedforward.expected` has the tracking error that the model expects of each joint. Raises SpecError,
    SafetyError.
    """
    machine = machine or load_machine("ma2000")
    with told(progress, "computing set points") as tell:
        return inverse.feedforward(model, _spec(experiment), machine, lambda spec: planned(spec, machine), tell)


def learn(
    trace: Trace,
    model: Model | None = None,
    machine: Machine | None = None,
    *,
    share: float = 1.0,
) -> ExperimentSpec:
    """The experiment that corrects the set points of a recorded one by its tracking error: iterative learning.

    Args:
        model: says how the arm answers set points; None: that is estimated from the trace.
        machine: the machine that carries it out; None for the one that the trace is of.
        share: of the correction that is made, above 0 and up to 1.

    Raises TraceError for a trace that nothing can be learned from; SpecError, SafetyError.
    """
    own = trace.record.machine if machine is None else machine
    spec = trace.record.spec
    if spec is None or own is None:
        raise TraceError(f"trace {trace.record.trace_id}: does not say which experiment it is of")
    return learning.learn(trace, spec.plain, own, lambda one: planned(one, own), model, share)


def followed(trace: Trace) -> Followed | None:
    """The motion that a trace's experiment asked for beside the arm's, with the tracking error of each joint; None for
    a trace that does not say which experiment it is of. Raises SpecError, TraceError."""
    machine = trace.record.machine
    return None if machine is None else tracking.followed(trace, lambda spec: motion_of(spec, machine))


def _spec(experiment: ExperimentSpec | str) -> ExperimentSpec:
    return preset(experiment).spec if isinstance(experiment, str) else experiment
