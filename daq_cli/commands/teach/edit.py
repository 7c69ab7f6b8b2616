"""`daq teach edit`: changes a taught program off line. Nothing moves; a refused change leaves the file as it was."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daq.contracts.errors import SafetyError, SpecError
from daq_cli.app.context import JsonOption, invocation, print_json, printable
from daq_cli.app.quantities import parse_angle, parse_per_joint_angles, require_units
from firmware_protocol.invalid import first_invalid

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from daq.teaching.program import Instruction, Program

app = typer.Typer(add_completion=False, help="Change a taught program: nothing moves.", no_args_is_help=True)

FileArgument = Annotated[Path, typer.Argument(help="A taught program, a .json file.")]
NumberArgument = Annotated[int, typer.Argument(help="Number of the instruction, as `list` shows it.")]
ToOption = Annotated[str | None, typer.Option(help="Absolute angles, such as 1=180,2=45 (degrees).")]
ByOption = Annotated[str | None, typer.Option(help="Relative angles, such as 2=-5 (degrees).")]
SpeedOption = Annotated[str | None, typer.Option(help="Speed of the fastest joint in degrees/s.")]
WaitOption = Annotated[float | None, typer.Option(help="Pause in s.")]
OutputOption = Annotated[str | None, typer.Option(help="A process output to switch: 3=on or 3=off.")]
GripperOption = Annotated[str | None, typer.Option(help="Move the gripper: open or close.")]


@app.command("list")
def list_all(file: FileArgument, json: JsonOption = False) -> None:
    """Show the program's instructions by number."""
    from daq.teaching.program import load_program

    program = load_program(file)
    if json:
        print_json({"file": file, **program.model_dump(mode="json")})
        return
    print(printable(f"{program.name}, for {program.machine}: {len(program.instructions)} instructions"))
    for number, one in enumerate(program.instructions, start=1):
        print(f"{number:4d}  {_in_words(one)}")


@app.command()
def delete(context: typer.Context, file: FileArgument, number: NumberArgument) -> None:
    """Remove an instruction."""
    from daq.teaching import editing

    _edit(context, file, lambda program: editing.delete(program, number))


@app.command()
def insert(
    context: typer.Context,
    file: FileArgument,
    number: NumberArgument,
    to: ToOption = None,
    by: ByOption = None,
    speed: SpeedOption = None,
    wait: WaitOption = None,
    output: OutputOption = None,
    input_: Annotated[str | None, typer.Option("--input", help="A process input to wait for: 3=on or 3=off.")] = None,
    gripper: GripperOption = None,
) -> None:
    """Insert an instruction at this number; the following ones move back by one."""
    from daq.teaching import editing

    made = _instruction(to=to, by=by, speed=speed, wait=wait, output=output, awaited=input_, gripper=gripper)
    typed = {} if to is None and by is None else _angles(to or by or "")
    _edit(context, file, lambda program: editing.insert(program, number, made), _Typed(number, typed, speed))


@app.command()
def move(
    context: typer.Context,
    file: FileArgument,
    number: NumberArgument,
    place: Annotated[int, typer.Argument(help="Its new number.")],
) -> None:
    """Move an instruction to another place."""
    from daq.teaching import editing

    _edit(context, file, lambda program: editing.move(program, number, place))


@app.command()
def change(
    context: typer.Context,
    file: FileArgument,
    number: NumberArgument,
    angles: Annotated[
        str | None, typer.Option(help="Angles of a step, such as 2=45; other joints keep theirs.")
    ] = None,
    speed: SpeedOption = None,
    wait: WaitOption = None,
    rate: Annotated[
        float | None, typer.Option(help="Speed of a path, as a multiple of that at which it was led.")
    ] = None,
    longest: Annotated[float | None, typer.Option(help="Time in s after which waiting for an input fails.")] = None,
) -> None:
    """Change speed, posture, pause or rate of an instruction."""
    from daq.teaching import editing

    fields: dict[str, Any] = {"duration": wait, "rate": rate, "longest": longest}
    fields["angles"] = None if angles is None else _angles(angles)
    fields["speed"] = None if speed is None else _speed(speed)
    given = {name: value for name, value in fields.items() if value is not None}
    if not given:
        raise SpecError("change: nothing to change: give --angles, --speed, --wait, --rate or --longest")
    typed = _Typed(number, fields["angles"] or {}, speed)
    _edit(context, file, lambda program: editing.change(program, number, given), typed)


@app.command()
def rename(
    context: typer.Context, file: FileArgument, name: Annotated[str, typer.Argument(help="The program's new name.")]
) -> None:
    """Give the program another name; the file keeps its own."""
    from daq.teaching import editing

    _edit(context, file, lambda program: editing.rename(program, name))


