"""Estimates effect sizes from records, for a machine whose file does not state its largest drive.

A DC motor's file states the motor's limits. A plain gain only converts a recorded value to a torque, and the same
record may be in volts, milliamperes or newtons. Sizes derived from the unit would differ for each.
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
"""Largest torque of a drive, in root mean squares of the recorded one. Effects are expected to reach a few hundredths
of the largest torque, so friction becomes a fifth of the torque in the record."""


def recorded_sizes(model: Model, motions: Sequence[RecordedMotion]) -> dict[str, Parameter]:
    """Returns the effect parameters of joints with a plain gain, by name, with bounds and deviations from the records.

    Values that the machine file states are kept.
    """
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
    """Returns unknowns of a fit with priors from the records."""
    return tuple(
        replace(u, deviation=sizes[u.name].deviation) if u.name in sizes and u.deviation is not None else u
        for u in unknowns
    )


def _scale(model: Model, column: int, motions: Sequence[RecordedMotion]) -> JointScale:
    """Returns typical sizes of a joint whose drive is a plain gain."""
    drive = np.concatenate([m.drive[m.rows, column] for m in motions])
    return as_driven(model, column, drive, max(float(np.abs(m.speed[m.rows, column]).max()) for m in motions))


def as_driven(model: Model, column: int, drive: Floats, speed: float) -> JointScale:
    """Returns the same, from its recorded drive (k,) and a speed that it reaches, rad/s (m/s)."""
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
