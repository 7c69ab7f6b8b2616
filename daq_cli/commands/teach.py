"""`daq teach`: the four ways of teaching of the original (section 6.4), without its limit of 60 s."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from daq.contracts.errors import SafetyError, SpecError
from daq.contracts.limp import require_drive
from daq_cli.app import completion
from daq_cli.app.consent import agreed
from daq_cli.app.context import Invocation, JsonOption, YesOption, console, invocation
from daq_cli.app.quantities import parse_angle, parse_per_joint_angles
from daq_cli.commands import teach_edit, teach_programs

if TYPE_CHECKING:
    from daq.acquisition.owned import OwnedRobot
    from daq.contracts.machine import Machine
    from daq.contracts.sample import SampleRow
    from daq.teaching.controller_arm import ControllerArm
    from daq.teaching.jog import JogCommand
    from daq.teaching.program import Program
    from daq.teaching.program_plan import PlannedInstruction

LONGEST_LEAD = 3600.0
"""s for which an arm may be led in one go: somebody holds it."""
Made = TypeVar("Made")

app = typer.Typer(
    add_completion=False,
    help="Jog, lead by the nose, steps, and playing back. Needs a configured robot, or --port.",
    no_args_is_help=True,
)
app.add_typer(teach_programs.app, name="programs")
app.add_typer(teach_edit.app, name="edit")


@contextmanager
def _owned(call: Invocation, consent: bool, prepare: Callable[[OwnedRobot], Made]) -> Iterator[tuple[OwnedRobot, Made]]:
    """The robot, held by this process. Where a real arm waits for consent and a person can be asked, asks.

    `prepare` looks and checks before anything moves: what it refuses leaves set points and gains as they were.
    """
    from daq.acquisition.owned import owned_robot
    from daq.config.robot_files import load_memory_map
    from daq.runner import Consent, MissingConsentError

    robot, memory_map = call.settings.robot.name, load_memory_map(call.settings.robot.memory_map)
    with ExitStack() as held:
        try:
            owned = held.enter_context(owned_robot(robot, call.port, memory_map, Consent(consent)))
        except MissingConsentError:
            if not agreed(call.port):
                raise
            owned = held.enter_context(owned_robot(robot, call.port, memory_map, Consent(True)))
        try:
            require_drive(owned.controller.gains())
            prepared = prepare(owned)
        except (SafetyError, SpecError):
            held.close()  # without the error, which would freeze the arm
            raise
        yield owned, prepared


def _arm(robot: OwnedRobot, machine: Machine) -> ControllerArm:
    from daq.teaching.controller_arm import ControllerArm

    return ControllerArm(robot.controller, robot.control, machine, robot.ended)


@app.command()
def jog(
    context: typer.Context,
    speed: Annotated[str, typer.Option(help="Degrees/s to begin with, up to 20.")] = "10",
    program: Annotated[Path | None, typer.Option(help="Where postures kept with `p` go (a program, .json).")] = None,
    yes: YesOption = False,
) -> None:
    """Drive joints with the keys, as the teach pendant did; a joint moves only while its key repeats."""
    from daq.teaching import jog as jog_arm
    from daq.teaching.program import Absolute, Program, require_program_file, save_program
    from daq_cli.app.keyboard import keys
    from daq_cli.robot.pendant import HELP, Pendant, StatusLine, require_jog_speed

    call = invocation(context)
    machine = call.machine
    if program is not None:
        require_program_file(program)
    pendant = Pendant(machine, require_jog_speed(parse_angle(speed, "speed")))
    kept: list[Absolute] = []
    line = StatusLine()

    def keep(angles: dict[int, float]) -> None:
        kept.append(Absolute(angles=angles))
        line.tell(f"posture {len(kept)} kept")

    try:
        if call.server is not None:
            from daq_cli.robot.remote.jog import jog_at_server

            jog_at_server(call, pendant, keep, yes, line)
            return
        with keys() as keyboard, _owned(call, yes, lambda robot: _arm(robot, machine)) as (robot, arm):
            line.tell(HELP)

            def commands(row: SampleRow) -> JogCommand | None:
                command = pendant.command(keyboard.pressed(), robot.controller.clock.now())
                if pendant.gripper is not None and robot.ended() is None:
                    robot.controller.set_gripper(closed=pendant.gripper)
                    pendant.gripper = None
                if pendant.keep:
                    pendant.keep = False
                    keep(dict(zip(arm.joints, row.set_point, strict=True)))
                line.show(pendant)
                return command

            jog_arm(arm, machine, machine.limits, commands, lambda: pendant.ended, line.tell)
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
    speed: Annotated[str, typer.Option(help="Degrees/s of the fastest joint.")] = "14",
    yes: YesOption = False,
) -> None:
    """One off-line step, all joints arriving together: to absolute angles, or by relative ones."""
    from pydantic import ValidationError

    from daq.teaching.program import Absolute, Instruction, Program, Relative

    if (to is None) == (by is None):
        raise SpecError("step: give either --to or --by")
    angles = parse_per_joint_angles(to or by or "", "step")
    if not isinstance(angles, dict):
        raise SpecError(f"step {to or by!r}: write joint=angle pairs like 1=180,2=45")
    call = invocation(context)
    kind: type[Absolute | Relative] = Relative if to is None else Absolute
    try:
        instruction: Instruction = kind(angles=angles, speed=parse_angle(speed, "speed"))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise SpecError(f"step: {where} = {first['input']:.5g} rad or rad/s: {first['msg']}") from error
    program = Program(name="step", machine=call.machine.name, instructions=(instruction,))
    _perform(call, program, yes)


@app.command("program")
def run_file(
    context: typer.Context,
    file: Annotated[
        Path, typer.Argument(help="A taught program (.json or .toml), or the name of one that a service keeps.")
    ],
    yes: YesOption = False,
) -> None:
    """Carry out a taught program: steps, paths, waits, process signals."""
    from daq.teaching.program import load_program

    call = invocation(context)
    if call.server is not None and not file.exists():
        from daq_cli.robot.remote.programs import fetched_program

        _perform(call, fetched_program(call, str(file)), yes)
        return
    _perform(call, load_program(file), yes)


def _perform(call: Invocation, program: Program, consent: bool) -> None:
    from daq.teaching.performer import FollowingPerformer
    from daq.teaching.program_plan import check_program, plan_program, run_program

    if call.server is not None:
        from daq_cli.robot.remote.teach import perform_at_server

        perform_at_server(call, program, consent)
        return
    machine = call.settings.machine()

    def checked(robot: OwnedRobot) -> list[PlannedInstruction]:
        here = _arm(robot, machine).next_sample()
        planned = plan_program(program, machine, here.set_point)
        against = check_program(planned, machine, machine.limits)
        if against:
            raise SafetyError(f"program refused: {against[0]}; nothing moved")
        return planned

    with _owned(call, consent, checked) as (robot, planned):
        tell = console().print
        performer = FollowingPerformer(robot.controller, robot.control, machine, machine.limits, robot.ended, tell)
        run_program(planned, machine, performer, tell)
        performer.finish()
    print(f"done: {len(planned)} instructions")


@app.command()
def lead(
    context: typer.Context,
    output: Annotated[Path, typer.Option("--output", "-o", help="Where the recorded path goes (.json).")],
    joints: Annotated[
        str, typer.Option(help="Joints to be led: 1-3, 1,3 or 2.", autocompletion=completion.joints)
    ] = "1-3",
    seconds: Annotated[float | None, typer.Option(help="End by itself after so long; else with Enter.")] = None,
    yes: YesOption = False,
) -> None:
    """Record a path while the arm is led by hand. HOLD THE ARM: the led joints have no drive and may sink."""
    import select
    import sys

    from daq.contracts.experiment import parse_joints
    from daq.teaching import RecordedPath, lead_by_nose
    from daq.teaching.recording import save_path

    if seconds is not None and not 0 < seconds <= LONGEST_LEAD:
        raise SpecError(f"lead: --seconds {seconds:g}: allowed are above 0 to {LONGEST_LEAD:g}")
    if seconds is None and not sys.stdin.isatty():
        raise SpecError("lead: give --seconds, or a terminal in which Enter ends it")
    if not output.name or output.is_dir():
        raise SpecError(f"lead: {str(output)!r}: is no name for a file; nothing was begun")
    if not output.absolute().parent.is_dir():
        raise SpecError(f"lead: {output}: its folder does not exist; nothing was begun")
    led = parse_joints(joints)
    call = invocation(context)

    def keep(path: RecordedPath) -> None:
        save_path(path, output)
        print(f"{output}: {path.duration:.2f} s on joints {', '.join(map(str, path.joints))}")

    if call.server is not None:
        from daq_cli.robot.remote.teach import lead_at_server

        lead_at_server(call, led, seconds, keep, yes)
        return
    machine = call.settings.machine()
    with _owned(call, yes, lambda robot: _arm(robot, machine)) as (robot, arm):
        begun = robot.controller.clock.now()

        def ended() -> bool:
            if seconds is not None:
                return robot.controller.clock.now() - begun >= seconds
            return bool(select.select([sys.stdin], [], [], 0)[0])

        console().print("recording: lead the arm" + ("; Enter ends it" if seconds is None else f" for {seconds:g} s"))
        lead_by_nose(arm, machine, machine.limits, led, ended, keep)


@app.command()
def play(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="A path recorded by `daq teach lead`.")],
    rate: Annotated[float, typer.Option(help="How many times as fast as it was led.")] = 1.0,
    folder: Annotated[Path | None, typer.Option(help="Where the trace goes (default: configured folder).")] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Check and show the motion; connect to nothing.")] = False,
    yes: YesOption = False,
    json: JsonOption = False,
) -> None:
    """Play a recorded path: checked, watched and recorded like any experiment."""
    from pydantic import ValidationError

    from daq.contracts.documents import read_text
    from daq.teaching import RecordedPath, playback
    from daq_cli.robot.run_result import carry_out

    try:
        path = RecordedPath.model_validate_json(read_text(file, f"path {file}"))
    except ValidationError as error:
        raise SpecError(f"path {file}: {error.errors()[0]['msg']}") from error
    spec = playback(path, rate, "playback")
    carry_out(invocation(context), spec, folder=folder, dry_run=dry_run, consent=yes, as_json=json)
