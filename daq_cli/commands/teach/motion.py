"""`daq teach`: the four ways of teaching of the original controller (section 6.4), without its limit of 60 s."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts.errors import SafetyError, SpecError
from daq_cli.app import completion
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import JsonOption, YesOption, print_json, printable
from daq_cli.app.quantities import parse_angle, parse_per_joint_angles, require_units
from daq_cli.commands.teach import programs
from daq_cli.robot.access import robot_of
from firmware_protocol.invalid import first_invalid

if TYPE_CHECKING:
    from daq.teaching.program import Instruction

LONGEST_LEAD = 3600.0
"""Longest hand guiding (s), because a person has to hold the arm."""

app = typer.Typer(
    add_completion=False,
    help="Jog the arm, lead it by hand, make steps, and play back. Needs a configured robot, or --port.",
    no_args_is_help=True,
)
app.add_typer(programs.app, name="programs")


@app.command()
def jog(
    context: typer.Context,
    speed: Annotated[str, typer.Option(help="Speed to begin with, up to 20 degrees/s.")] = "10",
    program: Annotated[
        Path | None, typer.Option(help="File for the postures that `p` saves (a program, .json).")
    ] = None,
    yes: YesOption = False,
) -> None:
    """Drive joints with the keys, as the teach pendant did; a joint moves only while its key repeats."""
    from daq.teaching.program import Absolute, Program, require_program_file, save_program
    from daq.trajectories.move import slow_speeds
    from daq_cli.robot.pendant import Pendant, StatusLine, require_jog_speed

    robot = robot_of(context)
    machine = robot.machine
    if program is not None:
        require_program_file(program)
    pendant = Pendant(machine, require_jog_speed(parse_angle(speed, "speed")))
    kept: list[Absolute] = []
    line = StatusLine()

    def keep(angles: Mapping[int, float]) -> None:
        kept.append(Absolute(angles=dict(angles), speed=float(slow_speeds(machine, tuple(angles)).min())))
        line.tell(f"posture {len(kept)} kept")

    try:
        robot.teaching(ConsentPrompt(yes)).jog(pendant, keep, line)
    finally:
        line.close()
        if program is not None and kept:
            save_program(Program(name=program.stem, machine=machine.name, instructions=tuple(kept)), program)
            print(program)


@app.command()
def step(
    context: typer.Context,
    to: Annotated[str | None, typer.Option(help="Absolute angles, such as 1=180,2=45 (degrees).")] = None,
    by: Annotated[str | None, typer.Option(help="Relative angles, such as 2=-5 (degrees).")] = None,
    speed: Annotated[str, typer.Option(help="Speed of the fastest joint in degrees/s.")] = "14",
    yes: YesOption = False,
) -> None:
    """Make one off-line step, to absolute angles or by relative ones; all joints arrive together."""
    from pydantic import ValidationError

    from daq.teaching.program import Absolute, Program, Relative

    if (to is None) == (by is None):
        raise SpecError("step: give either --to or --by")
    angles = parse_per_joint_angles(to or by or "", "step")
    if not isinstance(angles, dict):
        raise SpecError(f"step {to or by!r}: write joint=angle pairs like 1=180,2=45")
    robot = robot_of(context)
    kind: type[Absolute | Relative] = Relative if to is None else Absolute
    require_units("step", angles, robot.machine, tuple(angles))
    pace = parse_angle(speed.removesuffix("/s"), "speed")
    require_units("speed", pace, robot.machine, tuple(angles))
    try:
        instruction: Instruction = kind(angles=angles, speed=pace)
    except ValidationError as error:
        first = first_invalid(error)
        raise SpecError(f"step: {first.where()} = {first.value:.5g} rad or rad/s: {first.message}") from error
    program = Program(name="step", machine=robot.machine.name, instructions=(instruction,))
    print(robot.teaching(ConsentPrompt(yes)).perform(program))


@app.command("program")
def run_file(
    context: typer.Context,
    file: Annotated[
        Path, typer.Argument(help="A taught program (.json or .toml), or the name of one that a service keeps.")
    ],
    yes: YesOption = False,
) -> None:
    """Carry out a taught program: steps, paths, waits, process signals."""
    robot = robot_of(context)
    program = robot.program(file)
    print(robot.teaching(ConsentPrompt(yes)).perform(program))


@app.command()
def show(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="A taught program (.json or .toml).")],
    json: JsonOption = False,
) -> None:
    """Show a program's instructions, and check it: planned from the rest posture, it must stay within the limits."""
    from daq.teaching.program import load_program
    from daq.teaching.program_plan import check_program, plan_program

    program, machine = load_program(file), robot_of(context).machine
    if json:
        print_json({"file": file, **program.model_dump(mode="json")})
    else:
        print(printable(f"{program.name}, for {program.machine}: {len(program.instructions)} instructions"))
        for number, one in enumerate(program.instructions, start=1):
            print(f"{number:4d}  {_in_words(one)}")
    if machine.rest_posture is None:
        raise SpecError(f"machine {machine.name}: it has no rest_posture to plan from")
    if against := check_program(plan_program(program, machine, machine.rest_posture), machine, machine.limits):
        raise SafetyError(f"program {file}: {against[0]}")


