"""Design, validation and diagnosis with the defaults of the commands of the same names.

`progress` of each says whether a bar shows how far it is: docs/python.md.
"""

from __future__ import annotations

from collections.abc import Sequence

from daq.contracts.progress import Cancel
from daq.contracts.trace import Traces, several
from daq.safety.planned import planned
from ma2000.given import ModelLike, model_of
from ma2000.progress import Shown, told
from model.design import search
from model.design.search import DesignedExperiments, DesignOptions
from model.discrepancy import workflow
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.options import DiagnosisOptions
from model.fitting.options import FitOptions
from model.simulation.prepared import Options
from model.validation.criterion import Fidelity
from model.validation.fidelity import validate_by_distortion
from model.validation.names import names_to_validate
from server.jobs.next_experiment import experiment_chooser


def validate(
    model: ModelLike,
    traces: Traces,
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
    model = model_of(model)
    names = names_to_validate(model, parameters)
    options = Options(quantise=False)
    with told(progress, "validating") as tell:
        return validate_by_distortion(model, several(traces), names, options=options, progress=tell, cancel=cancel)


def diagnose(
    model: ModelLike,
    traces: Traces,
    holdout: Traces = (),
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
    model = model_of(model)
    chooser = experiment_chooser(model.machine, design=design)
    with told(progress, "diagnosing") as tell:
        return workflow.diagnose(model, several(traces), several(holdout), options, tell, cancel, chooser)


def design(
    model: ModelLike,
    options: DesignOptions | None = None,
    fit_options: FitOptions | None = None,
    *,
    progress: Shown = True,
    cancel: Cancel | None = None,
) -> DesignedExperiments:
    """Experiments within the machine's limits that make the parameters of `fit_options` best known together.

    Raises SpecError when no candidate is within the limits; CancelledError when asked to end.
    """
    one = model_of(model)
    with told(progress, "designing") as tell:
        return search.design(one, lambda spec: planned(spec, one.machine), options, fit_options, tell, cancel)
