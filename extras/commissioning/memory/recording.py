"""Readings of the whole shared memory, kept by what was done to the arm meanwhile."""

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
    """Readings during which one thing was done.

    kind:  rest, or a joint led by hand, or the rest after the controller was switched on again, or inputs switched
    joint: the joint that was led, or the number of the inputs that were on; None for all else
    epoch: how often the controller had been switched on again before
    pages: (n, size)
    times: (n,) in s
    """

    kind: StageKind
    joint: int | None
    epoch: int
    pages: Pages
    times: NDArray[np.float64]

    @staticmethod
    def of(kind: StageKind, joint: int | None, epoch: int, readings: list[PageReading]) -> Stage:
        """The readings as arrays."""
        pages = np.frombuffer(b"".join(r.data for r in readings), np.uint8).reshape(len(readings), -1)
        return Stage(kind, joint, epoch, pages, np.array([r.time_s for r in readings]))


@dataclass
class Recording:
    """All stages so far of a memory that begins at `base`."""

    base: int
    size: int
    period_s: float
    stages: list[Stage] = field(default_factory=list)

    def led(self, joint: int) -> list[Stage]:
        """The stages in which a joint was led."""
        return [stage for stage in self.stages if stage.kind == "lead" and stage.joint == joint]

    def undisturbed(self, joint: int) -> list[Stage]:
        """The stages in which a joint rested."""
        return [stage for stage in self.stages if stage.joint != joint and stage.kind != "inputs"]

    @property
    def epochs(self) -> list[int]:
        """The epochs, ascending."""
        return sorted({stage.epoch for stage in self.stages})

    def of_epoch(self, epoch: int) -> list[Stage]:
        """The stages of an epoch."""
        return [stage for stage in self.stages if stage.epoch == epoch]
