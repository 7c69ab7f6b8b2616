"""Dry friction of joints at rest or at a reversal: it takes any torque that holds them, up to its limit."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from model import layout as at
from model.arrays import Floats
from model.inverse_dynamics.link_motion import LinkMotion
from model.inverse_dynamics.readings import low_pass
from model.inverse_dynamics.recorded_motion import RecordedMotion

HOLDING_ROUNDS = 4
"""Rounds in which friction of a slow joint takes torque that remains below the cutoff. On a healthy rig, steps of a set
point left 2.4 times the noise without any round, 1.8 after two, and 1.7 after four."""


class RestingFriction(NamedTuple):
    """Friction torque where a joint hardly moves (k, n), N·m.

    sliding: its torque for the smoothed direction of motion, which the balance already contains. lowest, highest:
    limits of the torque while the joint is at rest; positive against backward motion.
    """

    sliding: Floats
    lowest: Floats
    highest: Floats

    def of_joint(self, joint: int) -> RestingFriction:
        """Returns the values of one joint (index), (k, 1) each."""
        return RestingFriction(*(part[:, joint : joint + 1] for part in self))


def friction_at_rest(level: Floats, motion: LinkMotion, joints: Floats) -> RestingFriction:
    """Returns the friction of joints (n, PER_JOINT) at rest or at a reversal.

    It includes Coulomb friction of a level (k, n), and direction-dependent, Stribeck and breakaway friction, but no
    losses of gears.
    """
    more, fading = joints[:, at.DIRECTION], joints[:, at.STRIBECK]
    speed = np.where(fading != 0.0, joints[:, at.STRIBECK_SPEED], 1.0)
    contact = motion.contact
    slow = fading * np.exp(-np.abs(motion.speed) / speed)
    one_way = np.where(more * contact > 0.0, np.abs(more), 0.0)
    standing = level + fading + joints[:, at.BREAKAWAY]
    return RestingFriction(
        sliding=-contact * (level + slow + one_way),
        lowest=-(standing + np.maximum(more, 0.0)),
        highest=standing + np.maximum(-more, 0.0),
    )


def subtract_held(left: Floats, friction: RestingFriction, record: RecordedMotion) -> Floats:
    """Subtracts from residual torque (k, n) the friction of joints at rest or at a reversal (`held_friction`)."""
    return subtract_friction(left, friction, record, held_friction(left, friction, record))


def held_friction(left: Floats, friction: RestingFriction, record: RecordedMotion) -> Floats:
    """Returns the friction (k, n) of joints at rest or at a reversal, for a residual torque (k, n); used there alone.

    There friction takes any torque that holds the joint, with a mean up to its level, in place of a share that follows
    the speed. The mean is over the whole passage. Sample by sample, friction would take the noise within its level and
    leave the rest: rectified noise, to the side to which the joint just turned. Friction then also takes what remains
    below the cutoff, as far as its level allows.
    """
    if not record.turns.any():
        return np.zeros_like(left)
    low, high = friction.lowest, friction.highest
    asked = record.mean_in_turn(left + friction.sliding)
    taken = np.clip(asked, low, high)
    for _ in range(HOLDING_ROUNDS if np.any(high > low) else 0):
        held = np.where(record.turns, asked - taken, left)
        before, taken = taken, np.clip(taken + low_pass(held, record.cutoff, record.period), low, high)
        if np.array_equal(before[record.turns], taken[record.turns]):
            break
    return np.asarray(taken)


def subtract_friction(left: Floats, friction: RestingFriction, record: RecordedMotion, taken: Floats) -> Floats:
    """Subtracts from residual torque (k, n) a friction (k, n) of joints at rest or at a reversal."""
    if not record.turns.any():
        return left
    return np.where(record.turns, record.mean_in_turn(left + friction.sliding) - taken, left)


def follow_limits(taken: Floats, before: RestingFriction, after: RestingFriction) -> Floats:
    """Returns a friction at rest (k, n) that stays as it is between its limits, and moves with those that it is at."""
    found = np.clip(taken, after.lowest, after.highest)
    found = np.where(taken >= before.highest, after.highest, found)
    return np.where(taken <= before.lowest, after.lowest, found)