@dataclass(frozen=True)
class _Typed:
    """What was typed for an instruction: angles and a speed, whose units must be those of its joints."""

    number: int
    angles: dict[int, float]
    speed: str | None

    def check(self, program: Program, machine: Machine) -> None:
        """Raises SpecError where a length was typed for a joint that turns, or an angle for one that slides."""
        require_units("angles", self.angles, machine, tuple(self.angles))
        if self.speed is not None:
            joints = tuple(getattr(program.instructions[self.number - 1], "angles", ()))
            require_units("speed", _speed(self.speed), machine, joints)


def _edit(context: typer.Context, file: Path, edited: Any, typed: _Typed | None = None) -> None:
    """Reads, changes, checks and writes a program. Raises SpecError, SafetyError, and leaves the file as it was
    then."""
    from daq.config.settings import load_settings
    from daq.teaching.editing import new_violations
    from daq.teaching.program import load_program, save_program

    if file.suffix == ".toml":
        raise SpecError(f"program {file}: is TOML, and its comments would be lost; edit it as text")
    before = load_program(file)
    after: Program = edited(before)
    machine = load_settings(invocation(context).config_file)[0].machine()
    if typed is not None:
        typed.check(after, machine)
    against = new_violations(before, after, machine)
    if against:
        raise SafetyError(f"program {file}: refused: {against[0]}; the file is as it was")
    save_program(after, file)
    print(printable(f"{file}: {len(after.instructions)} instructions"))


def _instruction(
    *,
    to: str | None,
    by: str | None,
    speed: str | None,
    wait: float | None,
    output: str | None,
    awaited: str | None,
    gripper: str | None,
) -> Instruction:
    """Returns the instruction that the options name. Raises SpecError for none, several, or wrong values."""
    from pydantic import TypeAdapter, ValidationError

    from daq.teaching.program import Instruction

    given = {"to": to, "by": by, "wait": wait, "output": output, "input": awaited, "gripper": gripper}
    named = [name for name, value in given.items() if value is not None]
    if len(named) != 1:
        raise SpecError(f"insert: give one of {', '.join('--' + name for name in given)}; {len(named)} are given")
    if speed is not None and named[0] not in ("to", "by"):
        raise SpecError(f"insert: --speed goes with --to and --by, not with --{named[0]}")
    data: dict[str, Any]
    if to is not None or by is not None:
        data = {"kind": "absolute" if by is None else "relative", "angles": _angles(to or by or "")}
        data |= {} if speed is None else {"speed": _speed(speed)}
    elif wait is not None:
        data = {"kind": "wait", "duration": wait}
    elif gripper is not None:
        if gripper not in ("open", "close"):
            raise SpecError(f"gripper {gripper!r}: allowed are open and close")
        data = {"kind": "gripper", "closed": gripper == "close"}
    else:
        line, _, state = (output or awaited or "").partition("=")
        if not line.isdecimal() or state not in ("on", "off"):
            raise SpecError(f"{named[0]} {output or awaited!r}: write a line and its state like 3=on")
        data = {"kind": named[0], "line": line, "on": state == "on"}
    try:
        made: Instruction = TypeAdapter(Instruction).validate_python(data)
    except ValidationError as error:
        first = first_invalid(error)
        raise SpecError(f"insert: {'.'.join(map(str, first.place[1:]))}: {first.message}") from error
    return made


def _speed(text: str) -> float:
    return parse_angle(text.removesuffix("/s"), "speed")


def _angles(text: str) -> dict[int, float]:
    angles = parse_per_joint_angles(text, "angles")
    if not isinstance(angles, dict):
        raise SpecError(f"angles {text!r}: write joint=angle pairs like 1=180,2=45")
    return angles


def _in_words(one: Instruction) -> str:
    from math import degrees

    from daq.teaching.program import Absolute, AwaitInput, Gripper, PlayPath, Relative, SetOutput

    match one:
        case Absolute() | Relative():
            steps = ", ".join(f"{joint}={degrees(angle):.2f}°" for joint, angle in sorted(one.angles.items()))
            return f"{'to' if isinstance(one, Absolute) else 'by'} {steps} at {degrees(one.speed):.1f} °/s"
        case PlayPath():
            joints = ", ".join(map(str, one.path.joints))
            return f"path of {one.path.duration:.2f} s on joints {joints}, {one.rate:g} times as fast"
        case SetOutput():
            return f"output {one.line} {'on' if one.on else 'off'}"
        case AwaitInput():
            return f"wait for input {one.line} {'on' if one.on else 'off'}, {one.longest:g} s at most"
        case Gripper():
            return f"gripper {'close' if one.closed else 'open'}"
    return f"wait {one.duration:g} s"
