"""The laws of the rigs, as scalar formulae; `p` is a record of `parameters.JOINT`."""

from __future__ import annotations

import math
from typing import Any

from numba import njit

from trials.rigs.parameters import (
    BY_DIRECTION,
    CUBE,
    DRIVING_ONLY,
    ECCENTRIC,
    EXPONENTIAL,
    GAUSSIAN,
    HARDENING,
    HUNT_CROSSLEY,
    JUMP,
    LORENTZIAN,
    OFFSET,
    ONE_SIDED,
    OTHER_WAVE,
    SINE,
    WORSE_BACKWARDS,
)

compiled = njit(cache=True, error_model="numpy")

DIRECTION_SHARE = 0.35
"""Viscous friction by direction is this share larger forwards and smaller backwards."""
HARDENING_ANGLE = 0.5
"""rad at which a hardening spring is twice as stiff."""
HARDENING_GIVE = 0.01
"""Deflection, rad, at which a hardening transmission is twice as stiff."""
HUNT_DAMPING = 0.5
"""s/rad: damping of a Hunt and Crossley contact over its elastic force."""


@compiled
def viscous_torque(speed: float, p: Any) -> float:
    """Returns linear viscous torque, or with another coefficient for each direction; plus quadratic drag."""
    share = 1.0
    if p.viscous_law == BY_DIRECTION:
        share += DIRECTION_SHARE if speed > 0.0 else -DIRECTION_SHARE
    return -(p.viscous * share + p.drag * abs(speed)) * speed


@compiled
def stribeck_share(speed: float, width: float, law: float) -> float:
    """Returns the share of Stribeck friction that remains at a speed."""
    ratio = abs(speed) / width
    if law == EXPONENTIAL:
        return math.exp(-ratio)
    if law == GAUSSIAN:
        return math.exp(-ratio * ratio)
    if law == LORENTZIAN:
        return 1.0 / (1.0 + ratio * ratio)
    return math.nan


@compiled
def loss_level(transmitted: float, speed: float, p: Any) -> float:
    """Returns the friction of a gear under the torque that it transmits."""
    level = p.gear_loss * abs(transmitted)
    backwards = transmitted * speed < 0.0
    if p.loss_law == DRIVING_ONLY and backwards:
        return 0.0
    if p.loss_law == WORSE_BACKWARDS and backwards:
        return 2.0 * level
    return level


@compiled
def sliding_level(angle: float, speed: float, load: float, transmitted: float, p: Any) -> float:
    """Returns dry friction of a sliding joint, N·m; `load` is the multiplier of load-dependent friction, times its
    arm."""
    level = p.coulomb + load + loss_level(transmitted, speed, p)
    if p.direction * speed > 0.0:
        level += abs(p.direction)
    if p.stribeck != 0.0:
        level += p.stribeck * stribeck_share(speed, p.stribeck_speed, p.stribeck_law)
    if p.tight != 0.0:
        away = (angle - p.tight_at) / p.tight_width
        level += p.tight * math.exp(-0.5 * away * away)
    return max(level, 0.0)


@compiled
def bristles(z: float, speed: float, level: float, stiffness: float, step: float) -> float:
    """Returns the deflection of LuGre's bristles after a step: dz/dt = v − σ0 |v| z/g, solved at constant speed."""
    if level <= 0.0:
        return 0.0
    settled = math.copysign(level / stiffness, speed)
    return settled + (z - settled) * math.exp(-stiffness * abs(speed) * step / level)


@compiled
def wave(phase: float, law: float, square: bool) -> float:
    """Returns a wave of amplitude 1: sine; sine with a second harmonic, or square; triangle."""
    if law == SINE:
        return math.sin(phase)
    if law == OTHER_WAVE:
        return math.copysign(1.0, math.sin(phase)) if square else math.sin(phase) + 0.3 * math.sin(2.0 * phase + 1.0)
    return 2.0 / math.pi * math.asin(math.sin(phase))


@compiled
def spring_torque(angle: float, p: Any) -> float:
    """Returns the torque of a spring at the joint: straight, hardening, or a cable that only pulls one way."""
    stretch = angle - p.spring_rest
    if p.spring_law == HARDENING:
        return -p.spring * stretch * (1.0 + (stretch / HARDENING_ANGLE) ** 2)
    if p.spring_law == ONE_SIDED:
        return -p.spring * max(stretch, 0.0)
    return -p.spring * stretch


@compiled
def outside_torque(time: float, angle: float, p: Any) -> float:
    """Returns the torque of spring, ripple and disturbance."""
    torque = spring_torque(angle, p) if p.spring != 0.0 else 0.0
    if p.ripple != 0.0:
        torque += p.ripple * wave(p.ripple_cycles * angle + p.ripple_phase, p.ripple_law, False)
    if p.disturbance != 0.0:
        phase = 2.0 * math.pi * p.disturbance_frequency * time + p.disturbance_phase
        torque += p.disturbance * wave(phase, p.disturbance_law, True)
    return torque


@compiled
def transmitted_torque(give: float, rate: float, p: Any) -> float:
    """Returns the torque of a flexible gear with deflection `give` (motor − joint, rad); none inside its gap; contacts
    only press."""
    half = 0.5 * p.gap
    depth = give - half if give > half else (give + half if give < -half else 0.0)
    if depth == 0.0 and p.gap > 0.0:
        return 0.0
    if p.contact_law == HUNT_CROSSLEY:
        return p.stiffness * depth * max(0.0, 1.0 + HUNT_DAMPING * rate * math.copysign(1.0, depth))
    elastic = p.stiffness * depth
    if p.contact_law == HARDENING:
        elastic *= 1.0 + (depth / HARDENING_GIVE) ** 2
    torque = elastic + p.flexible_damping * rate
    if p.gap > 0.0 and torque * depth < 0.0:
        return 0.0
    return torque


@compiled
def amplified(command: float, p: Any) -> float:
    """Returns volts at the motor: dead zone, then the supply's limit."""
    size, width = abs(command), p.dead_zone
    if width > 0.0:
        if p.dead_law == OFFSET:
            size = max(0.0, size - width)
        elif p.dead_law == JUMP:
            size = size if size > width else 0.0
        else:
            size = math.sqrt(size * size + width * width) - width
    return math.copysign(min(size, p.supply), command)


@compiled
def sensed(angle: float, p: Any) -> float:
    """Returns a sensor's angle before noise and rounding: scale about the middle of its range, shift, bend."""
    x = (angle - p.at_zero) / p.range - 0.5
    reported = angle + p.sensor_gain * x * p.range + p.sensor_offset
    if p.bend_law == ECCENTRIC:
        return reported + p.bend * math.sin(2.0 * math.pi * x + 0.7)
    if p.bend_law == CUBE:
        return reported + p.bend * (20.0 * x * x * x - 3.0 * x)
    return reported + p.bend * (1.0 - 8.0 * x * x)
