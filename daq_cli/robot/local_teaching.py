"""Teaching at this computer's port, which this process holds meanwhile: jogging, programs, leading by hand."""

from __future__ import annotations

import select
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, TypeVar

from daq.contracts.errors import SafetyError, SpecError
from daq.contracts.limp import require_drive
from daq_cli.app.consent import Consent
from daq_cli.app.context import Invocation, console
from daq_cli.app.keyboard import open_keyboard
from daq_cli.robot.pendant import HELP, Pendant, StatusLine

if TYPE_CHECKING:
    from daq.acquisition.owned import OwnedRobot
    from daq.contracts.machine import Machine
    from daq.contracts.sample import SampleRow
    from daq.teaching import RecordedPath
    from daq.teaching.controller_arm import ControllerArm
    from daq.teaching.jog import JogCommand
    from daq.teaching.program import Program
    from daq.teaching.program_plan import PlannedInstruction

Made = TypeVar("Made")


@contextmanager
def _owned(
    call: Invocation, consent: Consent, prepare: Callable[[OwnedRobot], Made]
) -> Iterator[tuple[OwnedRobot, Made]]:
    """The robot, held by this process. Where a real arm waits for consent and a person can be asked, asks.

    `prepare` looks and checks before anything moves: what it refuses leaves set points and gains as they were.
    """
    from daq.acquisition.owned import owned_robot
    from daq.config.robot_files import load_memory_map
    from daq.runner import Consent as Agreed
    from daq.runner import MissingConsentError

    robot, memory_map = call.settings.robot.name, load_memory_map(call.settings.robot.memory_map)
    with ExitStack() as held:

        def hold(moves_real_arm: bool) -> OwnedRobot:
            return held.enter_context(owned_robot(robot, call.port, memory_map, Agreed(moves_real_arm)))

        owned = consent.attempt(call.port, hold, MissingConsentError)
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


def jog_locally(
    call: Invocation,
    machine: Machine,
    pendant: Pendant,
    keep: Callable[[Mapping[int, float]], None],
    consent: Consent,
    line: StatusLine,
) -> None:
    """Drives joints with the keys until the pendant has ended."""
    from daq.teaching import jog

    with open_keyboard() as keyboard, _owned(call, consent, lambda robot: _arm(robot, machine)) as (robot, arm):
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

        jog(arm, machine, machine.limits, commands, lambda: pendant.ended, line.tell)


def perform_locally(call: Invocation, machine: Machine, program: Program, consent: Consent) -> str:
    """Carries out a program, which is planned and checked from where the arm stands. Raises SafetyError."""
    from daq.teaching.performer import FollowingPerformer
    from daq.teaching.program_plan import check_program, plan_program, run_program

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
    return f"done: {len(planned)} instructions"


def lead_locally(
    call: Invocation,
    machine: Machine,
    joints: Sequence[int],
    seconds: float | None,
    keep: Callable[[RecordedPath], None],
    consent: Consent,
) -> None:
    """Records a path until `seconds` are over, or Enter is pressed."""
    from daq.teaching import lead_by_nose

    with _owned(call, consent, lambda robot: _arm(robot, machine)) as (robot, arm):
        begun = robot.controller.clock.now()

        def ended() -> bool:
            if seconds is not None:
                return robot.controller.clock.now() - begun >= seconds
            return bool(select.select([sys.stdin], [], [], 0)[0])

        console().print("recording: lead the arm" + ("; Enter ends it" if seconds is None else f" for {seconds:g} s"))
        lead_by_nose(arm, machine, machine.limits, tuple(joints), ended, keep)
