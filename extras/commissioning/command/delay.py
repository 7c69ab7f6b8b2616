"""The step that measures the computing delay: one joint's set point is moved to and fro, and its error is watched."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from daq.contracts.errors import SafetyError
from daq.contracts.quantity import Quantity
from daq.driver.clock import LockStepClock
from extras.commissioning.command.bench import Bench
from extras.commissioning.computing_delay import ComputingDelay, Effect, computing_delay
from firmware_protocol.commands import Block, ReadBlock

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from daq.driver import Controller
    from daq.teaching.controller_arm import ControllerArm
    from extras.commissioning.command.held_arm import HeldArm

STEP = 2
"""Posture units by which the set point is moved: half a degree of a major axis, and 8 counts of its error."""
SHOWS = 4
"""Change of the error (ADC counts) from one reading to the next that only a new set point makes."""
TIMES = 36
"""Set points that are written."""
SETTLED_PERIODS = 12
"""Control periods from one set point to the next, in which the joint nearly comes to rest."""
GOLDEN = 0.618034
"""Share of a period by which each set point is later in its period than the one before: they spread evenly."""
PATIENCE_PERIODS = 4
"""Control periods in which an effect must show."""
READINGS_A_PERIOD = 40
"""In lock-step, where time passes only when it is asked to."""


def delay(bench: Bench) -> dict[str, Any]:
    """The computing delay, by set points at all phases of the period; it goes into the machine file.

    A stop, Ctrl-C and every fault freeze the arm where it is; it returns to its posture only after the last set point.
    """
    from extras.commissioning.command.held_arm import held_arm
    from extras.commissioning.command.measured import with_controller

    bench.configure()
    joint, period = bench.joints[0], 1e-3 * float(bench.record.steps["period"]["period_ms"])
    call, shown = bench.configured, []
    machine = call.settings.machine()
    with held_arm(call, bench.consent, lambda robot: _checked(robot, machine, joint)) as (robot, (arm, there, away)):
        watch = _Watch(robot.controller, arm, bench.memory_map()["error"].low[joint - 1], joint, period)
        with arm.driven():
            for k in range(TIMES):
                _require_following(arm, machine)
                shown.append(watch.effect(there if k % 2 else away, k * GOLDEN % 1.0))
            arm.set_points({joint: there})
    found = computing_delay([one for one in shown if one is not None], period)
    bench.operator.show(str(found))
    bench.write_machine(with_controller(bench.machine(), {"delay": _quantity(found)}))
    return {
        "joint": joint,
        "set_points_that_showed": found.used,
        "lowest_ms": round(1e3 * found.low, 2),
        "highest_ms": round(1e3 * found.high, 2),
    }


class _Way(NamedTuple):
    """The arm, and the two postures (posture units) between which its joint is moved."""

    arm: ControllerArm
    there: int
    away: int


def _checked(robot: HeldArm, machine: Machine, joint: int) -> _Way:
    """Checks before anything moves: the machine file, the following errors, the limits. Raises SafetyError."""
    from daq.runner.preparation import require_allowed, require_still
    from daq.safety import check_move_to_start
    from daq.teaching.controller_arm import ControllerArm
    from daq.trajectories.move import plan_move

    arm = ControllerArm(robot.controller, robot.control, machine, robot.end_cause, every_period=False)
    row, own = arm.next_sample(), machine.calibration(joint)
    require_still(row, machine, machine.limits)
    there = robot.controller.next_snapshot(None, (joint,))[joint].set_point
    away = there + (STEP if there < 500 else -STEP)
    target = list(row.set_point)
    target[joint - 1] = own.posture_to_rad(away)
    move = plan_move(machine, row.set_point, target)
    require_allowed("computing delay", check_move_to_start(move, machine, machine.limits))
    return _Way(arm, there, away)


def _require_following(arm: ControllerArm, machine: Machine) -> None:
    """Freezes an arm that does not follow, and raises TeachingError; StoppedError after a stop."""
    from daq.runner.preparation import require_still

    try:
        require_still(arm.next_sample(), machine, machine.limits)
    except SafetyError as error:
        raise arm.freeze_for_fault(str(error)) from error


def _quantity(found: ComputingDelay) -> Quantity:
    source = "measured from the taking of set points to the storing of results; the drive is taken to change then"
    value, deviation = round(found.value, 6), round(found.deviation, 6)
    return Quantity(value=value, unit="s", source=source, low=0.0, deviation=deviation)


@dataclass
class _Watch:
    """The low byte of a joint's error, read again and again."""

    controller: Controller
    arm: ControllerArm
    address: int
    joint: int
    period: float
    _missed: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        self._missed = self.controller.status().missed

    def effect(self, posture: int, phase: float) -> Effect | None:
        """Writes a set point at a phase of the period (0 to 1 from any moment) and waits until the error shows it. None
        where it did not, or where the controller missed set points meanwhile."""
        clock = self.controller.clock
        clock.sleep_until(self._now() + (SETTLED_PERIODS + phase) * self.period)
        error, _ = self._read()
        begun = self._now()
        self.arm.set_points({self.joint: posture})
        written = begun, self._now()
        after = begun
        while self._now() < written[1] + PATIENCE_PERIODS * self.period:
            if isinstance(clock, LockStepClock):
                clock.sleep_until(clock.now() + self.period / READINGS_A_PERIOD)
            seen, bounds = self._read()
            if abs((seen - error + 128) % 256 - 128) >= SHOWS:
                before, self._missed = self._missed, self.controller.status().missed
                return Effect(written, (after, bounds[1])) if self._missed == before else None
            error, after = seen, bounds[0]
        return None

    def _now(self) -> float:
        """Time (s)."""
        clock = self.controller.clock
        if isinstance(clock, LockStepClock):
            clock.synchronise()
        return clock.now()

    def _read(self) -> tuple[int, tuple[float, float]]:
        """The byte, and bounds of the moment when it was read."""
        begun = self._now()
        data = self.controller.link.request(ReadBlock(self.address, 1), Block).data
        return data[0], (begun, self._now())
