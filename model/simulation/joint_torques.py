"""Torques on one joint other than rigid-body ones: motor, friction, and effects. Compiled.

Friction is described by z in [−1, 1], the deflection of an elastic, perfectly plastic contact. z follows the joint's
displacement over the presliding distance. It is clamped at ±1 (Prandtl), approaches ±1 asymptotically (Dahl), or
anything between. The torque is z times the level of friction. So a joint at rest holds a load without creeping, no step
is stiff near zero speed, and the derivative exists on both sides of every corner.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from model import layout as at
from model.arrays import Array
from model.drives.amplifier import back_emf_constant, torque_constant
from model.drives.piecewise import clamped, magnitude, outside
from model.dynamics.compilation import borrowing, inlined
from model.dynamics.dual import sin_cos
from model.dynamics.wide_numbers import exponential, where

RESTICK_SPEED = 1e-3
"""A sliding joint that is slower than this (rad/s, m/s) sticks again."""

SMALL_TURNS = 0.05
"""Ratio of a step to a winding's time constant below which its exponential is computed from a series."""

TWO_PI = 2.0 * np.pi

# Columns of the state of a joint.
POSITION, SPEED, DEFLECTION, STUCK, CURRENT, ROTOR_POSITION, ROTOR_SPEED, RISE = range(8)
STATE = 8


@inlined
def deflection(z: Any, displacement: Any, softness: Any, shape: Any) -> Any:
    """Returns z after a displacement x of one sign s: dz/dx = (1 − shape s z) · softness, clamped.

    `softness` is 1 / presliding distance; `shape` is 0 for Prandtl's law and 1 for Dahl's. The solution's exponential
    is replaced by 1 / (its series to the third power). That is never negative and is an equally good law of friction.
    """
    if shape == 0.0:
        return clamped(z + displacement * softness, 1.0 + 0.0 * z)
    x = magnitude(displacement) * softness
    y = shape * x
    rise = 1.0 + y * (0.5 + y * (1.0 / 6.0))
    kept = 1.0 / (1.0 + y * rise)
    gain = x * rise * kept
    return clamped(z * kept + where(displacement.real >= 0.0, gain, -gain), 1.0 + 0.0 * z)


@borrowing
def rubs_under_gravity(joints: Array) -> bool:
    """Whether the friction of any joint depends on its gravity torque."""
    found = False
    for j in range(joints.shape[0]):
        found = found or joints[j, at.GRAVITY_SHARE] != 0.0
    return found


@inlined
def motor_gain(joint: Array, rise: Any) -> Any:
    """Returns joint torque per volt (N·m/V), n K_T / R, for a winding warmed by `rise`."""
    return joint[at.GEAR] * torque_constant(joint) / (joint[at.RESISTANCE] * (1.0 + rise))


@inlined
def motor_damping(joint: Array, rise: Any) -> Any:
    """Returns joint torque per rad/s (N·m·s/rad): back-EMF through the winding, and viscous friction (7.30)."""
    electrical = torque_constant(joint) * back_emf_constant(joint) / (joint[at.RESISTANCE] * (1.0 + rise))
    return joint[at.GEAR] * joint[at.GEAR] * (electrical + joint[at.VISCOUS])


@inlined
def steady_current(joint: Array, rise: Any, volts: Any, speed: Any) -> Any:
    """Returns the steady-state current, A; `speed` is the joint's, on the motor's side of the transmission."""
    return (volts - back_emf_constant(joint) * joint[at.GEAR] * speed) / (joint[at.RESISTANCE] * (1.0 + rise))


@inlined
def winding_functions(x: Any) -> Any:
    """Returns φ1, φ2 and φ3 of −x, the functions of exponential integrators.

    φ1 is the mean of e^(−xs) over 0 ≤ s ≤ 1, φ2 the mean weighted by 1 − s, and φ3 that weighted by (1 − s)²/2. A
    series replaces them for small x, where differences would cancel.
    """
    small = x.real < SMALL_TURNS
    first = (1.0 - exponential(-x)) / x
    second = (1.0 - first) / x
    series = 1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0 - x * (1.0 / 720.0 - x / 5040.0)))
    third = where(small, series, (0.5 - second) / x)
    second = where(small, 0.5 - x * third, second)
    return where(small, 1.0 - x * second, first), second, third


