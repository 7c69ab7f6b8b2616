"""Teaching at this computer's port, which this process holds meanwhile: jogging, programs, leading by hand."""

from __future__ import annotations

import select
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from daq.contracts.errors import SafetyError, SpecError
from daq.contracts.limp import GAINS_UNKNOWN, require_drive
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation, console
from daq_cli.app.keyboard import open_keyboard
from daq_cli.robot.pendant import HELP, Pendant, StatusLine, announce_lead

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from daq.contracts.sample import SampleRow
    from daq.owner.owned import OwnedRobot
    from daq.teaching import RecordedPath
    from daq.teaching.controller_arm import ControllerArm
    from daq.teaching.jog import JogCommand
    from daq.teaching.program import Program
    from daq.teaching.program_plan import PlannedInstruction

Made = TypeVar("Made")


@dataclass(frozen=True)
class LocalTeaching:
    """`Teaching` at the configured port."""

    call: Invocation
    machine: Machine
    consent: ConsentPrompt

    def jog(self, pendant: Pendant, keep: Callable[[Mapping[int, float]], None], line: StatusLine) -> None:
        """Drives until the pendant has ended."""
        from daq.teaching import jog as jog_arm

        with open_keyboard() as keyboard, self.owned(self._arm) as (robot, arm):
            line.tell(HELP)

            def commands(row: SampleRow) -> JogCommand | None:
                command = pendant.command(keyboard.pressed(), robot.controller.clock.now())
                if pendant.gripper is not None and robot.end_cause() is None:
                    robot.controller.set_gripper(closed=pendant.gripper)
                    pendant.gripper = None
                if pendant.keep:
                    pendant.keep = False
                    keep(dict(zip(arm.joints, row.set_point, strict=True)))
                line.show(pendant)
                return command

            jog_arm(arm, self.machine, self.machine.limits, commands, lambda: pendant.ended, line.tell)

    def perform(self, program: Program) -> str:
        """Plans and checks the program from the arm's present posture first. Raises SafetyError."""
        from daq.teaching.performer import FollowingPerformer
        from daq.teaching.program_plan import check_program, plan_program, run_program

        machine = self.machine

        def checked(robot: OwnedRobot) -> list[PlannedInstruction]:
            here = self._arm(robot).next_sample()
            planned = plan_program(program, machine, here.set_point)
            against = check_program(planned, machine, machine.limits)
            if against:
                raise SafetyError(f"program refused: {against[0]}; nothing moved")
            return planned

        with self.owned(checked) as (robot, planned):
            tell = console().print
            performer = FollowingPerformer(
                robot.controller, robot.control, machine, machine.limits, robot.end_cause, tell
            )
            run_program(planned, machine, performer, tell)
            performer.finish()
        return f"done: {len(planned)} instructions"

    def lead(self, joints: Sequence[int], seconds: float | None, keep: Callable[[RecordedPath], None]) -> None:
        """Records until `seconds` are over, or Enter is pressed."""
        from daq.teaching import lead_by_nose

        with self.owned(self._arm) as (robot, arm):
            begun = robot.controller.clock.now()

            def ended() -> bool:
                if seconds is not None:
                    return robot.controller.clock.now() - begun >= seconds
                return bool(select.select([sys.stdin], [], [], 0)[0])

            announce_lead(seconds)
            lead_by_nose(arm, self.machine, self.machine.limits, tuple(joints), ended, keep)

    @contextmanager
    def owned(self, prepare: Callable[[OwnedRobot], Made]) -> Iterator[tuple[OwnedRobot, Made]]:
        """The robot, whose port this process owns. If a real arm needs consent and a person can be asked, it asks.

        `prepare` makes checks before anything moves; if it refuses, set points and gains stay as they were.
        """
        from daq.config.robot_files import load_memory_map
        from daq.owner.owned import owned_robot
        from daq.runner import Consent, MissingConsentError

        robot, memory_map = self.call.settings.robot.name, load_memory_map(self.call.settings.robot.memory_map)
        with ExitStack() as held:

            def hold(moves_real_arm: bool) -> OwnedRobot:
                return held.enter_context(owned_robot(robot, self.call.port, memory_map, Consent(moves_real_arm)))

            owned = self.consent.for_gains_of(memory_map).attempt(self.call.port, hold, MissingConsentError)
            try:
                gains = owned.controller.gains()
                require_drive(gains)
                if not gains:
                    console().print(GAINS_UNKNOWN)
                prepared = prepare(owned)
            except (SafetyError, SpecError):
                held.close()  # without the error, which would freeze the arm
                raise
            yield owned, prepared

    def _arm(self, robot: OwnedRobot) -> ControllerArm:
        from daq.teaching.controller_arm import ControllerArm

        return ControllerArm(robot.controller, robot.control, self.machine, robot.end_cause)
