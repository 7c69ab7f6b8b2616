"""Sizes that effects may have on a machine whose file does not say how far it is driven: taken from its records.

A DC motor's file states what its motor can give. A plain gain only turns a recorded number into a torque, and the same
record may hold volts, milliamperes or newtons: sizes that follow from the unit would be another answer in every unit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from daq.contracts.machine import PlainGain
from model import layout as at
from model.arrays import Floats
from model.effects.effect import JointScale
from model.fitting.unknowns import Unknown
from model.inverse_dynamics.recorded_motion import RecordedMotion
from model.machine_model.effect_parameters import effect_parameters
from model.machine_model.model import Model
from model.machine_model.nominal import joint_scale
from model.machine_model.parameter import Parameter

STRONGEST = 10.0
"""Largest torque of a drive, in root mean squares of the recorded ones. Effects are expected to be as large as a few
hundredths of the largest torque, so friction comes to a fifth of what the record's motion took."""


def recorded_sizes(model: Model, motions: Sequence[RecordedMotion]) -> dict[str, Parameter]:
    """The parameters of effects on joints with a plain gain, by name, with bounds and deviations as the records have
    them. What the machine file states of them stays."""
    scales = {
        joint: _scale(model, column, motions)
        for column, joint in enumerate(model.machine.modelled_joints)
        if isinstance(model.machine.joint(joint).drive, PlainGain)
    }
    own = model.by_name
    found = {}
    for use in model.effects:
        if not use.joints or not set(use.joints) & set(scales):
            continue
        for p in effect_parameters(model.machine, use.name, use.joints, use.shared, scales=scales):
            if p.name in own:
                found[p.name] = replace(own[p.name], low=p.low, high=p.high, deviation=p.deviation)
    return found


def with_recorded_sizes(unknowns: Sequence[Unknown], sizes: Mapping[str, Parameter]) -> tuple[Unknown, ...]:
    """Unknowns of a fit whose priors are those of the records."""
    return tuple(
        replace(u, deviation=sizes[u.name].deviation) if u.name in sizes and u.deviation is not None else u
        for u in unknowns
    )


def _scale(model: Model, column: int, motions: Sequence[RecordedMotion]) -> JointScale:
    """Natural sizes of a joint whose drive is a plain gain."""
    drive = np.concatenate([m.drive[m.rows, column] for m in motions])
    return as_driven(model, column, drive, max(float(np.abs(m.speed[m.rows, column]).max()) for m in motions))


def as_driven(model: Model, column: int, drive: Floats, speed: float) -> JointScale:
    """The same, from its recorded drive (k,) and a speed that it reaches, rad/s (m/s)."""
    joint = model.machine.modelled_joints[column]
    gain = abs(float(model.vector[at.slot(column + 1, at.TORQUE_CONSTANT)]))
    volts = STRONGEST * float(np.sqrt(np.mean(drive**2)))
    if not gain * volts > 0 or not speed > 0:
        return joint_scale(model.machine, joint)
    return replace(
        joint_scale(model.machine, joint),
        torque=gain * volts,
        volts=volts,
        strongest=math.inf,
        highest=math.inf,
        speed=speed,
        fastest=speed,
    )
