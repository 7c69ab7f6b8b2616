"""Plans and checks a whole program before its first motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from daq.contracts.errors import SpecError
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.safety import check_move_to_start, check_plan
from daq.teaching.arm import TeachingError
from daq.teaching.program import (
    Absolute,
    AwaitInput,
    Gripper,
    Instruction,
    PlayPath,
    Program,
    Relative,
    SetOutput,
    Wait,
)
from daq.teaching.recording import playback
from daq.trajectories.move import plan_move
from daq.trajectories.planner import plan
from daq.trajectories.set_points import Plan, control_period


@dataclass(frozen=True)
class PlannedInstruction:
    """An instruction (`number` from 1) with its plans; empty if nothing moves."""

    number: int
    instruction: Instruction
    plans: tuple[Plan, ...]


class Performer(Protocol):
    """Carries out a program's instructions."""

    def follow(self, plan: Plan) -> None:
        """Plays a plan to its end. Raises a DaqError if it does not finish."""
        ...

    def observe(self, periods: int) -> None:
        """Waits for this many control periods."""
        ...

    def input_is_on(self, line: int) -> bool:
        """Reads a process input."""
        ...

    def set_output(self, line: int, *, on: bool) -> None:
        """Switches a process output."""
        ...

    def set_gripper(self, *, closed: bool) -> None:
        """Switches the gripper."""
        ...


def plan_program(program: Program, machine: Machine, start: Sequence[float]) -> list[PlannedInstruction]:
    """Plans every instruction, each from the end of the previous one; `start` in rad, all joints of the machine.

    Raises SpecError, which names the instruction, if it cannot be planned, or if the program is for another machine.
    """
    if program.machine != machine.name:
        raise SpecError(f"program {program.name}: it is for machine {program.machine!r}, this is {machine.name!r}")
    planned = []
    here = list(start)
    for number, instruction in enumerate(program.instructions, start=1):
        try:
            plans = _plans(instruction, machine, here)
        except SpecError as error:
            raise SpecError(f"program {program.name}: instruction {number}: {error}") from error
        if plans:
            here = plans[-1].angles[-1].tolist()
        planned.append(PlannedInstruction(number, instruction, plans))
    return planned


def check_program(planned: Sequence[PlannedInstruction], machine: Machine, limits: Limits) -> list[str]:
    """Returns all violations of the program, one line each. The first motion may return from outside the limits, where
    the arm may have been guided by hand."""
    lines = []
    first = True
    for item in planned:
        for made in item.plans:
            check = check_move_to_start if first else check_plan
            first = False
            lines += [f"instruction {item.number}: {violation}" for violation in check(made, machine, limits)]
    return lines


def run_program(
    planned: Sequence[PlannedInstruction], machine: Machine, performer: Performer, tell: Callable[[str], None]
) -> None:
    """Carries out a planned and checked program. Raises TeachingError if an awaited input does not come, and the
    performer's errors."""
    period = control_period(machine)
    for item in planned:
        tell(f"instruction {item.number} of {len(planned)}: {item.instruction.kind}")
        for made in item.plans:
            performer.follow(made)
        match item.instruction:
            case Wait(duration=duration):
                performer.observe(max(1, round(duration / period)))
            case SetOutput(line=line, on=on):
                performer.set_output(line, on=on)
            case Gripper(closed=closed):
                performer.set_gripper(closed=closed)
            case AwaitInput():
                _await_input(item, performer, period)


def _await_input(item: PlannedInstruction, performer: Performer, period: float) -> None:
    wanted = item.instruction
    assert isinstance(wanted, AwaitInput)
    for _ in range(max(1, round(wanted.longest / period))):
        if performer.input_is_on(wanted.line) is wanted.on:
            return
        performer.observe(1)
    state = "on" if wanted.on else "off"
    raise TeachingError(f"instruction {item.number}: input {wanted.line} was not {state} within {wanted.longest:g} s")


def _plans(instruction: Instruction, machine: Machine, here: list[float]) -> tuple[Plan, ...]:
    match instruction:
        case Absolute(angles=angles, speed=speed) | Relative(angles=angles, speed=speed):
            there = list(here)
            for joint, angle in angles.items():
                machine.joint(joint)
                there[joint - 1] = angle if isinstance(instruction, Absolute) else here[joint - 1] + angle
            return (plan_move(machine, here, there, speed),)
        case PlayPath(path=path, rate=rate):
            spec = playback(path, rate)
            there = list(here)
            for joint, angle in zip(path.joints, path.positions[0], strict=True):
                machine.joint(joint)
                there[joint - 1] = angle
            approach = plan_move(machine, here, there)
            return approach, plan(spec, machine, approach.angles[-1].tolist())
        case _:
            return ()
