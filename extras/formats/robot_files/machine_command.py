"""`daq machine`: machines from and to the robot formats of others, URDF and MJCF."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts.errors import SpecError
from daq_cli.app.context import JsonOption, console, print_json, printable
from daq_cli.app.output_file import check_folder, replacing
from daq_cli.app.quantities import parse_numbers
from daq_cli.models.model_input import MODEL_HELP, read_model

if TYPE_CHECKING:
    from collections.abc import Callable

    from daq.contracts.machine import Machine
    from model.machine_model.model import Model

app = typer.Typer(add_completion=False, help="Turn URDF into machine files, and models into URDF and MJCF.")

OutputFile = Annotated[
    Path | None, typer.Option("--output", "-o", help="File to write; without it, the text goes to standard output.")
]


@app.command("from-urdf")
def from_urdf(
    urdf: Annotated[Path, typer.Argument(help="The URDF; its meshes are not read.")],
    joints: Annotated[
        str | None, typer.Option(help="Joints that move, such as shoulder,elbow (default: all, if they are one chain).")
    ] = None,
    hold: Annotated[
        str | None, typer.Option(help="Positions of joints that are held, rad or m: wrist=0.5 (default: 0).")
    ] = None,
    tip: Annotated[str | None, typer.Option(help="Link at the end of the arm (default: the last joint's own).")] = None,
    gravity: Annotated[
        str | None, typer.Option(help="x,y,z in the axes of the URDF's root, m/s² (default: the file's, or 0,0,-9.81).")
    ] = None,
    drives: Annotated[
        str | None, typer.Option(help="A machine file whose drives, friction and sensors are taken over, by joint.")
    ] = None,
    ask: Annotated[bool, typer.Option("--ask", help="Ask what is known of every joint's drive and friction.")] = False,
    name: Annotated[str | None, typer.Option(help="Name of the machine (default: the robot's).")] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Machine file to write (default: its name with .toml).")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Make a machine file of a URDF: kinematics, masses, inertias and limits.

    Drives, friction and sensors are not in a URDF: they are asked for, taken from another machine, or assumptions,
    which the file marks. Joints that are not named are held.
    """
    from daq.config.machine_text import machine_text
    from daq.contracts.machine import load_machine
    from extras.formats.robot_files.joint_questions import asked_parts
    from extras.formats.robot_files.machine_of_arm import machine_of_arm
    from extras.formats.robot_files.serial_arm import serial_arm
    from extras.formats.robot_files.urdf_reader import read_urdf

    if output is not None:
        _check_new(output)
    pull = None
    if gravity is not None:
        x, y, z = parse_numbers(gravity, "--gravity", 3)
        pull = (x, y, z)
    other = None if drives is None else load_machine(drives)
    robot = read_urdf(urdf)
    arm = serial_arm(robot, None if joints is None else _names(joints), _held(hold), tip)
    parts = asked_parts(arm.joints) if ask else {}
    machine = machine_of_arm(arm, pull, other, parts, name)
    path = output or Path(f"{machine.name}.toml")
    _check_new(path)
    with replacing(path) as part:
        part.write_text(machine_text(machine), "utf-8")
    if json:
        print_json(
            {"file": path, "machine": machine.name, "joints": [j.name for j in machine.joints], **_told(machine)}
        )
        return
    console().print(printable(machine.notes))
    print(path)


@app.command("to-urdf")
def to_urdf(
    model: Annotated[str, typer.Argument(help=MODEL_HELP)], output: OutputFile = None, json: JsonOption = False
) -> None:
    """Write a machine, or a fitted model with its numbers, as URDF. What a URDF cannot hold is named."""
    from extras.formats.robot_files.urdf_writer import urdf_text

    _write(read_model(model), urdf_text, output, "urdf", json)


@app.command("to-mjcf")
def to_mjcf(
    model: Annotated[str, typer.Argument(help=MODEL_HELP)], output: OutputFile = None, json: JsonOption = False
) -> None:
    """Write a machine, or a fitted model with its numbers, as MJCF for MuJoCo. What MJCF cannot hold is named."""
    from extras.formats.robot_files.mjcf_writer import mjcf_text

    _write(read_model(model), mjcf_text, output, "mjcf", json)


def _write(
    model: Model, writer: Callable[[Model], tuple[str, list[str]]], output: Path | None, kind: str, json: bool
) -> None:
    """Writes a model's text to a file or to standard output."""
    if output is not None:
        check_folder(output, "--output")
        if output.suffix.lower() not in (f".{kind}", ".xml"):
            raise SpecError(f"{output}: name a .{kind} or .xml file")
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


def _told(machine: Machine) -> dict[str, list[str]]:
    return {"notes": machine.notes.split("\n")}


def _check_new(path: Path) -> None:
    check_folder(path, "--output")
    if path.exists():
        raise SpecError(f"{path}: is there already; name another file with -o")


def _names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",")]
    if "" in names:
        raise SpecError(f"--joints {text!r}: write names like shoulder,elbow")
    return names


def _held(text: str | None) -> dict[str, float]:
    """Positions by joint from `wrist=0.5,finger=0.02`."""
    found: dict[str, float] = {}
    for pair in [] if text is None else text.split(","):
        match = re.fullmatch(r"\s*(\S.*?)\s*=\s*(\S+)\s*", pair)
        if match is None:
            raise SpecError(f"--hold {text!r}: write joint=position pairs like wrist=0.5,finger=0.02 (rad or m)")
        found[match[1]] = parse_numbers(match[2], f"--hold {match[1]}", 1)[0]
    return found
