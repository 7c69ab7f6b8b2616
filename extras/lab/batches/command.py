"""`daq batch`: the same fit, validation, simulation or diagnosis of many traces, with a table as result.

It runs a batch on this computer's cores, and shows its progress.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts import exit_codes
from daq_cli.app import completion
from daq_cli.app.context import JsonOption, console, print_json, printable
from daq_cli.commands.fit import (
    BoundOption,
    ConsistentOption,
    HoldOption,
    MethodOption,
    NoPriorsOption,
    OpenLoopOption,
    ParametersOption,
    SeedOption,
)
from daq_cli.commands.simulate import NoRoundingOption
from daq_cli.models.model_input import (
    MODEL_HELP,
    CandidatesOption,
    ComparisonOption,
    EffectFileOption,
    ExaminedOption,
    MostOption,
    load_effects,
    read_model,
)
from daq_cli.models.record_doubts import DespiteDoubtsOption
from daq_cli.robot.access import robot_of
from daq_cli.robot.operations import RobotAccess

if TYPE_CHECKING:
    from daq.traces.query import TraceQuery
    from extras.lab.batches.folder import Row
    from extras.lab.batches.run import Chosen, Standing, Told
    from extras.lab.batches.study import Common, Study


TELL_EVERY = 10.0
"""Time (s) between two lines of progress if standard error is no terminal."""


@dataclass(frozen=True)
class Asked:
    """A batch as the command line requests it. `traces`: a folder, or a query for the configured one."""

    traces: str
    out: Path
    workers: int | None
    model: str | None
    effect_files: Sequence[Path]
    as_json: bool


def run(robot: RobotAccess, asked: Asked, study: Study) -> bool:
    """Runs a batch and prints its results. Returns whether every trace is done."""
    from daq.executors import LocalWorkers, cores
    from daq.executors.local import ending
    from extras.lab.batches.folder import asked_of, opened
    from extras.lab.batches.run import run_batch

    common, chosen = _common(robot, asked, study), _chosen(robot, asked.traces)
    with opened(asked.out, asked_of(common)) as folder:
        if all(folder.is_done(one.job.key) for one in chosen):
            folder.write_tables()
            _print_end(asked, len(chosen), 0, 0.0)
            return True
        with ending(LocalWorkers(asked.workers or cores())) as workers, shown(study.kind) as tell:
            ended = run_batch(folder, common, chosen, workers, tell)
    _print_end(asked, ended.before + ended.done, ended.failed, ended.seconds)
    return not ended.failed


def _common(robot: RobotAccess, asked: Asked, study: Study) -> Common:
    from extras.lab.batches.study import Common

    load_effects(asked.effect_files, robot)
    return Common(
        study=study,
        model=None if asked.model is None else read_model(asked.model).model_dump_json(),
        machine=robot.machine,
        limits=robot.call.trace_limits,
        effect_files=tuple(file.absolute() for file in asked.effect_files),
    )


def _chosen(robot: RobotAccess, text: str) -> list[Chosen]:
    from extras.lab.batches.run import chosen_traces, require_any

    folder, query = place_and_query(text)
    summaries, place = robot.list_traces(folder)
    chosen, remarks = chosen_traces(summaries, query)
    for remark in remarks:
        console().print(printable(remark))
    require_any(chosen, place)
    return chosen


def place_and_query(text: str) -> tuple[Path | None, TraceQuery]:
    """Returns the folder that a text names, or None and a query. Raises SpecError."""
    from daq.contracts.errors import SpecError
    from daq.traces.query import TraceQuery, parse_query

    if Path(text).is_dir():
        return Path(text), TraceQuery()
    if "/" in text or Path(text).exists():
        raise SpecError(f"{text}: is no folder of traces; name one, or write a query such as 'ramp since:2026-11-01'")
    return None, parse_query(text)


@contextmanager
def shown(what: str) -> Iterator[Told]:
    """Shows a batch's progress: at a terminal a bar with rate and remaining time, elsewhere occasional lines.

    Each failure is reported in one line.
    """
    with _bar(what) if console().is_terminal else _lines() as progress:

        def tell(standing: Standing, row: Row | None) -> None:
            if row is not None and row.problem:
                file = str(row.about.get("file") or row.key)
                console().print(printable(row.problem if file in row.problem else f"{file}: {row.problem}"))
            progress(standing)

        yield tell


@contextmanager
def _bar(what: str) -> Iterator[Callable[[Standing], None]]:
    from rich.progress import BarColumn, Progress, TextColumn

    description, text = (TextColumn(field, markup=False) for field in ("{task.description}", "{task.fields[text]}"))
    columns = (description, BarColumn(), text)
    with Progress(*columns, console=console(), transient=True) as bar:
        task = bar.add_task(what, text="")

        def progress(standing: Standing) -> None:
            bar.update(task, total=standing.total, completed=standing.total - standing.left, text=str(standing))

        yield progress


@contextmanager
def _lines() -> Iterator[Callable[[Standing], None]]:
    told = time.monotonic()

    def progress(standing: Standing) -> None:
        nonlocal told
        if time.monotonic() - told >= TELL_EVERY:
            told = time.monotonic()
            console().print(str(standing))

    yield progress


def _print_end(asked: Asked, done: int, failed: int, seconds: float) -> None:
    from extras.lab.batches.folder import CSV, PARQUET

    tables = [asked.out / CSV, asked.out / PARQUET]
    written = [file for file in tables if file.exists()]
    if asked.as_json:
        print_json(
            {"folder": asked.out, "done": done, "failed": failed, "tables": written, "seconds": round(seconds, 3)}
        )
        return
    print(f"{done} of {done + failed} traces done, in {seconds:.1f} s: {' and '.join(map(str, written))}")
    if len(written) < len(tables):
        console().print("no Parquet: needs `pip install 'ma2000-daq[tables]'` in daq's environment")
    if failed:
        console().print(f"{failed} failed; the same command tries them again")


app = typer.Typer(
    add_completion=False,
    help="Study many traces, each separately, with a table as result. The same command continues an interrupted batch.",
    no_args_is_help=True,
)

TracesOf = Annotated[
    str,
    typer.Argument(
        metavar="FOLDER|QUERY",
        help="A folder of traces; or a query for the configured folder: words, and kind:, source:, outcome:, robot:, "
        "since:, until:.",
    ),
]
WorkersOption = Annotated[
    int | None, typer.Option("--workers", min=1, max=1024, help="Number of processes (default: one per core).")
]
OutOption = Annotated[
    Path, typer.Option("--out", "-o", help="Folder of the result; an unfinished batch in it is continued.")
]
ModelOption = Annotated[
    str | None, typer.Option(help=f"The model of all traces (default: the machine of each). {MODEL_HELP}")
]


@app.command()
def fit(
    context: typer.Context,
    traces: TracesOf,
    out: OutOption,
    workers: WorkersOption = None,
    model: ModelOption = None,
    effects: Annotated[
        str | None,
        typer.Option(
            help="Effects to add to the model before it is fitted, such as backlash:2-3.",
            autocompletion=completion.effects,
        ),
    ] = None,
    effect_file: EffectFileOption = None,
    parameters: ParametersOption = None,
    hold: HoldOption = None,
    bound: BoundOption = None,
    no_priors: NoPriorsOption = False,
    method: MethodOption = "least_squares",
    starts: Annotated[int, typer.Option(min=1, max=20, help="Number of fits from different starting values.")] = 1,
    seed: SeedOption = 0,
    open_loop: OpenLoopOption = False,
    consistent_inertias: ConsistentOption = False,
    json: JsonOption = False,
) -> None:
    """Fit a model to every trace separately: one row of parameters and errors per trace."""
    from daq.contracts.service.jobs import FitStudy
    from daq_cli.models.effect_choice import bounds, effect_choices, patterns

    study = FitStudy(
        effects=effect_choices(effects, effect_file),
        parameters=patterns(parameters),
        held=patterns(hold) or (),
        bounds=bounds(bound or []),
        use_priors=not no_priors,
        method=method,
        starts=starts,
        seed=seed,
        loop="open" if open_loop else None,
        consistent_inertias=consistent_inertias,
    )
    _run(context, Asked(traces, out, workers, model, effect_file or (), json), study)


@app.command()
def validate(
    context: typer.Context,
    traces: TracesOf,
    out: OutOption,
    workers: WorkersOption = None,
    model: ModelOption = None,
    effect_file: EffectFileOption = None,
    parameters: Annotated[
        str | None, typer.Option(help="Names or patterns (default: those that were fitted, else all uncertain).")
    ] = None,
    output: Annotated[
        list[int] | None, typer.Option("--joint", min=1, help="Joints whose errors count (default: all).")
    ] = None,
    damping_ratio: Annotated[
        float, typer.Option(min=0.001, max=10.0, help="ζ of the associate system (section 7.2.2).")
    ] = 0.5,
    json: JsonOption = False,
) -> None:
    """Validate a model against every trace separately (Σλ²): one row per trace."""
    from daq.contracts.service.jobs import ValidateStudy
    from daq_cli.models.effect_choice import patterns

    joints = None if output is None else tuple(output)
    study = ValidateStudy(parameters=patterns(parameters), joints=joints, damping_ratio=damping_ratio)
    _run(context, Asked(traces, out, workers, model, effect_file or (), json), study)


@app.command()
def simulate(
    context: typer.Context,
    traces: TracesOf,
    out: OutOption,
    workers: WorkersOption = None,
    model: ModelOption = None,
    effect_file: EffectFileOption = None,
    open_loop: OpenLoopOption = False,
    no_rounding: NoRoundingOption = False,
    json: JsonOption = False,
) -> None:
    """Simulate every trace and compare it with the measurement: one row of errors per trace."""
    from extras.lab.batches.study import SimulateStudy

    study = SimulateStudy(loop="open" if open_loop else "closed", quantise=not no_rounding)
    _run(context, Asked(traces, out, workers, model, effect_file or (), json), study)


@app.command()
def diagnose(
    context: typer.Context,
    traces: TracesOf,
    out: OutOption,
    workers: WorkersOption = None,
    model: ModelOption = None,
    effect_file: EffectFileOption = None,
    effects: CandidatesOption = None,
    joints: ExaminedOption = None,
    most: MostOption = None,
    method: ComparisonOption = None,
    despite_doubts: DespiteDoubtsOption = False,
    json: JsonOption = False,
) -> None:
    """Diagnose every trace separately: one row with verdict, effects and errors per trace."""
    from daq.contracts.experiment import parse_joints
    from daq.contracts.service.jobs import DiagnoseStudy
    from daq_cli.models.effect_choice import candidate_effects

    names = candidate_effects(effects, effect_file)
    chosen = None if joints is None else tuple(parse_joints(joints))
    study = DiagnoseStudy(
        effects=names,
        joints=chosen,
        most_steps=most,
        method=None if method is None else method.value,
        despite_doubts=despite_doubts,
    )
    _run(context, Asked(traces, out, workers, model, effect_file or (), json), study)


def _run(context: typer.Context, asked: Asked, study: Study) -> None:
    if not run(robot_of(context), asked, study):
        raise typer.Exit(exit_codes.FAULT)
