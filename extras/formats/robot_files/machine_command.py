"""`daq machine`: new machine files, tidied ones, and machines in the robot formats of others, URDF and MJCF."""

from __future__ import annotations

import re
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts.errors import SpecError
from daq_cli.app.context import JsonOption, console, print_json, printable
from daq_cli.app.output_file import check_folder, replacing
from daq_cli.app.quantities import parse_numbers
from daq_cli.models.model_input import MODEL_HELP, TraceFolderOption, TracesArgument, read_model

if TYPE_CHECKING:
    from collections.abc import Callable

    from daq.contracts.machine import Machine
    from daq.contracts.trace import Trace
    from extras.formats.robot_files.new_machine import Described
    from model.machine_model.model import Model

app = typer.Typer(add_completion=False, help="Write machine files, and models as URDF and MJCF.")

OutputFile = Annotated[
    Path | None, typer.Option("--output", "-o", help="File to write; without it, the text goes to standard output.")
]


@app.command("new")
def new(
    context: typer.Context,
    name: Annotated[str | None, typer.Argument(help="Name of the machine (default: the robot's of the URDF).")] = None,
    urdf: Annotated[Path | None, typer.Option(help="A URDF of the robot; its meshes are not read.")] = None,
    drives: Annotated[
        str | None,
        typer.Option(
            help="Drives, one for all joints or one per joint: names of `daq machine drives`, or torques per unit "
            "of the record (0.5 N·m/A). Or a machine file with drives, friction and sensors, matched by joint name."
        ),
    ] = None,
    record: Annotated[
        str | None, typer.Option(help="A record of the robot: gives joints and unit of the drive, and is checked.")
    ] = None,
    joints: Annotated[
        str | None, typer.Option(help="Joints that move, such as shoulder,elbow (default: all, if they are one chain).")
    ] = None,
    hold: Annotated[
        str | None, typer.Option(help="Positions of joints that are held, rad or m: wrist=0.5 (default: 0).")
    ] = None,
    tip: Annotated[str | None, typer.Option(help="Link at the end of the arm (default: the last joint's own).")] = None,
    gravity: Annotated[
        str | None,
        typer.Option(
            help="x,y,z in m/s² (default: 0,0,-9.81), in the axes of the URDF's root; without one, z is the first axis."
        ),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Machine file to write (default: its name with .toml).")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Write a machine file, from a URDF, from names of servos, or from answers to a few questions.

    Unknown values are assumptions, marked in the file. The command ends with the three values that would improve
    answers most.
    """
    from daq.contracts.machine import load_machine, parse_machine
    from daq_cli.models.model_input import read_traces
    from daq_cli.robot.access import robot_of

    if output is not None:
        _check_new(output)
    trace = None if record is None else read_traces(robot_of(context), None, [record])[0]
    if urdf is None:
        if name is None:
            raise SpecError("give a name, or --urdf and a file")
        text = _described(name, drives, joints, _pull(gravity), trace)
    else:
        text = _of_urdf(urdf, joints, hold, tip, _pull(gravity), drives, name, trace)
    machine = parse_machine(text, "new machine")
    path = output or Path(f"{machine.name}.toml")
    _check_new(path)
    with replacing(path) as part:
        part.write_text(text, "utf-8")
    _tell(load_machine(str(path)), path, trace, json)


def _pull(gravity: str | None) -> tuple[float, float, float] | None:
    if gravity is None:
        return None
    x, y, z = parse_numbers(gravity, "--gravity", 3)
    return x, y, z


def _described(
    name: str,
    drives: str | None,
    joints: str | None,
    gravity: tuple[float, float, float] | None,
    trace: Trace | None,
) -> str:
    """Returns the text of a machine that is described by names of drives, or by answers."""
    from extras.formats.robot_files.new_machine import Described, check_drive, text_of

    unit = "V" if trace is None else trace.record.drive_unit or "V"
    given = [] if drives is None else [check_drive(one.strip()) for one in drives.split(",")]
    if joints is not None:
        names = _names(joints)
    elif trace is not None:
        names = list(trace.record.joint_names) or [f"joint_{joint}" for joint in trace.joints]
    else:
        told = str(len(given)) if given else _asked("How many joints, or their names?", "1", bool, "pan,tilt or 2")
        names = [f"joint_{k + 1}" for k in range(int(told))] if told.isdecimal() else _names(told)
    if len(given) not in (0, 1, len(names)):
        raise SpecError(f"--drives names {len(given)}, but there are {len(names)} joints")
    if given:
        each = given * len(names) if len(given) == 1 else given
        return text_of(name, [Described(one, drive) for one, drive in zip(names, each, strict=True)], unit, gravity)
    console().print("Enter accepts the value in brackets, or leaves a value unknown.")
    return text_of(name, [_joint_told(one, last=one == names[-1]) for one in names], unit, gravity)


def _joint_told(name: str, *, last: bool) -> Described:
    from extras.formats.robot_files.new_machine import GUESSED, Described

    drive = _drive_told(name)
    mass = _asked(f"{name}: mass of its link [{GUESSED['mass']}]", GUESSED["mass"], _is_of("kg"), "a mass like 0.8 kg")
    length = _asked(
        f"{name}: length {'of the link' if last else 'to the next axis'} [{GUESSED['length']}]",
        GUESSED["length"],
        _is_of("m"),
        "a length like 160 mm",
    )
    if last:
        return Described(name, drive, mass, length)
    axis = _asked(
        f"{name}: is the next axis parallel or crossed? [parallel]",
        "parallel",
        ("parallel", "crossed").__contains__,
        "parallel or crossed",
    )
    return Described(name, drive, mass, length, "crossed" if axis == "crossed" else "parallel")


def _drive_told(name: str, slides: bool = False) -> str:
    from extras.formats.robot_files.new_machine import check_drive

    def is_drive(text: str) -> bool:
        check_drive(text, slides)
        return True

    return _asked(f"{name}: its servo or motor, or torque per unit of drive (0.5 N·m/A) []", "", is_drive, "a drive")


def _is_of(unit: str) -> Callable[[str], bool]:
    from daq.contracts.written_numbers import read_number

    def suits(text: str) -> bool:
        read_number(text, "", (unit,))
        return True

    return suits


def _asked(question: str, default: str, suits: Callable[[str], bool], wanted: str) -> str:
    while True:
        answer = str(typer.prompt(question, default=default, show_default=False, err=True)).strip()
        try:
            if answer == default or suits(answer):
                return answer
            console().print(f"{answer!r}: answer {wanted}")
        except (SpecError, ValueError) as error:
            console().print(printable(str(error)))


def _of_urdf(
    urdf: Path,
    joints: str | None,
    hold: str | None,
    tip: str | None,
    pull: tuple[float, float, float] | None,
    drives: str | None,
    name: str | None,
    trace: Trace | None,
) -> str:
    """Returns the text of the machine that a URDF describes, with drives from elsewhere."""
    from daq.config.machine_text import machine_text
    from daq.contracts.drive_library import library_drives
    from daq.contracts.machine import load_machine
    from extras.formats.robot_files.machine_of_arm import machine_of_arm
    from extras.formats.robot_files.new_machine import check_drive, parts_of, with_gains_of_record
    from extras.formats.robot_files.serial_arm import serial_arm
    from extras.formats.robot_files.urdf_reader import read_urdf

    given = [] if drives is None else [one.strip() for one in drives.split(",")]
    other = load_machine(given[0]) if len(given) == 1 and not _is_drive(given[0]) else None
    robot = read_urdf(urdf)
    arm = serial_arm(robot, None if joints is None else _names(joints), _held(hold), tip)
    names = [joint.joint.name for joint in arm.joints]
    slides = {joint.joint.name: joint.joint.kind == "prismatic" for joint in arm.joints}
    told: dict[str, str] = {}
    if given and other is None:
        if len(given) not in (1, len(names)):
            raise SpecError(f"--drives names {len(given)}, but there are {len(names)} joints")
        each = given * len(names) if len(given) == 1 else given
        told = {one: check_drive(drive, slides[one]) for one, drive in zip(names, each, strict=True)}
    machine = machine_of_arm(arm, pull, other, parts_of(told, slides), name)
    if trace is not None:
        machine = with_gains_of_record(machine, trace)
    library = {k: told[one] for k, one in enumerate(names, 1) if told.get(one) in library_drives()}
    return machine_text(machine, drives=library)


def _is_drive(text: str) -> bool:
    from daq.contracts.drive_library import library_drives
    from daq.contracts.written_numbers import is_number

    return text in library_drives() or is_number(text)


def _tell(machine: Machine, path: Path, trace: Trace | None, json: bool) -> None:
    """Prints the assumptions in a new file, the check of a record, and the most important values."""
    from daq.contracts.machine_form import defaults_of
    from daq_cli.models.record_doubts import end_if_doubted, print_record
    from extras.formats.robot_files.uncertain_numbers import most_uncertain
    from model.machine_model.model import base_model
    from model.record_check.check import check_records

    model = base_model(machine)
    found = [] if trace is None else check_records(model, [trace])
    moved = trace if trace is not None and trace.drive is not None else None
    sharpest = most_uncertain(model, moved)[:3]
    defaults = list(defaults_of(machine))
    notes = [line for line in machine.notes.split("\n") if line]
    if json:
        print_json(
            {
                "file": path,
                "machine": machine.name,
                "joints": [j.name for j in machine.joints],
                "notes": notes,
                "defaults": defaults,
                "sharpest": [{"name": one.parameter.name, "share": one.share} for one in sharpest],
                "record": [finding.model_dump(mode="json") for finding in found],
            }
        )
        return
    for line in notes:
        console().print(printable(line))
    if defaults:
        console().print(f"Left at defaults: {', '.join(defaults)}.")
    if found:
        print_record(found)
    if sharpest:
        console().print("Measure first, because their deviations change the torques most:")
        for number, share in sharpest:
            stated = f"{number.value:.3g} ± {number.deviation:.2g} {number.unit}"
            console().print(f"  {number.name} = {stated}: {100 * share:.0f} %")
    print(path)
    end_if_doubted(found)


@app.command("tidy")
def tidy(
    file: Annotated[Path, typer.Argument(help="A machine file (.toml), in any form.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write (default: the file itself).")
    ] = None,
) -> None:
    """Write a machine file in the short form: quantities as texts, sources as comments, defaults left out.

    Parts that are short already stay as they are, and so do comments. A file with such parts alone is not written.
    """
    from daq.config.tidied_machine import tidied
    from daq.contracts.documents import read_text

    given = read_text(file, f"machine file {file}")
    text = tidied(given, str(file))
    path = output or file
    check_folder(path, "--output")
    if text == given:
        console().print(f"{file}: nothing in it gets shorter")
        if output is None:
            return
    with replacing(path) as part:
        part.write_text(text, "utf-8")
    print(path)


@app.command("drives")
def drives(
    search: Annotated[str, typer.Argument(help="Part of a name.")] = "",
    json: JsonOption = False,
) -> None:
    """List the servos and motors that a machine file can name: `drive = "feetech/sts3215-7.4V"`."""
    from daq.contracts.drive_library import library_drives

    found = [one for one in library_drives().values() if search.lower() in f"{one.name} {one.title}".lower()]
    if not found:
        raise SpecError(f"no drive has {search!r} in its name; `daq machine drives` lists all")
    if json:
        print_json([{"name": one.name, "title": one.title, **one.parts} for one in found])
        return
    width = max(len(one.name) for one in found)
    for one in found:
        print(f"{one.name:{width}}  {printable(one.title)}")
        if len(found) == 1:
            for part, numbers in one.parts.items():
                print("\n".join(f"  {part}.{name} = {number}" for name, number in numbers.items()))


@app.command("to-urdf")
def to_urdf(
    model: Annotated[str, typer.Argument(help=MODEL_HELP)], output: OutputFile = None, json: JsonOption = False
) -> None:
    """Write a machine, or a fitted model with its values, as URDF. Prints the parts that a URDF cannot hold."""
    from extras.formats.robot_files.urdf_writer import urdf_text

    _write(read_model(model), urdf_text, output, "urdf", json)


@app.command("to-mjcf")
def to_mjcf(
    model: Annotated[str, typer.Argument(help=MODEL_HELP)], output: OutputFile = None, json: JsonOption = False
) -> None:
    """Write a machine, or a fitted model with its values, as MJCF for MuJoCo. Prints the parts that MJCF cannot
    hold."""
    from extras.formats.robot_files.mjcf_writer import mjcf_text

    _write(read_model(model), mjcf_text, output, "mjcf", json)


class Form(StrEnum):
    """A program whose actuators are written."""

    MJLAB = "mjlab"
    ISAACLAB = "isaaclab"
    BAM = "bam"


@app.command("to-actuators")
def to_actuators(
    model: Annotated[str, typer.Argument(help=MODEL_HELP)],
    form: Annotated[Form, typer.Option("--for", help="The program.")],
    joint: Annotated[int | None, typer.Option(min=1, help="Of BAM: the joint; its file has one.")] = None,
    actuator: Annotated[str | None, typer.Option(help="Of BAM: its name of the actuator, such as sts3215.")] = None,
    output: OutputFile = None,
    json: JsonOption = False,
) -> None:
    """Write a model's drives, friction and position loops as actuators of mjlab, Isaac Lab or BAM."""
    from extras.formats.robot_files.actuator_configs import actuator_text

    suffix = "json" if form is Form.BAM else "py"
    _write(read_model(model), lambda one: actuator_text(one, form.value, joint, actuator), output, suffix, json)


@app.command("replay")
def replay_command(
    context: typer.Context,
    model: Annotated[str, typer.Argument(help=f"The model to be judged. {MODEL_HELP}")],
    traces: TracesArgument,
    before: Annotated[str | None, typer.Option(help="Compare it with this one (default: its machine alone).")] = None,
    folder: TraceFolderOption = None,
    json: JsonOption = False,
) -> None:
    """Replay recorded drives in MuJoCo with two models: a second opinion, which shares no code with our simulation."""
    from dataclasses import asdict

    from daq_cli.models.model_input import read_traces
    from daq_cli.robot.access import robot_of
    from extras.formats.robot_files.replay import replay
    from extras.formats.robot_files.replay_section import replay_table
    from model.machine_model.model import base_model

    after = read_model(model)
    other = base_model(after.machine) if before is None else read_model(before)
    made = replay(other, after, read_traces(robot_of(context), folder, traces))
    if json:
        print_json({name: list(value) for name, value in asdict(made).items()})
        return
    table = replay_table([("all", made)])
    print(f"{printable(str(table))}\n{printable(table.caption)}")


def _write(
    model: Model, writer: Callable[[Model], tuple[str, list[str]]], output: Path | None, kind: str, json: bool
) -> None:
    """Writes a model's text to a file or to standard output."""
    if output is not None:
        check_folder(output, "--output")
        allowed = (f".{kind}", ".xml") if kind in ("urdf", "mjcf") else (f".{kind}",)
        if output.suffix.lower() not in allowed:
            raise SpecError(f"{output}: name a {' or '.join(allowed)} file")
    text, left_out = writer(model)
    if output is not None:
        with replacing(output) as part:
            part.write_text(text, "utf-8")
    if json:
        print_json({"file": output, kind: None if output else text, "left_out": left_out})
        return
    if left_out:
        console().print(f"left out: {printable('; '.join(left_out))}")
    print(output if output is not None else text, end="\n" if output is not None else "")


def _check_new(path: Path) -> None:
    check_folder(path, "--output")
    if path.exists():
        raise SpecError(f"{path}: already exists; name another file with -o")


def _names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",")]
    if "" in names:
        raise SpecError(f"--joints {text!r}: write names like shoulder,elbow")
    return names


def _held(text: str | None) -> dict[str, float]:
    """Returns positions by joint from `wrist=0.5,finger=0.02`."""
    found: dict[str, float] = {}
    for pair in [] if text is None else text.split(","):
        match = re.fullmatch(r"\s*(\S.*?)\s*=\s*(\S+)\s*", pair)
        if match is None:
            raise SpecError(f"--hold {text!r}: write joint=position pairs like wrist=0.5,finger=0.02 (rad or m)")
        found[match[1]] = parse_numbers(match[2], f"--hold {match[1]}", 1)[0]
    return found
