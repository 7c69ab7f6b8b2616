"""Free motions at random, and random changes of a motion: the candidates of a search. The same generator gives the same
motions."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from daq.contracts.machine import Machine, NoController
from model.arrays import Floats
from model.discrepancy.experiment_design.motions import LARGEST, STILL, Block, Motion, Way, room, within_limits

WAYS: tuple[Way, ...] = ("step", "ramp", "smooth")
MOST_LEVELS = 480
"""Most levels of a motion: two segments each, and an experiment holds a thousand."""
PACES: Mapping[Way, tuple[float, float]] = {"step": (0.04, 0.6), "ramp": (0.2, 2.5), "smooth": (1.0, 5.0)}
"""Shortest and longest time from level to level, s."""
SMALLEST: Mapping[Way, float] = {"step": math.radians(0.4), "ramp": math.radians(1.0), "smooth": math.radians(10.0)}
"""Least amplitude that is drawn, rad."""
RESTS = (0.0, 0.0, 0.3, 0.6)
"""Shares of the pace, drawn from these, that a move at constant speed leaves for a rest."""
AT_REST = 0.2
"""Share of the joints that a drawn block leaves at rest."""
MOST_CHANGES = 3
"""Most changes of a motion at a time."""
SWING = 0.5
"""Standard deviation of the logarithm by which an amplitude or a pace changes."""
NEARBY = math.radians(20.0)
"""Standard deviation of a small change of posture, rad."""


@dataclass(frozen=True)
class Drawer:
    """Draws motions of a machine that last no longer than `longest` s, with their moves there and back."""

    rng: np.random.Generator
    machine: Machine
    longest: float

    def first(self) -> tuple[Motion, ...]:
        """Motions like the presets, to begin with: fast small steps, ramps, slow reversals, a sweep."""
        n = self.count
        turns = np.where(np.arange(8)[:, None] % 2 == 0, 1.0, -1.0) * np.where(np.arange(n) % 2 == 0, 1.0, -1.0)
        blocks = (
            Block("step", np.full(n, math.radians(2.0)), 0.08, 0.0, self._levels("step", 120)),
            Block("ramp", np.full(n, math.radians(15.0)), 0.8, 0.4, turns),
            Block("ramp", np.full(n, math.radians(4.0)), 1.6, 0.0, turns),
            Block("smooth", np.full(n, math.radians(90.0)), 4.0, 0.0, self._levels("smooth", 3)),
        )
        return tuple(self._fitting(Motion(np.zeros(n), np.zeros(n, dtype=np.int64), (b,))) for b in blocks)

    def drawn(self) -> Motion:
        """A motion at random."""
        count = int(self.rng.integers(1, 3))
        lengths = self.rng.uniform(0.2, 1.0, count) * self.longest / count
        away, tuned = self.rng.random(2) < 0.5
        posture = self._posture() if away else np.zeros(self.count)
        change = self.rng.integers(-1, 2, self.count) * int(tuned)
        return self._fitting(Motion(posture, change, tuple(self._block(float(s)) for s in lengths)))

    def changed(self, motion: Motion, others: Sequence[Motion]) -> Motion:
        """The motion with one to three things changed at random; one of `others` may lend it its blocks."""
        for _ in range(int(self.rng.integers(1, MOST_CHANGES + 1))):
            kind = self.rng.random()
            if kind < 0.15:
                motion = replace(motion, posture=self._moved(motion.posture))
            elif kind < 0.25:
                change = motion.change.copy()
                change[int(self.rng.integers(self.count))] = int(self.rng.integers(-1, 2))
                motion = replace(motion, change=change)
            elif kind < 0.4:
                motion = replace(motion, blocks=self._regrouped(motion.blocks, others))
            else:
                at = int(self.rng.integers(len(motion.blocks)))
                ways: tuple[Callable[[Block], Block], ...] = (
                    self._resized,
                    self._resized,
                    self._paced,
                    self._shuffled,
                    self._cut,
                )
                block = ways[int(self.rng.integers(len(ways)))](motion.blocks[at])
                motion = replace(motion, blocks=tuple(block if k == at else b for k, b in enumerate(motion.blocks)))
        return self._fitting(motion)

    @property
    def count(self) -> int:
        """Joints that are moved."""
        return len(self.machine.modelled_joints)

    def _fitting(self, motion: Motion) -> Motion:
        """The motion within the limits, without what is too long."""
        blocks, time, levels = [], self.longest - motion.time_around, MOST_LEVELS
        for block in map(self._in_periods, motion.blocks):
            most = min(int(time / block.pace + 1e-9) - 1, levels)
            if most < 1:
                break
            blocks.append(replace(block, levels=block.levels[:most]))
            time, levels = time - blocks[-1].duration, levels - len(blocks[-1].levels)
        motion = replace(motion, blocks=tuple(blocks)) if blocks else self._at_rest(motion)
        return within_limits(motion, self.machine)

    def _in_periods(self, block: Block) -> Block:
        """The block with times that are whole control periods, so that a plan does not make them longer."""
        assert not isinstance(self.machine.controller, NoController)  # or no motion could be designed
        period = self.machine.controller.period.value
        pace = max(2, round(block.pace / period)) * period
        rest = round(block.rest * pace / period) * period / pace
        return replace(block, pace=pace, rest=rest)

    def _at_rest(self, motion: Motion) -> Motion:
        """A new short block in the place of blocks for which no time was left, at the rest posture."""
        return replace(motion, posture=np.zeros(self.count), blocks=(self._in_periods(self._block(self.longest / 2)),))

    def _block(self, duration: float) -> Block:
        way = WAYS[int(self.rng.integers(len(WAYS)))]
        low, high = PACES[way]
        pace = min(self._log(low, high), max(duration / 3, low))
        still = self.rng.random(self.count) < AT_REST
        still[int(self.rng.integers(self.count))] = False
        amplitude = np.array([self._amplitude(way) for _ in still])
        rest = float(self.rng.choice(RESTS)) if way == "ramp" else 0.0
        count = int(np.clip(duration / pace - 1, 1, MOST_LEVELS))
        return Block(way, np.where(still, 0.0, amplitude), pace, rest, self._levels(way, count))

    def _levels(self, way: Way, count: int) -> Floats:
        """(count, n): signs for steps, sizes between 0.3 and 1 with a sign for half of the others."""
        shape = (count, self.count)
        signs = self.rng.choice((-1.0, 1.0), shape)
        if way == "step":
            return signs
        return signs * np.where(self.rng.random(shape) < 0.5, 1.0, self.rng.uniform(0.3, 1.0, shape))

    def _posture(self) -> Floats:
        low, high = room(self.machine)
        return self.rng.uniform(0.2, 1.0) * self.rng.uniform(low, high)

    def _moved(self, posture: Floats) -> Floats:
        kind = self.rng.random()
        if kind < 0.25:
            return np.zeros(self.count)
        return self._posture() if kind < 0.5 else posture + self.rng.normal(0.0, NEARBY, self.count)

    def _regrouped(self, blocks: tuple[Block, ...], others: Sequence[Motion]) -> tuple[Block, ...]:
        """One block less, or those of another motion, or a new one before the others."""
        kind = self.rng.random()
        if len(blocks) > 1 and kind < 0.5:
            gone = int(self.rng.integers(len(blocks)))
            return tuple(b for k, b in enumerate(blocks) if k != gone)
        if others and kind < 0.75:
            return (*others[int(self.rng.integers(len(others)))].blocks, *blocks)
        return (self._block(0.4 * self.longest), *blocks)

    def _resized(self, block: Block) -> Block:
        """The amplitude of one joint, which may also come to rest or begin to move."""
        amplitude, joint = block.amplitude.copy(), int(self.rng.integers(self.count))
        if abs(amplitude[joint]) < STILL:
            amplitude[joint] = self._amplitude(block.way)
        else:
            amplitude[joint] *= 0.0 if self.rng.random() < AT_REST else math.exp(self.rng.normal(0.0, SWING))
        return replace(block, amplitude=amplitude)

    def _paced(self, block: Block) -> Block:
        low, high = PACES[block.way]
        pace = float(np.clip(block.pace * math.exp(self.rng.normal(0.0, SWING)), low, high))
        return replace(block, pace=pace)

    def _shuffled(self, block: Block) -> Block:
        """A third of the levels drawn anew."""
        new = self.rng.random(len(block.levels)) < 1 / 3
        return replace(block, levels=np.where(new[:, None], self._levels(block.way, len(new)), block.levels))

    def _cut(self, block: Block) -> Block:
        """Fewer levels, or more."""
        count = max(1, round(len(block.levels) * float(self.rng.uniform(0.5, 1.6))))
        more = self._levels(block.way, max(count - len(block.levels), 0))
        return replace(block, levels=np.concatenate([block.levels, more])[:count])

    def _amplitude(self, way: Way) -> float:
        return float(self.rng.choice((-1, 1))) * self._log(SMALLEST[way], LARGEST[way])

    def _log(self, low: float, high: float) -> float:
        return math.exp(float(self.rng.uniform(math.log(low), math.log(high))))
