"""Acts as the person at the arm: does with a mock what the procedure asks of a person."""

from __future__ import annotations

import json
import math
import socket
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol
from urllib.parse import urlsplit

from daq.contracts.errors import DaqError, SpecError
from daq.contracts.machine import Machine
from extras.commissioning.memory.procedure import Task

WIGGLE = ((35, 0.4), (-35, 0.7), (20, 0.5), (-12, 0.4), (0, 0.2))
"""Posture units from the present posture, and seconds to get there: slow, about the set point, for the power."""
SWEEP = ((60, 1.2), (940, 2.0))
"""Posture units, and seconds to get there: most of the range."""


IN_REAL_TIME = 2.5
"""Factor by which a mock's arm is led more slowly through its control port, where this computer may pause."""
PLACES = (0, 10, 5, 2, 8, 4, 6, 1, 9, 3, 7)
"""Postures for a protractor, in tenths of the range: the first of them span it."""


End = Literal["low", "high"]
"""An end stop."""


class MockArm(Protocol):
    """Actions of a person beside a mock."""

    def now(self) -> float:
        """Returns the mock's time in s."""

    def emergency_stop(self, *, pressed: bool) -> Mapping[int, float]:
        """Presses or releases the emergency stop; returns the joints' angles (degrees)."""

    def lead(self, to: Mapping[int, float | End], seconds: float) -> Mapping[int, float]:
        """Moves joints by hand to angles (degrees) or to an end stop; returns the angles."""

    def switch_off_and_on(self) -> None:
        """Interrupts the controller's supply."""

    def inputs(self, bits: int) -> None:
        """Switches process inputs."""


@dataclass
class MockOperator:
    """Carries out the tasks of a search on a mock.

    Postures are true angles in the stated calibration's units, since a person sees the arm, whatever its sensors read.
    """

    arm: MockArm
    machine: Machine
    slow: float = 1.0
    """Factor on all times of a movement."""
    tell: Callable[[str], None] = lambda _text: None
    """Receives the actions, and all texts for a person."""
    postures: dict[int, float] = field(default_factory=dict)
    _path: list[tuple[dict[int, float | End], float]] = field(default_factory=list)
    _until: float = 0.0
    _before: dict[int, float] = field(default_factory=dict)

    def may_begin(self, *, at_the_arm: bool, yes: bool) -> bool:
        """Always returns True."""
        del at_the_arm, yes
        return True

    def begin(self, task: Task) -> bool:
        """Begins a task; every task can be done."""
        self._path, self._until = [], self.arm.now()
        self.tell(f"    the mock's hand: {task.kind.replace('_', ' ')}{'' if task.joint is None else f' {task.joint}'}")
        if task.kind == "press_emergency_stop":
            held = self.arm.emergency_stop(pressed=True)
            self.postures = {joint: self._posture(joint, degrees) for joint, degrees in held.items()}
        elif task.kind == "release_emergency_stop":
            self.arm.emergency_stop(pressed=False)
        elif task.kind == "switch_off_and_on":
            self.arm.switch_off_and_on()
        elif task.kind == "start_as_usual":
            self.arm.emergency_stop(pressed=False)
            self.arm.switch_off_and_on()
        elif task.kind == "set_inputs":
            self.arm.inputs(task.inputs)
        elif task.kind == "place":
            self._path = [({joint: float(to) for joint, to in task.targets.items()}, 1.0)]
        elif task.joint is not None and task.joint in self.postures:
            self._path = self._led(task, task.joint)
        return True

    def _led(self, task: Task, joint: int) -> list[tuple[dict[int, float | End], float]]:
        """Returns the angles to which a joint is led, and times (s)."""
        here = self.postures[joint]
        if task.kind == "lead":
            centre = min(max(here, 60.0), 940.0)
            there: list[tuple[float | End, float]] = [(centre + by, seconds) for by, seconds in WIGGLE]
            return [({joint: to}, seconds) for to, seconds in [*there, *SWEEP, (here, 1.2)]]
        if task.kind == "push":
            return [({joint: here + (12 if here < 500 else -12)}, 0.5)]
        if task.kind == "end_stop":
            self._before[joint] = here
            return [({joint: "low"}, 2.0)]
        if task.kind == "other_end_stop":
            return [({joint: "high"}, 4.0)]
        return [({joint: self._before[joint]}, 2.0)] if task.kind == "bring_back" else []

    def finished(self) -> bool:
        """Continues with the next part of a movement when one is done."""
        if self.arm.now() < self._until:
            return False
        if not self._path:
            return True
        to, seconds = self._path.pop(0)
        seconds *= self.slow
        places = {joint: p if isinstance(p, str) else self._degrees(joint, p) for joint, p in to.items()}
        reached = self.arm.lead(places, seconds)
        self.postures |= {joint: self._posture(joint, degrees) for joint, degrees in reached.items()}
        self._until = self.arm.now() + seconds
        return False

    def read_angle(self, joint: int, number: int, wait: Callable[[float], None]) -> float | None:
        """Moves a joint by hand to posture `number` (from 1) of its range; returns the angle, read to half a degree."""
        to = 100.0 + 80.0 * PLACES[(number - 1) % len(PLACES)]
        self._path, self._until = [({joint: to}, 1.0)], self.arm.now()
        while not self.finished():
            wait(0.05)
        wait(0.2)
        return round(2 * self._degrees(joint, to)) / 2

    def show(self, text: str) -> None:
        """Passes the text on."""
        self.tell(text)

    def watch(self, postures: Mapping[int, int]) -> None:
        """Does nothing."""

    def _degrees(self, joint: int, posture: float) -> float:
        return math.degrees(self.machine.calibration(joint).posture_to_rad(posture))

    def _posture(self, joint: int, degrees: float) -> float:
        stated = self.machine.calibration(joint)
        return (math.radians(degrees) - stated.angle_at_zero_rad) / stated.rad_per_posture_unit


