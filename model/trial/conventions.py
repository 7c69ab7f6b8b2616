"""Converts the mock's parameters to the model's conventions, so that stated intervals can be compared with the truth.

The two were written independently: they measure the same quantity from different zeros, with other signs or on the
other side of a gear. `TRANSLATIONS` converts effect by effect; `LEFT_OUT` lists parameters without a counterpart, and
why.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from daq.contracts.machine import DcMotor, Machine
from model.trial.truth import HiddenEffect, Truth

Values = Mapping[str, float]
Translation = Callable[[Values, int, Truth, Machine], dict[str, float]]


def _same(**names: str) -> Translation:
    """Returns translations of parameters that differ in name only, given as model=mock."""
    return lambda values, _joint, _truth, _machine: {ours: values[theirs] for ours, theirs in names.items()}


def _viscous(values: Values, joint: int, truth: Truth, machine: Machine) -> dict[str, float]:
    """Returns all of the joint's viscous friction, on the motor's side: the machine's with its deviation, plus c/n²."""
    stated = machine.joint(joint).friction.viscous_motor_side
    present = 0.0 if stated is None else stated.value * (1.0 + truth.deviations[f"viscous_friction_{joint}"])
    return {"coefficient": present + values["coefficient"] / _gear(machine, joint) ** 2}


def _viscous_difference(values: Values, joint: int, _truth: Truth, machine: Machine) -> dict[str, float]:
    """Returns the difference of the two directions on the motor's side, c/n²."""
    return {"difference": values["coefficient"] / _gear(machine, joint) ** 2}


def _load_dependent(values: Values, joint: int, truth: Truth, machine: Machine) -> dict[str, float]:
    """Returns the whole arm μ̃ of the joint: the machine's with its deviation, plus the added one."""
    stated = machine.joint(joint).friction.coulomb_arm
    present = 0.0 if stated is None else stated.value * (1.0 + truth.deviations[f"coulomb_arm_{joint}"])
    return {"arm": present + values["arm"]}


def _supply(values: Values, joint: int, _truth: Truth, machine: Machine) -> dict[str, float]:
    """Returns the voltage limit after the reduction."""
    limit = _motor(machine, joint).supply_limit
    return {} if limit is None else {"voltage": limit.value - values["reduction"]}


def _factor(values: Values, _joint: int, _truth: Truth, _machine: Machine) -> dict[str, float]:
    """Returns a factor as a relative error."""
    return {"relative": values["factor"] - 1.0}


def _tilt(values: Values, _joint: int, _truth: Truth, _machine: Machine) -> dict[str, float]:
    """Returns the tilt: the mock turns gravity; the model turns the base, and so gravity the other way."""
    return {"about_x": -values["about_x"], "about_y": -values["about_y"]}


TRANSLATIONS: dict[str, Translation] = {
    "viscous_friction": _viscous,
    "quadratic_drag": _same(coefficient="coefficient"),
    "coulomb_friction": _same(torque="torque"),
    "load_dependent_friction": _load_dependent,
    "gravity_torque_friction": _same(share="share"),
    "stribeck_friction": _same(torque="torque", speed="speed"),
    "direction_dependent_friction": _same(difference="torque"),
    "direction_dependent_viscous_friction": _viscous_difference,
    "weakened_magnet": _same(loss="loss"),
    "motor_inductance": _same(inductance="inductance"),
    "dead_zone": _same(width="width"),
    "amplifier_threshold": _same(width="width"),
    "supply_limit": _supply,
    "torque_ripple": _same(cycles="periods"),
    "gear_loss": _same(loss="loss"),
    "direction_dependent_gear_loss": _same(difference="difference"),
    "backlash": _same(gap="play"),
    "joint_compliance": _same(compliance="compliance"),
    "link_mass": _same(added="mass"),
    "centre_of_mass": _same(shift="shift"),
    "base_tilt": _tilt,
    "spring_torque": _same(stiffness="stiffness", rest="neutral"),
    "constant_torque": _same(torque="torque"),
    "one_sided_spring": _same(stiffness="stiffness", rest="slack"),
    "periodic_disturbance": _same(frequency="frequency"),
    "potentiometer_gain": _same(relative="error"),
    "potentiometer_offset": _same(offset="angle"),
    "input_delay": _same(time="delay"),
    "wrong_gain": _factor,
    "lost_set_points": _same(share="share"),
}
"""Translations by effect, from the mock's parameters to the parts of the model's effect."""

LEFT_OUT: dict[str, str] = {
    "stiction": "the mock's bond fades with speed, the model's breaks: their breakaway torques are not one quantity",
    "resistance_drift": "the mock's winding heats with its risen resistance, the model's with the cold one",
    "resistance_rise": "the rise begins with the mock there, with every record here",
    "payload": "the mock's load has its centre up to 8 cm off, the model's has not: the masses that fit best differ",
    "potentiometer_nonlinearity": "a loaded divider there, a sine series here",
    "torque_ripple: sine, cosine": "their phase is that of a reading that potentiometers bend by up to ±0.25 %",
    "periodic_disturbance: sine, cosine": "their phase counts from the mock's start there, from the record's here",
    "backlash: damping, contact": "how teeth meet: free here, with a prior, and only there to shape the contact",
    "joint_compliance: damping": "as that of backlash",
}
"""Effects, or parameters of effects, whose intervals are not counted, with the reason."""


def true_parameters(effect: HiddenEffect, joint: int | None, truth: Truth, machine: Machine) -> dict[str, float]:
    """Returns the truth at a joint by part of the model's effect; empty for effects in `LEFT_OUT`."""
    translation = TRANSLATIONS.get(effect.known_as)
    if translation is None:
        return {}
    found = translation(effect.at(joint), joint or 0, truth, machine)
    return {name: value for name, value in found.items() if math.isfinite(value)}


def _motor(machine: Machine, joint: int) -> DcMotor:
    drive = machine.joint(joint).drive
    assert isinstance(drive, DcMotor)
    return drive


def _gear(machine: Machine, joint: int) -> float:
    return _motor(machine, joint).gear_ratio.value
