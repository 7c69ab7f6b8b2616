"""`daq traces`: lists, shows, plots, converts and verifies traces."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts import exit_codes
from daq.contracts.errors import SpecError
from daq.contracts.import_choice import Choice
from daq_cli.app import completion
from daq_cli.app.context import JsonOption, console, print_json, print_prose, print_table, printable
from daq_cli.robot.access import robot_of

if TYPE_CHECKING:
    from daq.contracts.trace import Trace, TraceRecord
    from daq.traces.salvage import Salvaged
    from daq_cli.robot.operations import RobotAccess

app = typer.Typer(add_completion=False, help="List, show, plot, convert and verify traces.", no_args_is_help=True)

TraceArgument = Annotated[
    str,
    typer.Argument(
        help="A file, the beginning of a trace's number or name, or `last`.", autocompletion=completion.traces
    ),
]
FolderOption = Annotated[Path | None, typer.Option(help="Folder of traces (default: the configured one).")]


def _path(context: typer.Context, wanted: str, folder: Path | None) -> Path:
    robot = robot_of(context)
    return robot.find_trace(folder or robot.call.trace_folder, wanted)


def _read(context: typer.Context, wanted: str, folder: Path | None) -> tuple[Path, Trace]:
    from daq.traces.files import open_trace

    path = _path(context, wanted, folder)
    return path, open_trace(path, robot_of(context).call.trace_limits)


@app.command("ls")
def list_all(
    context: typer.Context,
    place: Annotated[Path | None, typer.Argument(metavar="FOLDER", help="Folder of traces, as --folder.")] = None,
    folder: FolderOption = None,
    json: JsonOption = False,
) -> None:
    """List traces, the oldest first."""
    if place is not None and folder is not None:
        raise SpecError("--folder: the folder is named already; leave one of them out")
    robot = robot_of(context)
    if place is not None:
        robot.require_local(f"{place}: a service lists its own traces; leave the folder or --server out")
        if not place.is_dir():
            raise SpecError(f"{place}: is no folder; `daq traces show` takes a trace")
    summaries, where = robot.list_traces(place or folder)
    if json:
        print_json([summary.model_dump(mode="json") for summary in summaries])
        return
    if not summaries:
        print(printable(f"no traces in {where}"))
        return
    from rich.table import Table
    from rich.text import Text

    from daq.traces.naming import ID_DIGITS

    table = Table(box=None, header_style="bold")
    for title in ("number", "recorded (UTC)", "what", "joints", "samples", "s", "outcome"):
        table.add_column(title, no_wrap=True)
    for one in summaries:
        moment = one.created.strftime("%Y-%m-%d %H:%M") if one.created else "?"
        ended = one.outcome or one.state
        table.add_row(
            printable((one.trace_id or one.path.name)[:ID_DIGITS]),
            moment,
            printable(f"{one.name or one.kind or one.source or one.problem}"),
            joints_text(one.joints if one.moved is None else one.moved),
            "?" if one.samples is None else str(one.samples),
            "?" if one.duration is None else f"{one.duration:.2f}",
            Text(ended, "green" if ended == "complete" else "bold red"),
        )
    print_table(table)


def joints_text(joints: tuple[int, ...]) -> str:
    """Formats joints as `1-3` if they are consecutive, else as `1,3`."""
    if len(joints) > 1 and joints == tuple(range(joints[0], joints[-1] + 1)):
        return f"{joints[0]}-{joints[-1]}"
    return ",".join(map(str, joints))


@app.command()
def show(
    context: typer.Context, trace: TraceArgument = "last", folder: FolderOption = None, json: JsonOption = False
) -> None:
    """Show a trace's record, and its figures by joint."""
    from daq.traces.summary import joint_figures
    from daq_cli.robot.seen import print_figures

    path, found = _read(context, trace, folder)
    figures = joint_figures(found)
    if json:
        data = found.record.model_dump(mode="json", exclude={"machine", "memory_map"})
        joints = [figure.model_dump() for figure in figures]
        print_json(
            {
                "path": path,
                "record": data,
                "samples": len(found),
                "missing": None if found.tick is None else found.missing,
                "joints": joints,
            }
        )
        return
    record = found.record
    where = f"{record.source} record of {record.robot}"
    if record.spec is not None:
        where = f"{record.spec.trajectory.kind} on {record.robot} ({record.source})"
    print(printable(f"{record.trace_id}: {where}, {_ended(record)}"))
    print(printable(f"recorded {record.created:%Y-%m-%d %H:%M:%S %Z} with {record.software}"))
    print(f"{len(found)} samples on joints {', '.join(map(str, found.joints))}, {found.missing_text}")
    if record.operator or record.notes:
        print(printable(f"operator {record.operator or '?'}: {record.notes}"))
    print_figures(found)
    for event in found.events:
        print(printable(f"  {event.time:8.2f} s  {event.kind.replace('_', ' ')}: {event.message}"))
    print(printable(f"file: {path}"))


