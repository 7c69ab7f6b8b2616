"""Faults of the shared memory, the sensors, the arm and the supply."""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import ClassVar

from mock_controller.faults.fault import Count, Fault, FaultyParts, PartFault, parameter

_HELD_US = 10
"""Time (µs) for which the memory is held around a fetch."""


@dataclass(frozen=True, kw_only=True)
class BusyMemory(PartFault):
    """The shared memory is busy when the controller wants it: set points are missed in that period."""

    name: ClassVar[str] = "busy_memory"
    rate: float = parameter("probability per control period", 1.0, 0.0, 1.0)

    def each_period(self, parts: FaultyParts, dice: random.Random, count: Count) -> None:
        if dice.random() < self.rate:
            count()
            parts.board.hold_memory(_HELD_US)


@dataclass(frozen=True, kw_only=True)
class StuckPotentiometer(PartFault):
    """A joint's potentiometer keeps its last reading. Counted once per period."""

    name: ClassVar[str] = "stuck_potentiometer"
    joint: int = parameter("1 to 6", 1, 1, 6)

    def begin(self, parts: FaultyParts, dice: random.Random, count: Count) -> None:  # noqa: ARG002
        parts.board.sensors.stick(self.joint)

    def each_period(self, parts: FaultyParts, dice: random.Random, count: Count) -> None:  # noqa: ARG002
        count()

    def end(self, parts: FaultyParts) -> None:
        parts.board.sensors.repair(self.joint)


@dataclass(frozen=True, kw_only=True)
class NoisyPotentiometer(PartFault):
    """A worn potentiometer: a joint's readings scatter. Counted once per period."""

    name: ClassVar[str] = "noisy_potentiometer"
    joint: int = parameter("1 to 6", 1, 1, 6)
    counts: float = parameter("ADC counts rms", 20.0, 0.0, 4095.0)

    def begin(self, parts: FaultyParts, dice: random.Random, count: Count) -> None:  # noqa: ARG002
        parts.board.sensors.crackle(self.joint, self.counts)

    def each_period(self, parts: FaultyParts, dice: random.Random, count: Count) -> None:  # noqa: ARG002
        count()

    def end(self, parts: FaultyParts) -> None:
        parts.board.sensors.repair(self.joint)


@dataclass(frozen=True, kw_only=True)
class StalledJoint(PartFault):
    """A joint jams at its present angle."""

    name: ClassVar[str] = "stalled_joint"
    joint: int = parameter("1 to 6", 1, 1, 6)

    def begin(self, parts: FaultyParts, dice: random.Random, count: Count) -> None:  # noqa: ARG002
        count()
        parts.board.plant.stall(self.joint)

    def end(self, parts: FaultyParts) -> None:
        parts.board.plant.release(self.joint)


@dataclass(frozen=True, kw_only=True)
class BrownOut(PartFault):
    """The board's supply fails for a moment: it restarts with its defaults, and the arm does not move."""

    name: ClassVar[str] = "brown_out"
    duration: float = parameter("ignored: it happens once", 0.0, 0.0)

    def begin(self, parts: FaultyParts, dice: random.Random, count: Count) -> None:  # noqa: ARG002
        count()
        parts.board.brown_out()


# --- Faults of the connection as a whole


@dataclass(frozen=True, kw_only=True)
class Stall(Fault):
    """Silences the bridge: input and output wait until the stall ends."""

    name: ClassVar[str] = "stall"
    duration: float = parameter("s of board time that it lasts", 0.2, 0.0, 1e6)


@dataclass(frozen=True, kw_only=True)
class Disconnect(PartFault):
    """Cuts the line; it comes back."""

    name: ClassVar[str] = "disconnect"
    seconds: float = parameter("s of the host's clock until it is restored", 0.5, 0.0, 1e6)
    duration: float = parameter("ignored: `seconds` sets the end", 0.0, 0.0)

    def begin(self, parts: FaultyParts, dice: random.Random, count: Count) -> None:  # noqa: ARG002
        count()
        parts.disconnect(self.seconds)