@inlined
def stage_current(joint: Array, rise: Any, current: Any, volts: Any, begun: Any, speed: Any, stage: int, h: Any) -> Any:
    """Returns the current at a stage (0 to 3) of an RK4 step, so that the step's impulse and displacement are exact.

    The current's excess e over its steady state follows ė = −R/L e − d(steady state)/dt. The stages, of weights 1, 2,
    2, 1, get values with the first two moments of the exact solution for the mean change of speed since the step began
    (at `begun`). This holds for any ratio of L/R to the step; in a short step the values are those of the solution.
    """
    turns = joint[at.RESISTANCE] * (1.0 + rise) / joint[at.INDUCTANCE] * h
    first, second, third = winding_functions(turns)
    half = exponential(-0.5 * turns)
    before = steady_current(joint, rise, volts, begun)
    settled = steady_current(joint, rise, volts, speed)
    excess, change = current - before, before - settled
    if stage == 0:
        return settled + excess * (6.0 * second - 2.0 * half)
    if stage == 3:
        return settled + excess * (6.0 * (first - second) - 2.0 * half) + change * (6.0 * second - 12.0 * third)
    return settled + excess * half + change * 6.0 * third


@inlined
def current_after(joint: Array, rise: Any, current: Any, volts: Any, begun: Any, speed: Any, h: Any) -> Any:
    """Returns the current after a step of h s; exact if the speed changes linearly from `begun` to `speed`."""
    turns = joint[at.RESISTANCE] * (1.0 + rise) / joint[at.INDUCTANCE] * h
    first, _, _ = winding_functions(turns)
    before = steady_current(joint, rise, volts, begun)
    settled = steady_current(joint, rise, volts, speed)
    return settled + (current - before) * (1.0 - turns * first) + (before - settled) * first


@borrowing
def extra_torque(
    joint: Array, flags: int, time: complex, q: complex, speed: complex, z: complex, stuck: complex, through: complex
) -> Any:
    """Returns the joint torque of effects that most models lack, N·m; zero at their null values.

    `stuck` is 1 where the joint sticks, else 0. `through` is the torque that the gear transmits, at the joint: the
    motor's torque minus the viscous friction on the motor's side.
    """
    torque = 0.0 * (q + time + joint[at.COULOMB])
    if flags & at.HAS_STICTION:
        torque -= z * stuck * joint[at.BREAKAWAY]
    if joint[at.STRIBECK] != 0.0:
        torque -= z * joint[at.STRIBECK] * exponential(-magnitude(speed) / joint[at.STRIBECK_SPEED])
    if joint[at.DIRECTION] != 0.0:
        torque -= where(joint[at.DIRECTION].real * z.real > 0.0, magnitude(joint[at.DIRECTION]) * z, 0.0 * z)
    if joint[at.VISCOUS_DIRECTION] != 0.0:
        drag = joint[at.GEAR] * joint[at.GEAR] * magnitude(joint[at.VISCOUS_DIRECTION]) * speed
        torque -= where(joint[at.VISCOUS_DIRECTION].real * speed.real > 0.0, drag, 0.0 * drag)
    if joint[at.DRAG] != 0.0:
        torque -= joint[at.DRAG] * magnitude(speed) * speed
    if joint[at.GEAR_LOSS] != 0.0:
        torque -= z * joint[at.GEAR_LOSS] * magnitude(through)
    if joint[at.GEAR_LOSS_DIRECTION] != 0.0:
        loss = z * magnitude(joint[at.GEAR_LOSS_DIRECTION]) * magnitude(through)
        torque -= where(joint[at.GEAR_LOSS_DIRECTION].real * through.real * z.real > 0.0, loss, 0.0 * loss)
    if joint[at.RIPPLE_SINE] != 0.0 or joint[at.RIPPLE_COSINE] != 0.0:
        s, c = sin_cos(joint[at.RIPPLE_CYCLES] * q)
        torque += joint[at.RIPPLE_SINE] * s + joint[at.RIPPLE_COSINE] * c
    if joint[at.SPRING] != 0.0:
        torque -= joint[at.SPRING] * (q - joint[at.SPRING_REST])
    if joint[at.CABLE] != 0.0:
        pull = magnitude(joint[at.CABLE]) * (q - joint[at.CABLE_REST])
        torque -= where(joint[at.CABLE].real * (q - joint[at.CABLE_REST]).real > 0.0, pull, 0.0 * pull)
    torque += joint[at.CONSTANT_TORQUE]
    if joint[at.DISTURBANCE_SINE] != 0.0 or joint[at.DISTURBANCE_COSINE] != 0.0:
        s, c = sin_cos(TWO_PI * joint[at.DISTURBANCE_FREQUENCY] * time)
        torque += joint[at.DISTURBANCE_SINE] * s + joint[at.DISTURBANCE_COSINE] * c
    return torque