def _ended(record: TraceRecord) -> str:
    return record.outcome or ("outcome not stated" if record.source == "imported" else "unfinished")


@app.command()
def plot(
    context: typer.Context,
    trace: TraceArgument = "last",
    output: Annotated[Path | None, typer.Option("--output", "-o", help="A .png, .svg, .pdf or .html file.")] = None,
    folder: FolderOption = None,
    json: JsonOption = False,
) -> None:
    """Plot a trace: set point and position, error and drive of every joint."""
    from daq.traces.plot import plot_trace

    path, found = _read(context, trace, folder)
    _print_file(path, plot_trace(found, output or path.with_suffix(".png")), as_json=json)


@app.command("export")
def export(
    context: typer.Context,
    trace: TraceArgument = "last",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="A .csv file (a .toml is put beside it), .parquet or .nc.")
    ] = None,
    folder: FolderOption = None,
    json: JsonOption = False,
) -> None:
    """Write a trace as plain CSV, with a TOML file for the data that have no column, or as Parquet or netCDF."""
    from daq.traces.tables import NETCDF, PARQUET, export_table
    from daq_cli.app.csv_output import write_csv

    path, found = _read(context, trace, folder)
    write = export_table if output is not None and output.suffix.lower() in (PARQUET, NETCDF) else write_csv
    if output is None and path.suffix.lower() == ".csv":
        raise SpecError(f"{path}: is CSV already; name the file to write with -o")
    _print_file(path, write(found, output or path.with_suffix(".csv")), as_json=json)


def _print_file(made_from: Path, file: Path, *, as_json: bool) -> None:
    if as_json:
        print_json({"trace": made_from, "file": file})
    else:
        print(printable(str(file)))


@app.command("import")
def import_(
    context: typer.Context,
    file: Annotated[
        Path,
        typer.Argument(
            help="CSV or other text with columns, Parquet, a data set of lerobot, .mat, .npz, .json, or a bag of ROS. "
            "A .toml of its name says what these cannot: drive_unit, machine, robot."
        ),
    ],
    mapping: Annotated[
        list[str] | None,
        typer.Option(
            "--map",
            metavar="SIGNAL=COLUMNS",
            help="What a signal is: position='q{} in deg', drive='0.5*current{} in A', time='stamp in ms'. "
            "May be repeated; it is kept in the .toml.",
        ),
    ] = None,
    where: Annotated[
        str | None, typer.Option(help="The rows to take: episode_index=3, time=2..10 (s), or all.")
    ] = None,
    as_guessed: Annotated[bool, typer.Option("--as-guessed", help="Take columns as their names let guess.")] = False,
    topic: Annotated[str | None, typer.Option(help="Of a bag: the topic of the joints.")] = None,
    set_points: Annotated[str | None, typer.Option(help="Of a bag: the topic of the set points.")] = None,
    joints: Annotated[str | None, typer.Option(help="Names of joints to take, separated by commas.")] = None,
    received: Annotated[bool, typer.Option("--received", help="Of a bag: the times of reception.")] = False,
    drive_unit: Annotated[
        str | None,
        typer.Option(help="Unit of the drive or effort: V, A, mA, Nm, N and so on; `none` leaves it out."),
    ] = None,
    folder: FolderOption = None,
    json: JsonOption = False,
) -> None:
    """Import a trace of another rig or tool."""
    robot = robot_of(context)
    names = None if joints is None else tuple(name.strip() for name in joints.split(","))
    choice = Choice(topic, set_points, names, received, drive_unit, _mapping(mapping or []), where, as_guessed)
    made = robot.import_trace(file, folder, choice)
    if json:
        print_json({"trace": made.trace, "made_from": file, "file": made.file, "server": robot.call.server})
    else:
        print(made.text)
        if made.notes:
            typer.echo(printable(made.notes), err=True)
        if robot.call.server is None:
            _print_imported(robot, Path(made.file))
    if choice != Choice():
        from daq.traces.description import remember

        kept = remember(file, choice, made.columns)
        again = "" if choice.where is None else "; --where all reads all rows again"
        typer.echo(printable(f"kept in {kept}: the file is read so from now on{again}"), err=True)


