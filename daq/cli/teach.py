"""`daq teach`: the four ways of teaching of the original (section 6.4), without its limit of 60 s."""

from __future__ import annotations

import math
import time
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daq.cli.context import Invocation, JsonOption, YesOption, console, invocation
from daq.cli.quantities import parse_angle, parse_per_joint_angles
from daq.contracts.errors import SafetyError, SpecError

if TYPE_CHECKING:
    from daq.acquisition.owned import OwnedRobot
    from daq.teaching.jog import JogCommand

app = typer.Typer(
    add_completion=False,
    help="Jog, lead by the nose, steps, and playing back. Needs a configured robot, or --port.",
    no_args_is_help=True,
)
HELP = "1-6 joint   ← → drive while held   + - speed   o c gripper   p keep this posture   q end   Ctrl-C stop"


def _owned(call: Invocation, consent: bool) -> AbstractContextManager[OwnedRobot]:
    from daq.acquisition.owned import owned_robot
    from daq.config.robot_files import load_memory_map
    from daq.runner import Consent

    memory_map = load_memory_map(call.settings.robot.memory_map)
    return owned_robot(call.settings.robot.name, call.port, memory_map, Consent(consent))


@app.command()
def jog(
    context: typer.Context,
    speed: Annotated[str, typer.Option(help="Degrees/s to begin with.")] = "10",
    program: Annotated[Path | None, typer.Option(help="Where postures kept with `p` go (a program, .json).")] = None,
    yes: YesOption = False,
) -> None:
    """Drive joints with the keys, as the teach pendant did; a joint moves only while its key repeats."""
    from daq.cli.keyboard import keys
    from daq.teaching import jog as jog_arm
    from daq.teaching.controller_arm import ControllerArm
    from daq.teaching.program import Absolute, Program, save_program

    call = invocation(context)
    machine = call.settings.machine()
    kept: list[Absolute] = []
    with _owned(call, yes) as robot, keys() as keyboard:
        arm = ControllerArm(robot.controller, machine)
        pendant = Pendant(parse_angle(speed, "speed"))
        console().print(HELP)

        def commands() -> JogCommand | None:
            command = pendant.command(keyboard.pressed())
            if pendant.gripper is not None:
                robot.controller.set_gripper(closed=pendant.gripper)
                pendant.gripper = None
            if pendant.keep:
                pendant.keep = False
                row = arm.next_sample()
                kept.append(Absolute(angles=dict(zip(arm.joints, row.set_point, strict=True))))
                console().print(f"posture {len(kept)} kept")
            return command

        reason = jog_arm(
            arm, machine, machine.limits, commands, lambda: pendant.ended or robot.ended() is not None, console().print
        )
    if program is not None and kept:
        save_program(Program(name=program.stem, machine=machine.name, instructions=tuple(kept)), program)
        print(program)
    if reason is not None:
        raise SafetyError(f"the arm was stopped: {reason}")


class Pendant:
    """What keys mean: which joint, which way, how fast. Time is the computer's own clock."""

    def __init__(self, speed: float) -> None:
        self.joint = 1
        self.speed = speed
        self.ended = False
        self.keep = False
        self.gripper: bool | None = None
        self._command: JogCommand | None = None

    def command(self, typed: str) -> JogCommand | None:
        """The newest command after the keys `typed`; the one before when they drive nothing."""
        from daq.cli.keyboard import LEFT, RIGHT
        from daq.teaching.jog import JOG_SPEED, JogCommand

        direction = typed.count(RIGHT) - typed.count(LEFT)
        for key in typed.replace(RIGHT, "").replace(LEFT, ""):
            if key in "123456":
                self.joint, self._command = int(key), None
            elif key in "+-":
                self.speed = min(JOG_SPEED, self.speed * (1.25 if key == "+" else 0.8))
            elif key in "oc":
                self.gripper = key == "c"
            elif key == "p":
                self.keep = True
            elif key == "q":
                self.ended = True
        if direction:
            velocity = math.copysign(self.speed, direction)
            self._command = JogCommand({self.joint: velocity}, time.monotonic())
        return self._command