class MockRefusedError(DaqError):
    """The mock did not carry out a command."""


@contextmanager
def mock_operator(
    control: str, machine: Machine, tell: Callable[[str], None], *, lock_step: bool
) -> Iterator[MockOperator]:
    """Yields the stand-in at a mock's control port; it takes its time if the mock follows the clock. Raises SpecError.

    `tell` receives its actions.
    """
    arm = ControlPortArm(control)
    try:
        yield MockOperator(arm, machine, 1.0 if lock_step else IN_REAL_TIME, tell)
    finally:
        arm.close()


class ControlPortArm:
    """`MockArm` through a mock's control port, `tcp://HOST:PORT`."""

    def __init__(self, url: str) -> None:
        where = urlsplit(url)
        if where.scheme != "tcp" or where.hostname is None or where.port is None:
            raise SpecError(f"--mock-control {url!r}: write tcp://HOST:PORT, as the mock prints it")
        try:
            self._socket = socket.create_connection((where.hostname, where.port), timeout=10.0)
        except OSError as error:
            raise SpecError(f"--mock-control {url}: {error.strerror or error}") from error
        self._lines = self._socket.makefile("rb")

    def ask(self, command: str, **values: object) -> dict[str, Any]:
        """Returns the answer to one command. Raises MockRefusedError."""
        self._socket.sendall(json.dumps({"do": command, **values}).encode() + b"\n")
        line = self._lines.readline()
        answer: dict[str, Any] = json.loads(line) if line else {"ok": False, "error": "the mock has ended"}
        if not answer["ok"]:
            raise MockRefusedError(f"the mock refused {command}: {answer['error']}")
        return answer

    def now(self) -> float:
        """Returns the board's time in s."""
        return float(self.ask("state")["time_us"]) * 1e-6

    def emergency_stop(self, *, pressed: bool) -> Mapping[int, float]:
        """Presses or releases the emergency stop."""
        degrees = self.ask("emergency_stop", pressed=pressed)["degrees"]
        return {int(joint): float(angle) for joint, angle in degrees.items()}

    def lead(self, to: Mapping[int, float | End], seconds: float) -> Mapping[int, float]:
        """Moves joints by hand."""
        there = self.ask("hand", to={str(joint): place for joint, place in to.items()}, seconds=seconds)["to"]
        return {int(joint): float(angle) for joint, angle in there.items()}

    def switch_off_and_on(self) -> None:
        """Interrupts the controller's supply."""
        self.ask("brown_out")

    def inputs(self, bits: int) -> None:
        """Switches process inputs."""
        self.ask("inputs", bits=bits)

    def close(self) -> None:
        """Closes the connection."""
        self._lines.close()
        self._socket.close()
