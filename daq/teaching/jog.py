"""Jogging (drive-through): joints move while a key is held, as with the original teach pendant (section 6.4)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.joint_text import slides, speed_unit
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.sample import SampleRow
from daq.contracts.trace import Floats
from daq.runner.lag import Lag
from daq.safety import RunningGuards, check_move_to_start
from daq.teaching.arm import TeachableArm
from daq.trajectories.set_points import control_period, make_plan

JOG_SPEED = 0.35
"""Highest jog speed in rad/s (20 °/s; an assumption). A joint's own limit may be lower."""
SLIDE_JOG_SPEED = 0.07
"""The same for a prismatic joint, in m/s (an assumption: the speed at a radius of 0.2 m and JOG_SPEED)."""
DEAD_MAN = 0.3
"""Time (s) for which a command moves the arm (an assumption). While the key is held, commands come more often."""


@dataclass(frozen=True)
class JogCommand:
    """Joints to drive, with their velocities (rad/s, m/s), and the time of the command (s, on the samples' clock)."""

    velocities: Mapping[int, float]
    time: float


@dataclass(frozen=True)
class JogStep:
    """Set points to send after a sample (joint → posture units), the corresponding positions (rad, m), and why joints
    that should move do not."""

    postures: Mapping[int, int] = field(default_factory=dict)
    angles: Mapping[int, float] = field(default_factory=dict)
    refused: tuple[str, ...] = ()


def top_speed(machine: Machine, limits: Limits, joint: int) -> float:
    """Highest speed (rad/s; m/s for a prismatic joint) at which `joint` may be jogged."""
    own, usual = limits.joint(joint).speed, SLIDE_JOG_SPEED if slides(machine, joint) else JOG_SPEED
    return usual if own is None else min(usual, own)


def require_step_speed(machine: Machine, joints: Iterable[int], speed: float) -> None:
    """Raises SpecError if `speed` is too fast for a prismatic joint: a usual value in rad/s is five times too fast in
    m/s."""
    for joint in joints:
        if slides(machine, joint) and speed > SLIDE_JOG_SPEED:
            line = f"speed = {speed:g} m/s: joint {joint} is prismatic: allowed are up to {SLIDE_JOG_SPEED:g} m/s"
            raise SpecError(f"step: {line}")


class Jogger:
    """Computes one set point per sample. Its only state is the accepted angles and the tick of the last sample.

    every: control periods from one sample to the next; more than one on a slow line. A step covers the time between the
           last two samples, but at most `every` periods. So the joint has the commanded speed, and after a gap it
           continues from where it was.

    Every sample must contain all joints of the machine, since floor and reach depend on all. Raises SpecError if not,
    and for commands that are too fast.
    """

    def __init__(self, machine: Machine, limits: Limits, joints: tuple[int, ...], every: int = 1) -> None:
        if len(joints) != len(machine.joints):
            raise SpecError(f"jog: samples have joints {list(joints)}, all of 1 to {len(machine.joints)} are needed")
        self._machine = machine
        self._limits = limits
        self._joints = joints
        self._period = control_period(machine)
        self._every = every
        self._last: int | None = None
        self._driven: dict[int, float] = {}

    def step(self, row: SampleRow, command: JogCommand | None) -> JogStep:
        """Returns the step to send after `row`. Without a command, or after DEAD_MAN, nothing moves.

        A step of several periods that would exceed the limits is replaced by a step of one period, so that the joint
        comes as close to its limit as on a fast line.
        """
        periods = self._periods_to(row)
        if command is None or row.host_time - command.time > DEAD_MAN:
            return JogStep()
        self._check(command)
        here = self._angles(row)
        step = self._moved(here, command, periods)
        return self._moved(here, command, 1) if step.refused and periods > 1 else step

    def accept(self, step: JogStep) -> None:
        """Notes that the step was sent: the next one continues from it."""
        self._driven.update(step.angles)

    def _periods_to(self, row: SampleRow) -> int:
        """Returns the control periods since the previous sample, at most `every`."""
        before, self._last = self._last, row.tick
        return self._every if before is None else max(1, min(self._every, row.tick - before))

    def _moved(self, here: Floats, command: JogCommand, periods: int) -> JogStep:
        """Returns the step of `periods` periods from set points `here` (rad, m), or why there is none."""
        there = here.copy()
        moving = tuple(joint for joint, velocity in command.velocities.items() if velocity)
        for joint in moving:
            there[joint - 1] += command.velocities[joint] * periods * self._period
        plan = make_plan(self._machine, moving, np.linspace(here, there, periods + 1))
        violations = check_move_to_start(plan, self._machine, self._limits)
        if violations:
            return JogStep(refused=tuple(str(violation) for violation in violations))
        return JogStep(
            {joint: int(plan.postures[-1, joint - 1]) for joint in moving},
            {joint: float(there[joint - 1]) for joint in moving},
        )

    def _check(self, command: JogCommand) -> None:
        for joint, velocity in command.velocities.items():
            if joint not in self._joints:
                raise SpecError(f"jog: joint {joint}: allowed are {list(self._joints)}")
            top, unit = top_speed(self._machine, self._limits, joint), speed_unit(self._machine, joint)
            if not abs(velocity) <= top:
                raise SpecError(f"jog: joint {joint}: velocity of {velocity} {unit}: allowed are up to ±{top:g} {unit}")

    def _angles(self, row: SampleRow) -> Floats:
        """Set points of all joints: the last ones sent, otherwise those that the controller holds."""
        held = zip(self._joints, row.set_point, strict=True)
        return np.array([self._driven.get(joint, angle) for joint, angle in held])


def jog(
    arm: TeachableArm,
    machine: Machine,
    limits: Limits,
    commands: Callable[[SampleRow], JogCommand | None],
    ended: Callable[[], bool],
    tell: Callable[[str], None],
) -> None:
    """Lets `commands` drive the arm until `ended`. `commands` returns the newest command after each sample; `tell` gets
    lines for the operator.

    Raises StoppedError if the arm was stopped, TeachingError if a guard tripped; the arm is frozen then.
    """
    jogger = Jogger(machine, limits, arm.joints, arm.every)
    guards = RunningGuards(machine, limits, arm.joints, moving=arm.joints, every=arm.every)
    lag = Lag(control_period(machine), arm.every)
    reported: tuple[str, ...] = ()
    with arm.driven():
        while not ended():
            row = arm.next_sample()
            step = jogger.step(row, commands(row))
            verdict = guards.check(row, step.postures) | lag.check(row.tick, arm.lateness)
            if verdict.stop is not None:
                raise arm.freeze_for_stop(verdict.stop)
            if verdict.trips:
                raise arm.freeze_for_fault("; ".join(verdict.trips))
            if step.refused != reported:
                reported = step.refused
                for line in reported:
                    tell(line)
            if step.postures and not verdict.hold:
                arm.set_points(step.postures)
                jogger.accept(step)
