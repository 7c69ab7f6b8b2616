"""Carries out a job in a worker process. Its input and output are files."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.errors import DaqError
from daq.contracts.extras import missing_extras_named
from daq.contracts.frozen import FrozenRecord
from daq.contracts.machine import Machine
from daq.contracts.progress import CancelledError
from daq.contracts.service.jobs import MACHINE, CompareRequest, DiagnoseRequest, FitRequest, JobRequest, ValidateRequest
from daq.contracts.service.study_options import options_of
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces.reader import read_trace
from server.jobs.mailbox import MODEL, REPORT, REQUEST, RESULT, Mailbox

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daq.contracts.trace import Trace, TraceRecord
    from model.blocks import Report
    from model.comparison.compare import Comparison
    from model.machine_model.model import Model
    from model.simulation.prepared import Options
    from server.jobs.results import JobResult

CURVE_POINTS = 21
"""Number of points of each curve of a validation."""
FIT_SHARE, VALIDATION_SHARE, DIAGNOSIS_SHARE = 0.9, 0.7, 0.9
"""Share of the progress before comparison and report."""
MAP_SHARE, REPORT_SHARE = 0.94, 0.98
"""Share of a diagnosis' progress before the disagreement map, and before the report."""


class Task(FrozenRecord):
    """The input of a worker: the request, and the files of its traces and models."""

    request: JobRequest
    machine: Machine
    traces: dict[str, Path]
    models: dict[str, Path]
    names: dict[str, str]
    """The names of the models, for tables."""
    limits: TraceLimits = DEFAULT_TRACE_LIMITS
    """The limits for reading traces."""


@dataclass(frozen=True)
class Ended:
    """How a job ended. `problem` is empty if it is done. `effects`: those that a diagnosis named."""

    problem: str = ""
    cancelled: bool = False
    model: str | None = None
    headline: str = ""
    effects: tuple[str, ...] = ()


def carry_out(folder: Path) -> Ended:
    """Carries out the job in a folder. Errors for the user are returned, not raised."""
    mailbox = Mailbox(folder)
    mailbox.report(0.0, "reading")
    task = Task.model_validate(mailbox.read(REQUEST))
    try:
        with missing_extras_named(f"a job of the kind {task.request.kind}", "model"):
            return _Worker(task, mailbox).do()
    except CancelledError:
        return Ended(cancelled=True)
    except DaqError as error:
        return Ended(problem=str(error))


