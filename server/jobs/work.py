"""A job as its worker process does it: files in, files out. Runs at the lowest priority, and ends with the service."""

from __future__ import annotations

import os
import threading
from dataclasses import dataclass
from multiprocessing import parent_process
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict

from daq.contracts.errors import DaqError
from daq.contracts.machine import Machine
from daq.contracts.progress import CancelledError
from daq.contracts.service.jobs import (
    MACHINE,
    CompareRequest,
    DiagnoseRequest,
    EffectChoice,
    FitRequest,
    JobRequest,
    ValidateRequest,
)
from daq.traces.reader import read_trace
from server.jobs.mailbox import MODEL, REPORT, REQUEST, RESULT, Mailbox

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daq.contracts.trace import Trace
    from model.comparison.compare import Comparison
    from model.machine_model.model import Model
    from model.reports.page import Report

NICENESS = 19
CURVE_POINTS = 21
FIT_SHARE, VALIDATION_SHARE, DIAGNOSIS_SHARE = 0.9, 0.7, 0.95
"""Of the progress, before comparison and report."""


class Task(BaseModel):
    """What a worker is given: the request, and where everything is that it names."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    request: JobRequest
    machine: Machine
    traces: dict[str, Path]
    models: dict[str, Path]
    names: dict[str, str]
    """Names of models, for tables."""


@dataclass(frozen=True)
class Ended:
    """How a job ended. `problem` is empty when it is done."""

    problem: str = ""
    cancelled: bool = False
    model: str | None = None


def begin_worker() -> None:
    """In every worker process, before its first job."""
    os.nice(NICENESS)
    threading.Thread(target=_end_with_the_service, name="parent-watch", daemon=True).start()


def _end_with_the_service() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def carry_out(folder: Path) -> Ended:
    """Does the job of a folder. Raises nothing that is the user's to see: it is in what is returned."""
    mailbox = Mailbox(folder)
    mailbox.tell(0.0, "reading")
    task = Task.model_validate(mailbox.read(REQUEST))
    try:
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
        """By kind."""
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
        """As `daq fit`."""
        from model.fitting.fit import fit
        from model.fitting.options import FitOptions
        from model.reports.fit_report import fit_report

        traces, held = self._traces(request.traces), self._traces(request.held_out)
        begin = _with_effects(self._model(request.model), request.effects)
        options = FitOptions(
            parameters=request.parameters, held=request.held, bounds=request.bounds, use_priors=request.use_priors,
            method=request.method, starts=request.starts, seed=request.seed, loop=request.loop,
        )  # fmt: skip
        found = fit(begin, traces, options, lambda f, text: self._tell(0, FIT_SHARE, f, text), self.mailbox)
        comparison = self._compared(
            [("before", begin), ("fitted", found.model)], [*traces, *held], request.held_out, FIT_SHARE
        )
        self._keep_model(found.model)
        data = found.model_dump(mode="json", exclude={"covariance"}) | _comparison_data(comparison)
        return self._done(data, fit_report(found, comparison), found.model)

    def validate(self, request: ValidateRequest) -> Ended:
        """As `daq validate`."""
        from model.reports.validation_report import validation_report
        from model.simulation.simulate import Options
        from model.validation.conventions import in_convention
        from model.validation.fidelity import validate_by_distortion
        from model.validation.names import names_to_validate
        from model.validation.time_domain import vary_in_time

        traces, model = self._traces(request.traces), self._model(request.model)
        names = names_to_validate(model, request.parameters)
        fidelity = validate_by_distortion(
            model, traces, names, outputs=request.joints, damping_ratio=request.damping_ratio,
            curve_points=CURVE_POINTS, options=Options(quantise=False),
            progress=lambda f, text: self._tell(0, VALIDATION_SHARE, f, text), cancel=self.mailbox,
        )  # fmt: skip
        in_time = []
        for number, trace in enumerate(traces):
            self._tell(VALIDATION_SHARE, 1, number / len(traces), f"variation with time: {trace.record.trace_id}")
            in_time.append(vary_in_time(model, trace, names))
        three = in_convention(fidelity, model, "three_sigma")
        data = {
            "fidelity": fidelity.model_dump(mode="json"),
            "three_sigma": three.model_dump(mode="json", exclude={"curves"}),
            "time_domain": [one.model_dump(mode="json") for one in in_time],
        }
        return self._done(data, validation_report(self._name(request.model), (fidelity, three), in_time))

    def compare(self, request: CompareRequest) -> Ended:
        """As `daq compare`; also one model beside traces."""
        from model.comparison.difference import differences
        from model.reports.comparison_report import comparison_report

        models = [self._model(number) for number in request.models]
        traces = self._traces(request.traces)
        fitted = {trace for model in models for trace in model.lineage.traces}
        held = [trace.record.trace_id for trace in traces if trace.record.trace_id not in fitted] if fitted else None
        labels = [f"{self._name(number)} ({number})" for number in request.models]
        comparison = self._compared(list(zip(labels, models, strict=True)), traces, held, 0.0)
        differing = differences(models)
        data = _comparison_data(comparison) | {"differences": [one.model_dump(mode="json") for one in differing]}
        return self._done(data, comparison_report(comparison, differing))

    def diagnose(self, request: DiagnoseRequest) -> Ended:
        """As `daq diagnose`."""
        from daq.contracts.machine import NoController
        from model.discrepancy.options import DiagnosisOptions
        from model.discrepancy.workflow import diagnose
        from model.reports.diagnosis_report import LABELS, diagnosis_report

        traces, held = self._traces(request.traces), self._traces(request.held_out)
        options = DiagnosisOptions(effects=request.effects, joints=request.joints, most_steps=request.most_steps)
        found = diagnose(
            self._model(request.model), traces, held, options,
            lambda f, text: self._tell(0, DIAGNOSIS_SHARE, f, text), self.mailbox,
        )  # fmt: skip
        data, comparison = found.model_dump(mode="json"), None
        controlled = not isinstance(found.model_before.machine.controller, NoController)
        if controlled and all(trace.set_point is not None for trace in (*traces, *held)):
            models = list(zip(LABELS, (found.model_before, found.model_after), strict=True))
            comparison = self._compared(models, [*traces, *held], request.held_out, DIAGNOSIS_SHARE)
            data |= _comparison_data(comparison)
        changed = found.model_after.identity != found.model_before.identity
        if changed:
            self._keep_model(found.model_after)
        return self._done(data, diagnosis_report(found, comparison), found.model_after if changed else None)

    def _compared(
        self, models: list[tuple[str, Model]], traces: Sequence[Trace], held: Sequence[str] | None, share: float
    ) -> Comparison:
        from model.comparison.compare import compare

        return compare(
            models, traces, held, progress=lambda f, text: self._tell(share, 1, f, text), cancel=self.mailbox
        )

    def _traces(self, numbers: Sequence[str]) -> list[Trace]:
        return [read_trace(self.task.traces[number]) for number in numbers]

    def _model(self, number: str) -> Model:
        from model.machine_model.model import base_model
        from model.machine_model.model_file import load_model

        return base_model(self.task.machine) if number == MACHINE else load_model(self.task.models[number])

    def _name(self, number: str) -> str:
        return self.task.names.get(number, number)

    def _tell(self, begin: float, end: float, fraction: float, text: str) -> None:
        self.mailbox.tell(begin + (end - begin) * fraction, text)

    def _keep_model(self, model: Model) -> None:
        self.mailbox.write_text(MODEL, model.model_dump_json(indent=1) + "\n")

    def _done(self, data: dict[str, Any], report: Report, model: Model | None = None) -> Ended:
        from model.reports.page import html

        self.mailbox.write_text(REPORT, html(report))
        self.mailbox.write(RESULT, _finite(data))
        return Ended(model=None if model is None else model.identity)