@app.command()
def lead(
    context: typer.Context,
    output: Annotated[Path, typer.Option("--output", "-o", help="File for the recorded path (.json).")],
    joints: Annotated[
        str, typer.Option(help="Joints to be led: 1-3, 1,3 or 2.", autocompletion=completion.joints)
    ] = "1-3",
    seconds: Annotated[
        float | None, typer.Option(help="Length of the recording in s (default: until Enter is pressed).")
    ] = None,
    yes: YesOption = False,
) -> None:
    """Record a path while the arm is guided by hand. HOLD THE ARM: the guided joints have no drive and may sink."""
    import sys

    from daq.contracts.experiment import parse_joints
    from daq.teaching.recording import RecordedPath, save_path

    if seconds is not None and not 0 < seconds <= LONGEST_LEAD:
        raise SpecError(f"lead: --seconds {seconds:g}: allowed are above 0 to {LONGEST_LEAD:g}")
    if seconds is None and not sys.stdin.isatty():
        raise SpecError("lead: give --seconds, or a terminal in which Enter ends it")
    if not output.name or output.is_dir():
        raise SpecError(f"lead: {str(output)!r}: cannot be the name of a file; nothing was begun")
    if not output.absolute().parent.is_dir():
        raise SpecError(f"lead: {output}: its folder does not exist; nothing was begun")
    led = parse_joints(joints)

    def keep(path: RecordedPath) -> None:
        save_path(path, output)
        print(f"{output}: {path.duration:.2f} s on joints {', '.join(map(str, path.joints))}")

    robot_of(context).teaching(ConsentPrompt(yes)).lead(led, seconds, keep)


@app.command()
def play(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="A path recorded by `daq teach lead`.")],
    rate: Annotated[float, typer.Option(help="Speed of the path, as a multiple of that at which it was led.")] = 1.0,
    folder: Annotated[Path | None, typer.Option(help="Folder for the trace (default: the configured one).")] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only check and show the motion; connect to nothing.")
    ] = False,
    yes: YesOption = False,
    json: JsonOption = False,
) -> None:
    """Play a recorded path: checked, guarded and recorded like any experiment."""
    from pydantic import ValidationError

    from daq.contracts.documents import read_text
    from daq.teaching.recording import RecordedPath, playback
    from daq_cli.robot.experiment import RunOptions, carry_out

    try:
        path = RecordedPath.model_validate_json(read_text(file, f"path {file}"))
    except ValidationError as error:
        raise SpecError(f"path {file}: {first_invalid(error).message}") from error
    spec = playback(path, rate, "playback")
    carry_out(robot_of(context), spec, RunOptions(folder, dry_run, yes, json))


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
