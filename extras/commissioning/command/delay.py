"""Measures the controller's computing delay: from the time when it reads set points to that when it stores results.

This process holds the port of the robot itself, to measure at its registers; it can be stopped like any run. One
joint's set point is moved to and fro. Each is written at some time, and the memory is read repeatedly until the error
shows it. Only the order of events is known: a byte was written between a request and its reply, and a result was stored
between the last reading without it and the first with it. Each such pair bounds the delay from both sides, however slow
the computer and the line are. Pairs at many phases of the period narrow the bounds.
"""

from __future__ import annotations

import math
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from daq.contracts.errors import SafetyError, SpecError
from daq.contracts.limp import GAINS_UNKNOWN, require_drive
from daq.contracts.quantity import Quantity
from daq.driver import Controller
from daq.driver.clock import LockStepClock
from daq.owner.session import PortSession, port_session
from daq.runner.arm_control import ArmControl, StoppedError
from daq.runner.preparation import Consent, MissingConsentError, require_not_stopped
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation, console
from extras.commissioning.command.bench import Bench
from firmware_protocol.commands import Block, ReadBlock

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from daq.teaching.controller_arm import ControllerArm
    from firmware_protocol.memory_map import MemoryMap


Made = TypeVar("Made")


@dataclass(frozen=True)
class HeldArm:
    """The session that holds the port, and the arm's state."""

    session: PortSession[Controller]
    control: ArmControl

    @property
    def controller(self) -> Controller:
        """The greeted controller."""
        return self.session.controller

    def end_cause(self) -> str | None:
        """Returns the cause of a requested end (`daq stop`, a signal), or None."""
        return self.session.end_cause()


@contextmanager
def held_arm(
    call: Invocation, asked: ConsentPrompt, prepare: Callable[[HeldArm], Made]
) -> Iterator[tuple[HeldArm, Made]]:
    """Yields the robot, whose port this process holds. If a real arm needs consent and a person can be asked, it asks.

    `prepare` makes checks before anything moves; if it fails, set points and gains stay unchanged. Enter on the main
    thread. If the block ends early for any reason, the arm is frozen.
    """
    from daq.config.robot_files import load_memory_map

    robot, memory_map = call.settings.robot.name, load_memory_map(call.settings.robot.memory_map)
    with ExitStack() as entered:

        def hold(moves_real_arm: bool) -> HeldArm:
            return entered.enter_context(_held(robot, call.port, memory_map, Consent(moves_real_arm)))

        try:
            held = hold(asked.given)
        except MissingConsentError:  # no process holds the port while the operator is asked
            if not asked.for_gains_of(memory_map).agreed(call.port):
                raise
            held = hold(True)
        try:
            gains = held.controller.gains()
            require_drive(gains)
            if not gains:
                console().print(GAINS_UNKNOWN)
            prepared = prepare(held)
        except (SafetyError, SpecError):
            entered.close()  # without the error, which would freeze the arm
            raise
        yield held, prepared


@contextmanager
def _held(robot: str, url: str, memory_map: MemoryMap, consent: Consent) -> Iterator[HeldArm]:
    """Yields the held robot.

    Raises MissingConsentError for a real arm without consent, SafetyError for an arm that has been stopped,
    StoppedError if a stop came before it was reached, LinkError.
    """
    with stopped_by_ctrl_z(), port_session(Controller.connect, robot, url, memory_map) as session:
        consent.require(session.controller)
        require_not_stopped(session.controller)
        control = session.take_control()
        if (cause := session.end_cause()) is not None:
            control.stop(cause)
            raise StoppedError(cause)
        with control.frozen_on_error():
            yield HeldArm(session, control)


@contextmanager
def stopped_by_ctrl_z() -> Iterator[None]:
    """Handles Ctrl-Z like Ctrl-C. A Python handler lets the guardian's wake-up pipe see it; a process that the terminal
    has suspended could not react to a stop."""
    before = signal.signal(signal.SIGTSTP, lambda _number, _frame: None)
    try:
        yield
    finally:
        signal.signal(signal.SIGTSTP, before)


FEWEST = 12
"""Least number of set points with a seen effect: a choice."""
WIDEST_S = 0.006
"""Width (s) of an interval that is useless: the shipped machine file states 6 ms ± 2 ms, which is no wider."""


@dataclass(frozen=True)
class Effect:
    """One set point and its effect: bounds (s) of the time when it was written, and of that when the first result with
    it was stored."""

    written: tuple[float, float]
    stored: tuple[float, float]