def _mapping(texts: list[str]) -> dict[str, str]:
    """Returns the mapping of each signal. Raises SpecError."""
    pairs = [text.partition("=") for text in texts]
    for signal, _, columns in pairs:
        if not columns.strip():
            raise SpecError(f"--map {signal}: write SIGNAL=COLUMNS, such as position='q{{}} in deg'")
    return {signal.strip(): columns.strip() for signal, _, columns in pairs}


def _print_imported(robot: RobotAccess, file: Path) -> None:
    """Prints what was read, doubts of the record check, and the next command, as remarks."""
    from daq.traces.files import open_trace

    trace = open_trace(file, robot.call.trace_limits)
    joints = "joint" if len(trace.joints) == 1 else "joints"
    columns = ["position", *(name.replace("_", " ") for name in ("set_point", "velocity") if _has(trace, name))]
    columns += [f"drive ({trace.drive_unit})"] if _has(trace, "drive") else []
    length = float(trace.time[-1] - trace.time[0])
    said = f"read: {len(trace)} samples of {joints} {', '.join(map(str, trace.joints))} over {length:.2f} s"
    typer.echo(printable(f"{said}: {', '.join(columns)}"), err=True)
    for signal, text in trace.record.columns.items():
        typer.echo(printable(f"  {signal} = {text}"), err=True)
    if trace.record.joint_names:
        named = zip(trace.joints, trace.record.joint_names, strict=True)
        typer.echo(printable(f"  joints {', '.join(f'{number} {name}' for number, name in named)}"), err=True)
    configured = "machine" in robot.call.settings.robot.model_fields_set
    machine = trace.record.machine or (robot.machine if configured else None)
    if machine is None or max(trace.joints) > len(machine.joints):
        why = "names no machine" if machine is None else f"has more joints than {machine.name}"
        typer.echo(printable(f"not checked: it {why}\nnext: daq check {file} --model MACHINE.toml"), err=True)
        return
    try:
        from model.machine_model.model import base_model
        from model.record_check.check import check_records
        from model.record_check.finding import doubts_in, lines_of
    except ImportError:  # a plain installation reads traces but computes nothing
        return
    doubts = lines_of(doubts_in(check_records(base_model(machine), [trace])))
    for line in doubts or ["no doubts"]:
        print_prose(line, "CHECK  " if doubts else "check: ", err=True)
    typer.echo(printable(f"next: daq {'check' if doubts else 'diagnose'} {file}"), err=True)


def _has(trace: Trace, signal: str) -> bool:
    return getattr(trace, signal) is not None


@app.command("verify")
def check(
    context: typer.Context, trace: TraceArgument = "last", folder: FolderOption = None, json: JsonOption = False
) -> None:
    """Check a trace, from its checksums to its signals. The exit code is 5 if it cannot be trusted."""
    from daq.traces.verify import verify

    found = verify(_path(context, trace, folder), robot_of(context).call.trace_limits)
    if json:
        print_json(found.model_dump(mode="json") | {"trustworthy": found.trustworthy})
    else:
        for finding in found.findings:
            print(printable(f"{finding.level}: {finding.message}"))
        print("trustworthy" if found.trustworthy else "NOT trustworthy")
    if not found.trustworthy:
        raise typer.Exit(exit_codes.FAULT)


@app.command()
def salvage(context: typer.Context, folder: FolderOption = None, json: JsonOption = False) -> None:
    """Finish the traces that a crash left unfinished; they are marked as interrupted."""
    from daq.traces.salvage import salvage_folder

    robot = robot_of(context)
    robot.require_local("--server: `daq traces salvage` is for this computer's traces; a service salvages its own")
    results = salvage_folder(folder or robot.call.trace_folder, robot.call.trace_limits)
    if json:
        print_json([vars(result) for result in results])
        return
    for result in results:
        print(printable(_salvage_line(result)))
    if not results:
        console().print("nothing to salvage")
    if any(result.path is None for result in results):
        raise typer.Exit(exit_codes.FAULT)


def _salvage_line(result: Salvaged) -> str:
    if result.path is None:
        return f"{result.part}: {result.problem}"
    line = f"{result.path}: salvaged from {result.part.name}"
    if result.kept is None:
        return line
    if result.dropped_bytes == 0:
        return f"{line}; data of another program are in {result.kept.name}"
    return f"{line} up to its damage; the {result.dropped_bytes} bytes after it are in {result.kept.name}"
