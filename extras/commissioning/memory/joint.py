"""Finds the registers of one joint from a recording.

A stage is a series of readings during one action. A power cycle is the time between two power-ups. A pair is the
position and error registers of a joint. A joint is led when a person moves it by hand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from extras.commissioning.memory.bytes import constants, followers
from extras.commissioning.memory.recording import Recording, StageKind
from extras.commissioning.memory.relations import (
    SAME_PERIOD,
    JointStages,
    Pair,
    Place,
    PowerFit,
    newest_pair,
    pairs,
    position_of,
    posture_of,
    powers,
    stage_set_point,
)

LEAST_SET_POINTS = 3
"""Least number of different set points that identify the set-point bytes."""
_SETTLED_STAGES: tuple[StageKind, ...] = ("power_up", "rest", "lead")


@dataclass(frozen=True)
class SetPointBytes:
    """Candidates for a joint's set point.

    low, high: offsets of possible low and high bytes. postures: the set point (posture units) of each power cycle.
    """

    low: tuple[int, ...]
    high: tuple[int, ...]
    postures: tuple[int, ...]

    @property
    def place(self) -> Place | None:
        """The only possible place; None if there are several, or none, or too few postures to distinguish."""
        if len(self.low) != 1 or len(self.high) != 1 or len(set(self.postures)) < LEAST_SET_POINTS:
            return None
        # the high byte must have taken two values, or any byte that is constantly zero would match
        return None if len({posture >> 8 for posture in self.postures}) < 2 else Place(self.low[0], self.high[0])


@dataclass(frozen=True)
class JointEvidence:
    """Findings on one joint. Each part is None if it is not clear; `lacks` says what is missing."""

    joint: int
    pair: Pair | None
    power: PowerFit | None
    set_point: SetPointBytes | None
    lacks: str = ""


def joint_evidence(recording: Recording, joint: int) -> JointEvidence:
    """Returns position, error, power and set point of a joint."""
    if not recording.led(joint):
        return JointEvidence(joint, None, None, None, "it was not moved")
    stages = JointStages(recording, joint)
    follow = followers(recording, joint)
    candidates = pairs(stages, follow)
    pair = newest_pair(stages, candidates, recording.period_s)
    if pair is None:
        lacks = f"{len(candidates)} pairs of position and error are possible" if candidates else "no byte follows it"
        return JointEvidence(joint, None, None, None, lacks)
    rate = stages.rate(position_of(stages.pages, pair.position))
    limit = SAME_PERIOD * recording.period_s
    fits = [fit for fit in powers(stages, follow, pair, rate) if abs(fit.delay) <= limit]
    power = fits[0] if len(fits) == 1 else None
    lacks = "" if power else f"{len(fits)} powers are possible" if fits else "no byte is proportional to its error"
    return JointEvidence(joint, pair, power, set_point_bytes(recording, joint, pair), lacks)


def set_point_bytes(recording: Recording, joint: int, pair: Pair) -> SetPointBytes | None:
    """Returns the bytes that hold the set point in every power cycle, and do not change within one."""
    low, high = np.ones(recording.size, bool), np.ones(recording.size, bool)
    postures = []
    for power_cycle in recording.power_cycles:
        stages = [stage for stage in recording.of_power_cycle(power_cycle) if stage.kind in _SETTLED_STAGES]
        own = [stage for stage in stages if stage.joint in (joint, None)]
        posture = posture_of(stage_set_point(own, pair))
        if posture is None:
            return None
        postures.append(posture)
        held = constants(stages)
        low &= held == posture & 0xFF
        high &= held == posture >> 8
    taken = [offset for offset in (pair.position.low, pair.position.high, pair.error.low, pair.error.high) if offset]
    low[taken] = high[taken] = False
    return SetPointBytes(tuple(np.flatnonzero(low).tolist()), tuple(np.flatnonzero(high).tolist()), tuple(postures))