@inlined
def special_torque(
    joint: Array,
    flags: int,
    stage: int,
    time: Any,
    h: Any,
    q: Any,
    speed: Any,
    rotor_speed: Any,
    begun: Any,
    z: Any,
    state: Array,
    volts: Any,
) -> Any:
    """Returns the torque of inductance and added torques at a stage of a step of `h` s.

    `begun` is the rotor's speed at the beginning of the step.
    """
    steady = steady_current(joint, state[RISE], volts, rotor_speed)
    current = steady
    if flags & at.HAS_INDUCTANCE:
        current = stage_current(joint, state[RISE], state[CURRENT], volts, begun, rotor_speed, stage, h)
    to_torque = joint[at.GEAR] * torque_constant(joint)
    torque = to_torque * (current - steady)
    through = to_torque * current - joint[at.GEAR] * joint[at.GEAR] * joint[at.VISCOUS] * rotor_speed
    return torque + extra_torque(joint, flags, time, q, speed, z, state[STUCK], through)


@borrowing
def after_step(
    state: Array,
    joint: Array,
    flags: int,
    level: complex,
    rotor_speed: complex,
    change: complex,
    volts: complex,
    h: complex,
) -> None:
    """Updates current and sticking after a step.

    `rotor_speed` is the speed at its end, `change` the increase during the step.
    """
    if flags & at.HAS_INDUCTANCE:
        begun = rotor_speed - change
        state[CURRENT] = current_after(joint, state[RISE], state[CURRENT], volts, begun, rotor_speed, h)
    if flags & at.HAS_STICTION:
        still_stuck(joint, level, state[SPEED], state[DEFLECTION : DEFLECTION + 1], state[STUCK : STUCK + 1])


@borrowing
def still_stuck(joint: Array, level: complex, speed: complex, z: Array, stuck: Array) -> None:
    """Breaks away when the contact is fully stretched; sticks again when motion stops or reverses.

    The torque does not jump when it sticks: the contact takes the smaller deflection that carries it.
    """
    breaks = (stuck[0].real > 0.5) & (magnitude(z[0]).real >= 1.0)
    still = (magnitude(speed).real < RESTICK_SPEED) | (speed.real * z[0].real < 0.0)
    sticks = (stuck[0].real <= 0.5) & still
    most = level + joint[at.BREAKAWAY]
    z[0] = where(sticks & (most.real > 0.0), z[0] * level / most, z[0])
    stuck[0] = where(breaks, 0.0 * stuck[0], where(sticks, 1.0 + 0.0 * stuck[0], stuck[0]))


@inlined
def transmitted(joint: Array, twist: Any, twist_rate: Any) -> Any:
    """Returns the torque of a transmission with compliance and backlash, N·m. `twist`: rotor − link angle, rad at the
    joint.
    """
    stretched = outside(twist, 0.5 * joint[at.GAP])
    torque = (
        stretched / (joint[at.COMPLIANCE] + joint[at.CONTACT_COMPLIANCE]) + joint[at.TRANSMISSION_DAMPING] * twist_rate
    )
    # damping must not pull parts together that have separated
    return where(torque.real * stretched.real > 0.0, torque, 0.0 * torque)
