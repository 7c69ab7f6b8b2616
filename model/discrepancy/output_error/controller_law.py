"""The law of a sampled PID or cascade, followed through a record of set points, positions and drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.contracts.machine import SampledPid, of_joint
from model.arrays import Floats

CLEAR = 4.0
"""Distance of a drive from what a set point makes of it, in resolutions, beyond which it was another set point: a drive
may be rounded more coarsely than a file tells, and then lies near what either of two set points makes."""

Memory = tuple[float, float, float, float, float]
"""What a controller remembers: sum and last of the errors, of the inner ones, position."""


@dataclass(frozen=True)
class Scale:
    """What a drive is of the one that the gains of the file form with empty integrators: `factor` times it, and `held`
    beside it, which the integrators held when the record began."""

    factor: float
    held: float


class ControllerLaw:
    """The law of one joint's controller, as `model.drives.controller` has it, period by period.

    winds_up: whether the error is summed at the output's limit as well, which the model's controller does not do and
    many others do.
    """

    def __init__(self, controller: SampledPid, joint: int, period: float, *, winds_up: bool) -> None:
        self.outer = controller.gains[joint - 1]
        inner = controller.velocity_gains
        self.inner = None if inner is None else inner[joint - 1]
        band = of_joint(controller.dead_band, joint)
        self.dead_band = -1.0 if band is None else band.value
        self.period = period
        self.winds_up = winds_up

    @property
    def integrates(self) -> bool:
        """Whether the controller sums up errors, of which a record does not hold the beginning."""
        return self._summed != 0.0

    @property
    def _summed(self) -> float:
        """I of the loop that forms the drive."""
        return (self.outer if self.inner is None else self.inner)[1]

    def follow(
        self, sent: Floats, position: Floats, drive: Floats, limited: NDArray[np.bool_], scale: Scale, line: float
    ) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Set points in use, the drive that the gains make of them, and where one was clearly lost.

        A set point counts as lost where the drive is further than `line` from what it would make, and nearer to what
        the one before makes; as clearly lost where it is further than `CLEAR` times that, and at what the one before
        makes.

        Args:
            sent, position: (k,) rad. drive: (k,) as recorded. limited: (k,) whether it is at its limit.
            scale: what the drive is of the one that the gains make. line: in the drive's unit.
        """
        used, formed, clear = np.empty_like(sent), np.empty_like(sent), np.zeros(len(sent), dtype=bool)
        factor = scale.factor
        memory = self._begin(float(sent[0] - position[0]), float(position[0]), scale)
        for k in range(len(sent)):
            wanted = float(sent[k])
            output, after = self._output(wanted - position[k], float(position[k]), memory)
            miss = abs(drive[k] - factor * output)
            if k > 0 and not limited[k] and miss > line:
                other, held = self._output(used[k - 1] - position[k], float(position[k]), memory)
                left = abs(drive[k] - factor * other)
                clear[k] = miss > CLEAR * line and left <= line
                if left < 0.5 * miss:
                    wanted, output, after = float(used[k - 1]), other, held
            used[k], formed[k] = wanted, output
            memory = self._kept(memory, after, limited=bool(limited[k]))
        return used, formed, clear

    def _kept(self, before: Memory, after: Memory, *, limited: bool) -> Memory:
        """What the controller remembers of a period: at its limit not the error, unless it winds up."""
        return (before[0], *after[1:]) if limited and not self.winds_up else after

    def _begin(self, error: float, position: float, scale: Scale) -> Memory:
        """What the controller remembers before the first sample, whose error and position these are."""
        total = scale.held / (scale.factor * self._summed) if self.integrates else 0.0
        totals = (total, 0.0) if self.inner is None else (0.0, total)
        return totals[0], error, totals[1], 0.0, position

    def _output(self, error: float, position: float, memory: Memory) -> tuple[float, Memory]:
        """The output for an error, and the memory after it: sum and last of the errors, of the inner ones, position."""
        total, last, inner_total, inner_last, before = memory
        p, i, d = self.outer
        error = 0.0 if abs(error) <= self.dead_band else error
        total += error * self.period
        output = p * error + i * total + d * (error - last) / self.period
        if self.inner is None:
            return output, (total, error, inner_total, inner_last, position)
        p, i, d = self.inner
        inner = output - (position - before) / self.period
        inner_total += inner * self.period
        output = p * inner + i * inner_total + d * (inner - inner_last) / self.period
        return output, (total, error, inner_total, inner, position)
