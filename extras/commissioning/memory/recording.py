"""Readings of the whole shared memory, kept by the action during them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Pages = NDArray[np.uint8]
StageKind = Literal["rest", "lead", "power_up", "inputs"]


@dataclass(frozen=True)
class PageReading:
    """Every byte of the memory, read in blocks one after the other; `time_s` is the middle of the reading."""

    time_s: float
    data: bytes


@dataclass(frozen=True)
class Stage:
    """Readings during one action.

    kind:  rest, or a joint led by hand, or the rest after a power-up, or inputs switched
    joint: the joint that was led, or the number of the inputs that were on; None for all else
    power_cycle: number of power-ups before
    pages: (n, size)
    times: (n,) in s
    """

    kind: StageKind
    joint: int | None
    power_cycle: int
    pages: Pages
    times: NDArray[np.float64]

    @staticmethod
    def of(kind: StageKind, joint: int | None, power_cycle: int, readings: list[PageReading]) -> Stage:
        """Returns a stage with the readings as arrays."""
        pages = np.frombuffer(b"".join(r.data for r in readings), np.uint8).reshape(len(readings), -1)
        return Stage(kind, joint, power_cycle, pages, np.array([r.time_s for r in readings]))


@dataclass
class Recording:
    """All stages so far of a memory that begins at `base`."""

    base: int
    size: int
    period_s: float
    stages: list[Stage] = field(default_factory=list)

    def led(self, joint: int) -> list[Stage]:
        """Returns the stages in which a joint was led by hand."""
        return [stage for stage in self.stages if stage.kind == "lead" and stage.joint == joint]

    def undisturbed(self, joint: int) -> list[Stage]:
        """Returns the stages in which a joint rested."""
        return [stage for stage in self.stages if stage.joint != joint and stage.kind != "inputs"]

    @property
    def power_cycles(self) -> list[int]:
        """The power cycles, ascending."""
        return sorted({stage.power_cycle for stage in self.stages})

    def of_power_cycle(self, power_cycle: int) -> list[Stage]:
        """Returns the stages of a power cycle."""
        return [stage for stage in self.stages if stage.power_cycle == power_cycle]
