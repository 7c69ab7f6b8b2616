"""A stand-in for the person at the arm: does with a mock what the procedure asks a person to do with a real arm."""

from __future__ import annotations

import json
import math
import socket
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol
from urllib.parse import urlsplit

from daq.commissioning.memory.procedure import Task
from daq.contracts.errors import DaqError, SpecError
from daq.contracts.machine import Machine
from firmware_protocol.memory_map import JOINTS

WIGGLE = ((35, 0.4), (-35, 0.7), (20, 0.5), (-12, 0.4), (0, 0.2))
"""Posture units from where the joint is, and seconds to get there: slow, about the set point, for the power."""
SWEEP = ((60, 1.2), (940, 2.0))
"""Posture units, and seconds to get there: most of the range."""


IN_REAL_TIME = 2.5
"""Factor by which a mock's arm is led more slowly through its control port, where this computer may pause."""
PLACES, PLACES_APART = 11, 3
"""Postures of a protractor over a joint's range, and from one to the next."""


class MockArm(Protocol):
    """What a mock offers to somebody who stands beside it."""

    def now(self) -> float:
        """Time in s, that of the mock."""

    def emergency_stop(self, *, pressed: bool) -> None:
        """Presses or releases it."""

    def lead(self, degrees: Mapping[int, float], seconds: float) -> None:
        """Moves joints by hand."""

    def wait(self, seconds: float) -> None:
        """Lets the mock's time pass."""

    def switch_off_and_on(self) -> None:
        """Interrupts the controller's supply."""

    def inputs(self, bits: int) -> None:
        """Switches process inputs."""


@dataclass
class MockOperator:
    """Carries out the tasks of a search on a mock that begins at `postures` (posture units)."""

    arm: MockArm
    machine: Machine
    slow: float = 1.0
    """Factor on all times of a movement."""
    postures: dict[int, float] = field(default_factory=lambda: dict.fromkeys(range(1, JOINTS + 1), 500.0))
    _path: list[tuple[dict[int, float], float]] = field(default_factory=list)
    _until: float = 0.0

    def may_begin(self, *, at_the_arm: bool, yes: bool) -> bool:
        """It always may."""
        del at_the_arm, yes
        return True

    def begin(self, task: Task) -> bool:
        """Begins a task; everything can be done."""
        self._path, self._until = [], self.arm.now()
        if task.kind == "press_emergency_stop":
            self.arm.emergency_stop(pressed=True)
        elif task.kind == "release_emergency_stop":
            self.arm.emergency_stop(pressed=False)
        elif task.kind == "switch_off_and_on":
            self.arm.switch_off_and_on()
        elif task.kind == "start_as_usual":
            self.arm.emergency_stop(pressed=False)
            self.arm.switch_off_and_on()
        elif task.kind == "set_inputs":
            self.arm.inputs(task.inputs)
        elif task.kind == "lead" and task.joint is not None:
            here = self.postures[task.joint]
            centre = min(max(here, 60.0), 940.0)
            self._path = [({task.joint: centre + by}, seconds) for by, seconds in WIGGLE]
            self._path += [({task.joint: to}, seconds) for to, seconds in SWEEP]
            self._path.append(({task.joint: here}, 1.2))
        elif task.kind == "push" and task.joint is not None:
            here = self.postures[task.joint]
            self._path = [({task.joint: here + (12 if here < 500 else -12)}, 0.5)]
        elif task.kind == "place":
            self._path = [({joint: float(to) for joint, to in task.targets.items()}, 1.0)]
        return True

    def finished(self) -> bool:
        """Goes on to the next part of a movement when one is done."""
        if self.arm.now() < self._until:
            return False
        if not self._path:
            return True
        to, seconds = self._path.pop(0)
        seconds *= self.slow
        self.postures |= to
        self.arm.lead({joint: self._degrees(joint, posture) for joint, posture in to.items()}, seconds)
        self._until = self.arm.now() + seconds
        return False

    def read_angle(self, joint: int, number: int) -> float | None:
        """Moves a joint by hand to posture `number` (from 1) of its range; the angle, read to half a degree."""
        to = 100.0 + 800.0 * ((number * PLACES_APART) % PLACES) / (PLACES - 1)
        self._path = [({joint: to}, 1.0)]
        while not self.finished():
            self.arm.wait(0.05)
        self.arm.wait(0.2)
        degrees = self._degrees(joint, to)
        offset = round(2 * degrees) / 2 - degrees
        self.arm.lead({joint: degrees + offset}, 0.1)
        self.arm.wait(0.3)
        return degrees + offset

    def show(self, text: str) -> None:
        """Nobody reads it."""

    def watch(self, postures: Mapping[int, int]) -> None:
        """Nobody looks."""

    def _degrees(self, joint: int, posture: float) -> float:
        return math.degrees(self.machine.calibration(joint).posture_to_rad(posture))


class MockRefusedError(DaqError):
    """The mock did not do what it was asked to."""


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
        """The answer to one command. Raises MockRefusedError."""
        self._socket.sendall(json.dumps({"do": command, **values}).encode() + b"\n")
        line = self._lines.readline()
        answer: dict[str, Any] = json.loads(line) if line else {"ok": False, "error": "it has ended"}
        if not answer["ok"]:
            raise MockRefusedError(f"the mock refused {command}: {answer['error']}")
        return answer

    def now(self) -> float:
        """The board's time in s."""
        return float(self.ask("state")["time_us"]) * 1e-6

    def wait(self, seconds: float) -> None:
        """Sleeps. Raises MockRefusedError for a mock in lock-step, whose time stands still meanwhile."""
        before = self.now()
        time.sleep(seconds)
        if self.now() == before:
            raise MockRefusedError("a mock in lock-step has no time of its own: start it without --lock-step")

    def postures(self) -> dict[int, float]:
        """Where its set points are (posture units)."""
        return {joint: float(posture) for joint, posture in enumerate(self.ask("state")["set_points"], start=1)}

    def emergency_stop(self, *, pressed: bool) -> None:
        """Presses or releases it."""
        self.ask("emergency_stop", pressed=pressed)

    def lead(self, degrees: Mapping[int, float], seconds: float) -> None:
        """Moves joints by hand."""
        self.ask("hand", to={str(joint): angle for joint, angle in degrees.items()}, seconds=seconds)

    def switch_off_and_on(self) -> None:
        """Interrupts the controller's supply."""
        self.ask("brown_out")

    def inputs(self, bits: int) -> None:
        """Switches process inputs."""
        self.ask("inputs", bits=bits)

    def close(self) -> None:
        """Ends the connection."""
        self._lines.close()
        self._socket.close()