def _with_effects(model: Model, effects: Sequence[EffectChoice]) -> Model:
    from daq.contracts.errors import SpecError
    from model.effects.library import effect, library

    for choice in effects:
        if choice.name not in library():
            raise SpecError(f"effects: {choice.name!r}: not in the library; it has {', '.join(library())}")
        found = effect(choice.name)
        if found.whole_machine:
            model = model.with_effect(choice.name)
        else:
            every = tuple(j for j in model.machine.modelled_joints if not found.joints or j in found.joints)
            model = model.with_effect(choice.name, choice.joints or every)
    return model


def _comparison_data(found: Comparison) -> dict[str, Any]:
    """Agreement in numbers, and the signals for a plot: one row a joint."""
    return {
        "models": [one.model_dump(mode="json") for one in found.models],
        "signals": [
            {
                "trace": one.trace,
                "held_out": one.held_out,
                "joints": one.joints,
                "units": one.units,
                "time": one.time.tolist(),
                "measured": one.measured.T.tolist(),
                "simulated": [simulated.T.tolist() for simulated in one.simulated],
                "set_point": None if one.set_point is None else one.set_point.T.tolist(),
            }
            for one in found.signals
        ],
    }


def _finite(data: Any) -> Any:
    """JSON knows no NaN and no infinity: what has no number is null."""
    if isinstance(data, dict):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    if isinstance(data, float) and not -1e308 < data < 1e308:
        return None
    return data
