"""`daq diagnose`: finds where traces and a model disagree, what is missing, and which experiment to run next."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daq.contracts import exit_codes
from daq.contracts.errors import SpecError
from daq.contracts.machine import NoController
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import JsonOption, YesOption, console, print_json
from daq_cli.app.output_file import check_folder, replacing
from daq_cli.models.model_input import (
    MODEL_HELP,
    CandidatesOption,
    Comparison,
    ComparisonOption,
    EffectFileOption,
    ExaminedOption,
    JudgedByOption,
    MostOption,
    OutOption,
    ReportOption,
    TraceFolderOption,
    TracesArgument,
    check_made_for,
    files_of,
    load_effects,
    machine_of,
    read_model,
    read_traces,
)
from daq_cli.models.record_doubts import DespiteDoubtsOption, end_if_doubted, say_what_is_lacking
from daq_cli.models.service_jobs import NamedTraces, service_jobs
from daq_cli.robot.access import robot_of
from daq_cli.robot.operations import RobotAccess

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daq.contracts.errors import DaqError
    from daq.contracts.trace import Trace
    from model.discrepancy.diagnosis import Diagnosis
    from model.discrepancy.experiment_design.next_experiment import ExperimentChooser
    from model.discrepancy.options import DiagnosisOptions
    from model.machine_model.model import Model

app = typer.Typer(add_completion=False)


def _spec_file(path: Path | None) -> Path | None:
    """Rejects an unsuitable or unwritable file before the computation."""
    if path is not None:
        if path.suffix != ".json":
            raise SpecError(f"--next {path}: an experiment is written as .json")
        check_folder(path, "--next")
    return path


@app.command()
def diagnose(
    context: typer.Context,
    traces: TracesArgument,
    model: Annotated[
        str | None, typer.Option(help=f"The model to examine (default: the traces' machine). {MODEL_HELP}")
    ] = None,
    holdout: JudgedByOption = None,
    effects: CandidatesOption = None,
    joints: ExaminedOption = None,
    load: Annotated[float | None, typer.Option(min=0.0, help="Load that the arm carried, in kg.")] = None,
    most: MostOption = None,
    method: ComparisonOption = None,
    out: Annotated[Path | None, OutOption] = None,
    report: ReportOption = None,
    folder: TraceFolderOption = None,
    effect_file: EffectFileOption = None,
    acquire: Annotated[
        bool, typer.Option("--acquire", help="Run the experiment that the diagnosis asks for, and diagnose again.")
    ] = False,
    budget: Annotated[float, typer.Option(min=1.0, max=3600.0, help="Robot time for --acquire in s.")] = 60.0,
    next_file: Annotated[
        Path | None,
        typer.Option(
            "--next",
            callback=_spec_file,
            help="Write the experiment asked for here (.json, for `daq run spec`).",
        ),
    ] = None,
    design: Annotated[
        bool,
        typer.Option("--design", help="Search for a motion of its own to ask for; it takes some 10 s more."),
    ] = False,
    despite_doubts: DespiteDoubtsOption = False,
    yes: YesOption = False,
    json: JsonOption = False,
) -> None:
    """Find where a model and traces disagree, name the missing effect, add it, and show how the gap shrinks."""
    from daq_cli.app.progress import shown_progress
    from daq_cli.models.acquire_loop import diagnose_and_acquire
    from model.discrepancy.workflow import diagnose as run_diagnosis
    from server.jobs.next_experiment import experiment_chooser

    robot = robot_of(context)
    load_effects(effect_file, robot)
    options = _options(effects, joints, most, method).model_copy(update={"despite_doubts": despite_doubts})
    fitted_to = read_traces(robot, folder, traces)
    held = read_traces(robot, folder, holdout) if holdout else []
    begin = _beginning(robot, fitted_to, traces, model, load)
    simulated = not isinstance(begin.machine.controller, NoController) and all(
        t.set_point is not None for t in fitted_to
    )
    if method is None and (acquire or next_file is not None) and simulated:
        # only this method proposes experiments
        options = options.model_copy(update={"method": Comparison.OUTPUT_ERROR.value})
    if not json:
        say_what_is_lacking(begin, [*fitted_to, *held])
    check_made_for(begin.machine, [*fitted_to, *held], [*traces, *(holdout or [])])
    failure: DaqError | None = None

    def once(traces: Sequence[Trace], chooser: ExperimentChooser) -> Diagnosis:
        with shown_progress("diagnosing") as progress:
            return run_diagnosis(begin, traces, held, options, progress, chooser=chooser)

    if not acquire and (jobs := service_jobs(robot)) is not None:
        named, held_out = NamedTraces(traces, fitted_to), NamedTraces(holdout or [], held)
        found = jobs.diagnose(begin, named, held_out, options, out, report, design=design)
        _save(found, out, next_file)
        _print_result(found, out, None, next_file, as_json=json)
        end_if_doubted(found.record)
        return
    if acquire:
        ended = diagnose_and_acquire(
            robot, begin.machine, fitted_to, folder, budget, ConsentPrompt(yes), once, design=design
        )
        found, fitted_to, failure = ended.found, ended.traces, ended.failure
    else:
        found = once(fitted_to, experiment_chooser(begin.machine, design=design))
    _save(found, out, next_file)
    page = None if report is None else _written(found, begin, [*fitted_to, *held], report)
    _print_result(found, out, page, next_file, as_json=json)
    if failure is not None:
        raise failure
    end_if_doubted(found.record)
    if found.acquired and (outcome := found.acquired[-1].outcome) != "complete":
        raise typer.Exit(exit_codes.OF_OUTCOME[outcome])


def _save(found: Diagnosis, out: Path | None, next_file: Path | None) -> None:
    """Writes the model and the proposed experiment, if requested, before the report, which may fail."""
    from model.machine_model.model_file import save_model

    if out is not None and found.computed:
        with replacing(out) as part:
            save_model(found.model_after, part)
    if next_file is not None and found.next_experiment is not None:
        with replacing(next_file) as part:
            part.write_text(found.next_experiment.spec.model_dump_json(indent=1) + "\n", "utf-8")


def _print_result(
    found: Diagnosis, out: Path | None, page: Path | None, next_file: Path | None, *, as_json: bool
) -> None:
    """Prints the answer and the files of the model, the experiment and the report."""
    from daq_cli.models.diagnosis_text import answer_text

    if as_json:
        print_json(found.model_dump(mode="json"))
    else:
        print(answer_text(found))
    if out is not None and not found.computed:
        console().print(f"no model is written to {out}: check the record first")
    elif out is not None:
        console().print(f"model {found.model_after.identity}: {out}")
    if next_file is not None:
        asked = found.next_experiment is not None
        console().print(f"daq run spec {next_file}" if asked else f"no experiment is asked for: no {next_file}")
    if page is not None:
        console().print(f"report: {page}")


def _options(effects: str | None, joints: str | None, most: int | None, method: Comparison | None) -> DiagnosisOptions:
    from daq.contracts.experiment import parse_joints
    from daq_cli.models.effect_choice import effect_names
    from model.discrepancy.options import DiagnosisOptions

    names = None if effects is None else effect_names(effects)
    chosen = None if joints is None else tuple(parse_joints(joints))
    given: dict[str, Any] = {} if most is None else {"most_steps": most}
    return DiagnosisOptions(effects=names, joints=chosen, method=None if method is None else method.value, **given)


def _beginning(
    robot: RobotAccess, traces: Sequence[Trace], names: Sequence[str], model: str | None, load: float | None
) -> Model:
    """Returns the model to examine, with the load that the arm carried. `names`: the traces on the command line."""
    from model.discrepancy.carried_load import with_load
    from model.machine_model.model import base_model

    begin = base_model(machine_of(traces, robot, names)) if model is None else read_model(model)
    return begin if load is None else with_load(begin, load)


def _written(found: Diagnosis, begin: Model, traces: Sequence[Trace], path: Path) -> Path:
    """Writes the report, with the models before and after on every trace if these can be simulated."""
    from daq.plugins import report_sections
    from model.reports.diagnosis_data import told
    from model.reports.page import saved_report, write_page

    page = saved_report(told(found, begin, traces), files_of(traces), report_sections(found, traces))
    return write_page(page, path)
