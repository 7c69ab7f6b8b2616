"""Drive-through: the joints move while a key is held, as with the teach pendant of the original (section 6.4)."""

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
"""Highest speed of jogging in rad/s (20 °/s): an assumption. A joint's own limit may be lower."""
SLIDE_JOG_SPEED = 0.07
"""The same of a joint that slides, in m/s: an assumption, what a joint that turns at JOG_SPEED moves at 0.2 m."""
DEAD_MAN = 0.3
"""Time (s) for which a command moves the arm: an assumption. While the key is held, commands come more often."""


@dataclass(frozen=True)
class JogCommand:
    """Joints to be driven, with their velocities (rad/s, m/s), and when they were given (s, on the samples' clock)."""

    velocities: Mapping[int, float]
    time: float


@dataclass(frozen=True)
class JogStep:
    """Set points for after a sample (joint → posture units), the positions (rad, m) that they stand for, and why joints
    that should move do not."""

    postures: Mapping[int, int] = field(default_factory=dict)
    angles: Mapping[int, float] = field(default_factory=dict)
    refused: tuple[str, ...] = ()


def top_speed(machine: Machine, limits: Limits, joint: int) -> float:
    """Highest speed (rad/s; m/s of a joint that slides) at which `joint` may be jogged."""
    own, usual = limits.joint(joint).speed, SLIDE_JOG_SPEED if slides(machine, joint) else JOG_SPEED
    return usual if own is None else min(usual, own)


def require_step_speed(machine: Machine, joints: Iterable[int], speed: float) -> None:
    """Raises SpecError where `speed` is too fast for a joint that slides: a usual speed in rad/s is five times too fast
    in m/s."""
    for joint in joints:
        if slides(machine, joint) and speed > SLIDE_JOG_SPEED:
            line = f"speed = {speed:g} m/s: joint {joint} slides: allowed are up to {SLIDE_JOG_SPEED:g} m/s"
            raise SpecError(f"step: {line}")


class Jogger:
    """Computes one set point per sample. Pure except for the angles it has accepted and the tick of the last sample.

    every: control periods from one sample to the next: more than one where the line is slow. A step is as long as the
           time between the last two samples, so that the joint has its speed, and never longer than so many periods:
           after a gap it goes on where it was.

    Needs all joints of the machine in every sample, since floor and reach depend on all. Raises SpecError without
    them, and for commands that are faster than allowed.
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
        """The step to send after `row`. Nothing moves without a command, or when it is older than DEAD_MAN.

        A step of several periods that would leave the limits is replaced by one of one period: so the joint comes as
        near to its limit as on a fast line.
        """
        periods = self._periods_to(row)
        if command is None or row.host_time - command.time > DEAD_MAN:
            return JogStep()
        self._check(command)
        here = self._angles(row)
        step = self._moved(here, command, periods)
        return self._moved(here, command, 1) if step.refused and periods > 1 else step

    def accept(self, step: JogStep) -> None:
        """Notes that the step has been sent: the next one continues from it."""
        self._driven.update(step.angles)

    def _periods_to(self, row: SampleRow) -> int:
        """Control periods from the sample before to this one, which a step makes up for; at most `every`."""
        before, self._last = self._last, row.tick
        return self._every if before is None else max(1, min(self._every, row.tick - before))

    def _moved(self, here: Floats, command: JogCommand, periods: int) -> JogStep:
        """The step of so many periods from set points `here` (rad, m), or why there is none."""
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
        """Set points of all joints: those sent last, else those that the controller holds."""
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
    """Lets `commands` drive the arm until `ended`. `commands` gives the newest command after each sample, `tell` takes
    lines for the operator.

    Raises StoppedError when somebody stopped the arm, TeachingError when a guard tripped; it is frozen then.
    """
    jogger = Jogger(machine, limits, arm.joints, arm.every)
    guards = RunningGuards(machine, limits, arm.joints, moving=arm.joints, every=arm.every)
    lag = Lag(control_period(machine), arm.every)
    told: tuple[str, ...] = ()
    with arm.driven():
        while not ended():
            row = arm.next_sample()
            step = jogger.step(row, commands(row))
            verdict = guards.check(row, step.postures) | lag.check(row.tick, arm.lateness)
            if verdict.stop is not None:
                raise arm.freeze_for_stop(verdict.stop)
            if verdict.trips:
                raise arm.freeze_for_fault("; ".join(verdict.trips))
            if step.refused != told:
                told = step.refused
                for line in told:
                    tell(line)
            if step.postures and not verdict.hold:
                arm.set_points(step.postures)
                jogger.accept(step)
