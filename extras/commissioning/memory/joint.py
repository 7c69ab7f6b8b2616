"""The registers of one joint, from everything that was recorded."""

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

LEAST_EPOCHS = 3
"""Least number of different set points by which the bytes of a set point are told from others."""
_SETTLED_STAGES: tuple[StageKind, ...] = ("power_up", "rest", "lead")


@dataclass(frozen=True)
class SetPointBytes:
    """What could be a joint's set point: offsets of low and of high bytes, by `postures` (posture units) in as many
    epochs."""

    low: tuple[int, ...]
    high: tuple[int, ...]
    postures: tuple[int, ...]

    @property
    def place(self) -> Place | None:
        """The only possible place; None where there are several, or none, or too few postures to tell."""
        if len(self.low) != 1 or len(self.high) != 1 or len(set(self.postures)) < LEAST_EPOCHS:
            return None
        return None if len({posture >> 8 for posture in self.postures}) < 2 else Place(self.low[0], self.high[0])


@dataclass(frozen=True)
class JointEvidence:
    """What the recording says about one joint. Each part is None where it is not clear; `lacks` says what to do."""

    joint: int
    pair: Pair | None
    power: PowerFit | None
    set_point: SetPointBytes | None
    lacks: str = ""


def joint_evidence(recording: Recording, joint: int) -> JointEvidence:
    """Position, error, power and set point of a joint."""
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
    lacks = "" if power else f"{len(fits)} powers are possible" if fits else "no byte is in proportion to its error"
    return JointEvidence(joint, pair, power, set_point_bytes(recording, joint, pair), lacks)


def set_point_bytes(recording: Recording, joint: int, pair: Pair) -> SetPointBytes | None:
    """Bytes that hold the set point in every epoch, and do not change within one."""
    low, high = np.ones(recording.size, bool), np.ones(recording.size, bool)
    postures = []
    for epoch in recording.epochs:
        stages = [stage for stage in recording.of_epoch(epoch) if stage.kind in _SETTLED_STAGES]
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