@dataclass(frozen=True)
class ComputingDelay:
    """Bounds of the delay (s), from `used` set points."""

    low: float
    high: float
    used: int

    @property
    def value(self) -> float:
        """The middle (s)."""
        return (self.low + self.high) / 2

    @property
    def deviation(self) -> float:
        """Standard deviation (s) of a delay that may be anywhere between the bounds."""
        return (self.high - self.low) / math.sqrt(12)

    def __str__(self) -> str:
        return f"computing delay: {1e3 * self.low:.2f} to {1e3 * self.high:.2f} ms, by {self.used} set points"


def computing_delay(effects: Sequence[Effect], period: float) -> ComputingDelay:
    """Returns the delay that agrees with the effect of every set point, for a controller with this period (s).

    Raises SpecError if there is none, or for too few or uninformative set points.
    """
    if len(effects) < FEWEST:
        raise SpecError(f"computing delay: {len(effects)} set points showed an effect, at least {FEWEST} are needed")
    first, last = _stored_within(effects, period)
    low, high = 0.0, period
    for one in effects:
        turn = round((sum(one.stored) / 2 - (first + last) / 2) / period) * period
        stored = max(one.stored[0], first + turn), min(one.stored[1], last + turn)
        low = max(low, stored[0] - period - one.written[1])
        high = min(high, stored[1] - one.written[0])
    if low >= high:
        raise SpecError(
            f"computing delay: the set points contradict each other (above {1e3 * low:.2f} ms, below "
            f"{1e3 * high:.2f} ms): the controller does not take set points at one time in its period"
        )
    if high - low > WIDEST_S:
        raise SpecError(
            f"computing delay: between {1e3 * low:.2f} and {1e3 * high:.2f} ms: this line, or a busy computer, "
            "is too slow for a better result; close other programs, or leave the step out with --skip delay"
        )
    return ComputingDelay(low, high, len(effects))


def _stored_within(effects: Sequence[Effect], period: float) -> tuple[float, float]:
    """Returns bounds (s) of the time at which results are stored, within the period of the best-known effect."""
    best = min((one.stored for one in effects), key=lambda bounds: bounds[1] - bounds[0])
    middle = sum(best) / 2
    low, high = best
    for one in effects:
        turn = round((sum(one.stored) / 2 - middle) / period) * period
        low, high = max(low, one.stored[0] - turn), min(high, one.stored[1] - turn)
    return (low, high) if low <= high else (high, low)  # crossed bounds: times that vary by as much


STEP = 2
"""Posture units by which the set point is moved: half a degree of a major axis, and 8 counts of its error."""
SHOWS = 4
"""Change of the error (ADC counts) between readings that only a new set point causes."""
TIMES = 36
"""Set points that are written."""
SETTLED_PERIODS = 12
"""Control periods between set points, in which the joint nearly comes to rest."""
GOLDEN = 0.618034
"""Share of a period by which each set point is later in its period than the previous one: they spread evenly."""
PATIENCE_PERIODS = 4
"""Control periods in which an effect must show."""
READINGS_A_PERIOD = 40
"""In lock-step, time passes only on request."""


def delay(bench: Bench) -> dict[str, Any]:
    """Measures the computing delay by set points at all phases of the period, and writes it into the machine file.

    A stop, Ctrl-C and every fault freeze the arm at its present posture; it returns to its first posture only after the
    last set point.
    """
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
    source = "measured from the taking of set points to the storing of results; the drive is assumed to change then"
    value, deviation = round(found.value, 6), round(found.deviation, 6)
    return Quantity(value=value, unit="s", source=source, low=0.0, deviation=deviation)


@dataclass
class _Watch:
    """Reads the low byte of a joint's error repeatedly."""

    controller: Controller
    arm: ControllerArm
    address: int
    joint: int
    period: float
    _missed: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        self._missed = self.controller.status().missed

    def effect(self, posture: int, phase: float) -> Effect | None:
        """Writes a set point at a phase of the period (0 to 1 from any time) and waits until the error shows it.

        None if it did not, or if the controller missed set points meanwhile.
        """
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
        """Returns the time (s)."""
        clock = self.controller.clock
        if isinstance(clock, LockStepClock):
            clock.synchronise()
        return clock.now()

    def _read(self) -> tuple[int, tuple[float, float]]:
        """Returns the byte, and bounds of the time when it was read."""
        begun = self._now()
        data = self.controller.link.request(ReadBlock(self.address, 1), Block).data
        return data[0], (begun, self._now())
