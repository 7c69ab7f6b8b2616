"""Parameters of a true rig, as records that compiled code reads by name. SI units; at the joint's side."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Records = NDArray[Any]
"""Array of records."""

TANH, BRISTLE, SWITCH = 0, 1, 2
"""How dry friction changes its sign: smoothed, as bristles that bend (LuGre), or set-valued."""

EXPONENTIAL, GAUSSIAN, LORENTZIAN = 0, 1, 2
"""How Stribeck friction falls with the speed."""

LINEAR, BY_DIRECTION = 0, 2
"""Viscous friction; `drag` is an added term, quadratic in the speed."""

PRESSING_WEIGHT, GRAVITY_TORQUE = 0, 1
"""Load of load-dependent friction; friction by the transmitted torque is `gear_loss`."""

BOTH_WAYS, DRIVING_ONLY, WORSE_BACKWARDS = 0, 1, 2
"""Loss of a gear."""

OFFSET, JUMP, ROUNDED = 0, 1, 2
"""Dead zone: the excess passes; all of it passes outside; a rounded corner."""

SINE, OTHER_WAVE, TRIANGLE = 0, 1, 2
"""Waves of ripple (the second with a harmonic) and of disturbances (the second square)."""

STRAIGHT, HARDENING, ONE_SIDED = 0, 1, 2
"""Springs; a one-sided one pulls like a cable."""

HUNT_CROSSLEY = 2
"""Contact whose damping grows with its depth, in addition to STRAIGHT and HARDENING."""

ECCENTRIC, PARABOLA, CUBE = 0, 1, 2
"""Shape of a bent sensor's error over its range."""

BY_CURRENT, BY_TIME = 0, 1
"""Heat source of the winding."""

BOARD, PID, CASCADE = 0, 1, 2
"""Controllers."""

_MOTOR = ("resistance", "inductance", "torque_constant", "back_emf", "gear", "rotor", "supply")
_AMPLIFIER = ("dead_zone", "dead_law", "heating", "cooling_time", "heat_law", "current_rate", "nominal_constant")
_FRICTION = (
    *("contact", "sign_width", "bristle", "bristle_damping"),
    *("coulomb", "direction", "stribeck", "stribeck_speed", "stribeck_law", "breakaway", "dwell"),
    *("load_arm", "load_law", "gear_loss", "loss_law", "viscous", "viscous_law", "drag"),
    *("tight", "tight_at", "tight_width"),
)
_OUTSIDE = (
    *("ripple", "ripple_cycles", "ripple_phase", "ripple_law"),
    *("spring", "spring_rest", "spring_law"),
    *("disturbance", "disturbance_frequency", "disturbance_phase", "disturbance_law"),
)
_TRANSMISSION = ("flexible", "stiffness", "flexible_damping", "gap", "contact_law")
_SENSOR = ("count", "range", "at_zero", "sensor_gain", "sensor_offset", "bend", "bend_law")
_CONTROL = (
    *("p", "i", "d", "inner_p", "inner_i", "gain_error", "lost", "extra_delay"),
    *("limit", "resolution", "counts_to_volts", "dac_scale"),
)

JOINT = np.dtype(
    [
        (name, "f8")
        for group in (_MOTOR, _AMPLIFIER, _FRICTION, _OUTSIDE, _TRANSMISSION, _SENSOR, _CONTROL)
        for name in group
    ]
)
"""One joint. A law's number is written as a float. Zero means absent, except:

`current_rate` is the bandwidth of a current loop in rad/s (0: volts drive the motor), whose torque is scaled by
`nominal_constant`, its maker's assumed N·m at the joint per ampere; `rotor` is at the joint's side; `count` is the
sensor's in rad; `limit` and `resolution` are of the controller's output, before the amplifier.
"""

LOOP = np.dtype([("controller", "f8"), ("period", "f8"), ("delay", "f8"), ("step", "f8")])
"""The sampled loop, and the integration step in s."""


def joints(count: int) -> Records:
    """Returns joints without any effect; divisors are 1."""
    made = np.zeros(count, JOINT)
    for name in ("resistance", "gear", "stribeck_speed", "cooling_time", "tight_width", "counts_to_volts", "dac_scale"):
        made[name] = 1.0
    made["contact"] = SWITCH
    made["sign_width"] = made["dwell"] = 1e-3
    made["supply"] = made["limit"] = 1e9
    return made