class _Worker:
    def __init__(self, task: Task, mailbox: Mailbox) -> None:
        self.task = task
        self.mailbox = mailbox

    def do(self) -> Ended:
        """Carries out the request, according to its kind."""
        match self.task.request:
            case FitRequest() as request:
                return self.fit(request)
            case ValidateRequest() as request:
                return self.validate(request)
            case CompareRequest() as request:
                return self.compare(request)
            case DiagnoseRequest() as request:
                return self.diagnose(request)

    def fit(self, request: FitRequest) -> Ended:
        """Computes the same as `daq fit`."""
        from model.base_parameters.base_parameters import base_parameters
        from model.fitting.fit import fit
        from model.fitting.identifiability import undetermined_in_words
        from model.fitting.options import FitOptions
        from model.machine_model.parameter_words import words_by_name
        from model.reports.fit_report import fit_report
        from model.reports.result_data import FitData, of_fit, overlays
        from model.simulation.prepared import Options
        from server.jobs.results import FitJobResult

        traces, held = self._traces(request.traces), self._traces(request.held_out)
        begin, options = self._model(request.model).with_effects(request.effects), options_of(request, FitOptions)
        found = fit(begin, traces, options, lambda f, text: self._tell(0, FIT_SHARE, f, text), self.mailbox)
        comparison = self._compared(
            [("before", begin), ("fitted", found.model)],
            [*traces, *held],
            request.held_out,
            FIT_SHARE,
            options=Options(loop=options.loop or "closed", quantise=False),
        )
        self._keep_model(found.model)
        data = FitData(
            **dict(found),
            models=comparison.models,
            signals=overlays(comparison.signals),
            undetermined=undetermined_in_words(found.identifiability, words_by_name(found.model.parameters)),
        )
        result = FitJobResult(id=self._job, data=data)
        report = fit_report(found, comparison, base_parameters(found.model, traces))
        return self._done(result, report, of_fit(found, comparison), found.model)

    def validate(self, request: ValidateRequest) -> Ended:
        """Computes the same as `daq validate`."""
        from model.machine_model.parameter_words import words_by_name
        from model.reports.result_data import ValidationData, of_validation, thinned_variation
        from model.reports.validation_report import validation_report
        from model.simulation.prepared import Options
        from model.validation.criterion import in_convention
        from model.validation.expected_deviation import names_to_validate
        from model.validation.fidelity import validate_by_distortion
        from model.validation.time_domain import vary_in_time
        from server.jobs.results import ValidationJobResult

        traces, model = self._traces(request.traces), self._model(request.model)
        names = names_to_validate(model, request.parameters)
        fidelity = validate_by_distortion(
            model,
            traces,
            names,
            outputs=request.joints,
            damping_ratio=request.damping_ratio,
            curve_points=CURVE_POINTS,
            options=Options(quantise=False),
            progress=lambda f, text: self._tell(0, VALIDATION_SHARE, f, text),
            cancel=self.mailbox,
        )
        in_time = []
        for number, trace in enumerate(traces):
            text = f"variation with time, trace {number + 1} of {len(traces)}"
            self._tell(VALIDATION_SHARE, REPORT_SHARE, number / len(traces), text)
            in_time.append(vary_in_time(model, trace, names))
        three = in_convention(fidelity, model, "three_sigma")
        data = ValidationData(
            fidelity=fidelity,
            three_sigma=three.model_copy(update={"curves": ()}),
            time_domain=tuple(thinned_variation(one) for one in in_time),
            words=words_by_name(model.parameters),
        )
        report = validation_report(self._name(request.model), (fidelity, three), in_time, model.machine)
        return self._done(ValidationJobResult(id=self._job, data=data), report, of_validation(fidelity))

    def compare(self, request: CompareRequest) -> Ended:
        """Computes the same as `daq compare`, also for a single model."""
        from model.comparison.agreement import differences
        from model.machine_model.parameter_words import words_by_name
        from model.reports.comparison_report import comparison_report
        from model.reports.result_data import ComparisonData, of_comparison, overlays
        from server.jobs.results import ComparisonJobResult

        models = [self._model(number) for number in request.models]
        traces = self._traces(request.traces)
        fitted = {trace for model in models for trace in model.lineage.traces}
        held = [trace.record.trace_id for trace in traces if trace.record.trace_id not in fitted] if fitted else None
        labels = self._labels(request.models)
        comparison = self._compared(list(zip(labels, models, strict=True)), traces, held, 0.0)
        differing = differences(models)
        data = ComparisonData(
            models=comparison.models,
            signals=overlays(comparison.signals),
            differences=differing,
            words=words_by_name(parameter for model in models for parameter in model.parameters),
        )
        result = ComparisonJobResult(id=self._job, data=data)
        return self._done(result, comparison_report(comparison, differing), of_comparison(comparison))

    def diagnose(self, request: DiagnoseRequest) -> Ended:
        """Computes the same as `daq diagnose`."""
        from daq.plugins import report_sections
        from model.discrepancy.explanation.answer_words import headline
        from model.discrepancy.options import DiagnosisOptions
        from model.discrepancy.workflow import diagnose
        from model.reports.diagnosis_data import leading, told
        from model.reports.page import saved_report
        from server.jobs.next_experiment import experiment_chooser
        from server.jobs.results import DiagnosisJobResult

        traces, held = self._traces(request.traces), self._traces(request.held_out)
        begin = self._model(request.model)
        found = diagnose(
            begin,
            traces,
            held,
            options_of(request, DiagnosisOptions),
            lambda f, text: self._tell(0, DIAGNOSIS_SHARE, f, text),
            self.mailbox,
            chooser=experiment_chooser(begin.machine, design=request.design),
            watch=lambda candidates: self.mailbox.tell_leading(leading(candidates)),
        )
        before = found.model_before
        changed = found.model_after.with_lineage(before.lineage).identity != before.identity
        if changed:
            self._keep_model(found.model_after)
        every = [*traces, *held]
        data = told(
            found,
            begin,
            every,
            lambda pair, of, held_out: self._compared(pair, of, held_out, DIAGNOSIS_SHARE, MAP_SHARE),
            lambda: self.mailbox.report(MAP_SHARE, "locating where the model as given disagrees", at_once=True),
        )
        names = {trace.record.trace_id: _label(trace.record) for trace in every}
        page = saved_report(data, names, report_sections(found, every))
        model = found.model_after if changed else None
        named = {one.effect for step in found.steps if step.adopted for one in step.group or (step,) if one.effect}
        done = self._done(DiagnosisJobResult(id=self._job, data=data), page, headline(found), model)
        return replace(done, effects=tuple(sorted(named)))

    def _compared(
        self,
        models: list[tuple[str, Model]],
        traces: Sequence[Trace],
        held: Sequence[str] | None,
        begin: float,
        end: float = REPORT_SHARE,
        options: Options | None = None,
    ) -> Comparison:
        from model.comparison.compare import compare

        return compare(
            models,
            traces,
            held,
            options=options,
            progress=lambda f, text: self._tell(begin, end, f, text),
            cancel=self.mailbox,
        )

    def _traces(self, numbers: Sequence[str]) -> list[Trace]:
        return [read_trace(self.task.traces[number], self.task.limits) for number in numbers]

    def _model(self, number: str) -> Model:
        from model.machine_model.model import base_model
        from model.machine_model.model_file import load_model

        return base_model(self.task.machine) if number == MACHINE else load_model(self.task.models[number])

    def _name(self, number: str) -> str:
        return self.task.names.get(number, number)

    def _labels(self, numbers: Sequence[str]) -> list[str]:
        """The names of models, with their IDs if the names alone are ambiguous."""
        names = [self._name(number) for number in numbers]
        alike = len(set(names)) < len(names)
        return [
            f"{name} ({number})" if alike or number == MACHINE else name
            for name, number in zip(names, numbers, strict=True)
        ]

    def _tell(self, begin: float, end: float, fraction: float, text: str) -> None:
        """Reports a stage's progress as part of the job's. The end of a stage is left out, since the next stage reports
        its start."""
        if fraction < 1:
            self.mailbox.report(begin + (end - begin) * fraction, text)

    def _keep_model(self, model: Model) -> None:
        self.mailbox.write_text(MODEL, model.model_dump_json(indent=1) + "\n")

    def _done(self, result: JobResult, report: Report | str, headline: str, model: Model | None = None) -> Ended:
        from model.reports.page import html

        self.mailbox.report(REPORT_SHARE, "writing the report", at_once=True)
        self.mailbox.write_text(REPORT, report if isinstance(report, str) else html(report))
        self.mailbox.write_text(RESULT, result.model_dump_json())
        return Ended(model=None if model is None else model.identity, headline=headline)

    @property
    def _job(self) -> str:
        return self.mailbox.folder.name


def _label(record: TraceRecord) -> str:
    """What the page calls a trace, by the service's clock."""
    name = record.trace_id if record.spec is None else record.spec.name or record.spec.trajectory.kind.replace("_", " ")
    return f"{name}, {record.created.astimezone():%d %b %Y, %H:%M:%S}"
