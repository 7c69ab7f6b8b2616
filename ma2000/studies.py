"""Design, validation and diagnosis, with the defaults of the commands of the same names.

The argument `progress` selects a progress bar: docs/python.md.
"""

from __future__ import annotations

from collections.abc import Sequence

from daq.contracts.progress import Cancel
from daq.contracts.trace import Traces, as_sequence
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
from model.validation.expected_deviation import names_to_validate
from model.validation.fidelity import validate_by_distortion
from server.jobs.next_experiment import experiment_chooser


def validate(
    model: ModelLike,
    traces: Traces,
    parameters: Sequence[str] | None = None,
    *,
    progress: Shown = True,
    cancel: Cancel | None = None,
) -> Fidelity:
    """Tests whether expected deviations of the parameters explain the model's errors, by distortion: Σλ² (thesis,
    chapter 4).

    Args:
        parameters: names or patterns (`joint2.*`); None for the fitted ones, or else all with a stated deviation.

    Raises SpecError, TraceError; CancelledError if cancelled.
    """
    model = model_of(model)
    names = names_to_validate(model, parameters)
    options = Options(quantise=False)
    with told(progress, "validating") as tell:
        return validate_by_distortion(model, as_sequence(traces), names, options=options, progress=tell, cancel=cancel)


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
    """Finds where a model and traces disagree and which effects are missing. By output error, also proposes what to
    measure next.

    Args:
        options: `DiagnosisOptions(method="output-error")` simulates. By default, torques are balanced (inverse
            dynamics) if a sampled controller's drive was recorded, unless `design` is set; no experiment is proposed
            then.
        design: whether the proposed experiment may be a motion designed for the candidates, which takes about 10 s
            more.

    Raises TraceError, SpecError for unusable input; CancelledError if cancelled.
    """
    model = model_of(model)
    chooser = experiment_chooser(model.machine, design=design)
    with told(progress, "diagnosing") as tell:
        return workflow.diagnose(model, as_sequence(traces), as_sequence(holdout), options, tell, cancel, chooser)


def design(
    model: ModelLike,
    options: DesignOptions | None = None,
    fit_options: FitOptions | None = None,
    *,
    progress: Shown = True,
    cancel: Cancel | None = None,
) -> DesignedExperiments:
    """Designs experiments within the machine's limits that determine the parameters of `fit_options` best together.

    Raises SpecError if no candidate is within the limits; CancelledError if cancelled.
    """
    one = model_of(model)
    with told(progress, "designing") as tell:
        return search.design(one, lambda spec: planned(spec, one.machine), options, fit_options, tell, cancel)