@app.command()
def step(
    context: typer.Context,
    to: Annotated[str | None, typer.Option(help="Absolute angles, such as 1=180,2=45 (degrees).")] = None,
    by: Annotated[str | None, typer.Option(help="Relative angles, such as 2=-5 (degrees).")] = None,
    speed: Annotated[str, typer.Option(help="Degrees/s of the fastest joint.")] = "14",
    yes: YesOption = False,
) -> None:
    """One off-line step, all joints arriving together: to absolute angles, or by relative ones."""
    from daq.teaching.program import Absolute, Instruction, Program, Relative

    if (to is None) == (by is None):
        raise SpecError("step: give either --to or --by")
    angles = parse_per_joint_angles(to or by or "", "step")
    if not isinstance(angles, dict):
        raise SpecError(f"step {to or by!r}: write joint=angle pairs like 1=180,2=45")
    call = invocation(context)
    kind: type[Absolute | Relative] = Relative if to is None else Absolute
    instruction: Instruction = kind(angles=angles, speed=parse_angle(speed, "speed"))
    program = Program(name="step", machine=call.settings.machine().name, instructions=(instruction,))
    _perform(call, program, yes)


@app.command("program")
def run_file(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="A taught program (.json or .toml).")],
    yes: YesOption = False,
) -> None:
    """Carry out a taught program: steps, paths, waits, process signals."""
    from daq.teaching.program import load_program

    _perform(invocation(context), load_program(file), yes)


def _perform(call: Invocation, program: object, consent: bool) -> None:
    from daq.teaching.controller_arm import ControllerArm
    from daq.teaching.performer import FollowingPerformer
    from daq.teaching.program import Program
    from daq.teaching.program_plan import check_program, plan_program, run_program

    assert isinstance(program, Program)
    machine = call.settings.machine()
    with _owned(call, consent) as robot:
        here = ControllerArm(robot.controller, machine).next_sample()
        planned = plan_program(program, machine, here.set_point)
        against = check_program(planned, machine, machine.limits)
        if against:
            raise SafetyError(f"program refused: {against[0]}; nothing moved")
        tell = console().print
        performer = FollowingPerformer(robot.controller, robot.control, machine, machine.limits, robot.ended, tell)
        run_program(planned, machine, performer, tell)
    print(f"done: {len(planned)} instructions")


@app.command()
def lead(
    context: typer.Context,
    output: Annotated[Path, typer.Option("--output", "-o", help="Where the recorded path goes (.json).")],
    joints: Annotated[str, typer.Option(help="Joints to be led: 1-3, 1,3 or 2.")] = "1-3",
    seconds: Annotated[float | None, typer.Option(help="End by itself after so long; else with Enter.")] = None,
    yes: YesOption = False,
) -> None:
    """Record a path while the arm is led by hand. HOLD THE ARM: the led joints have no drive and may sink."""
    import select
    import sys

    from daq.contracts.experiment import parse_joints
    from daq.teaching import lead_by_nose
    from daq.teaching.controller_arm import ControllerArm

    if seconds is None and not sys.stdin.isatty():
        raise SpecError("lead: give --seconds, or a terminal in which Enter ends it")
    call = invocation(context)
    machine = call.settings.machine()
    with _owned(call, yes) as robot:
        begun = robot.controller.clock.now()

        def ended() -> bool:
            if seconds is not None:
                return robot.controller.clock.now() - begun >= seconds
            return bool(select.select([sys.stdin], [], [], 0)[0])

        console().print("recording: lead the arm" + ("; Enter ends it" if seconds is None else f" for {seconds:g} s"))
        path = lead_by_nose(
            ControllerArm(robot.controller, machine), machine, machine.limits, parse_joints(joints), ended
        )
    output.write_text(path.model_dump_json(indent=1) + "\n", "utf-8")
    print(f"{output}: {path.duration:.2f} s on joints {', '.join(map(str, path.joints))}")


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

    from daq.cli.run_result import carry_out
    from daq.teaching import RecordedPath, playback

    try:
        path = RecordedPath.model_validate_json(file.read_text("utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise SpecError(f"path {file}: cannot be read: {error}") from error
    except ValidationError as error:
        raise SpecError(f"path {file}: {error.errors()[0]['msg']}") from error
    spec = playback(path, rate, "playback")
    carry_out(invocation(context), spec, folder=folder, dry_run=dry_run, consent=yes, as_json=json)
