"""Chooses the parameters that a fit changes, with bounds and priors, and its nuisance parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine
from model import layout as at
from model.fitting.options import FitOptions, Prior
from model.fitting.phases import phase_unknowns
from model.fitting.records import Record, Signal
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter, initial_position, presliding, presliding_shape
from model.record_check.readings import sensor_deviation

BEND = "potentiometer_nonlinearity"
BEND_SHARE = 0.5
"""Standard deviation of a bend's first term as a share of the stated linearity. Later terms fall with one over their
number. The whole curve then stays within the linearity in about nine of ten cases.
"""
SLIDING_FRICTION = (
    "coulomb_friction",
    "load_dependent_friction",
    "gravity_torque_friction",
    "stribeck_friction",
    "direction_dependent_friction",
    "gear_loss",
    "direction_dependent_gear_loss",
    "stiction",
)
"""Effects whose torque builds up over the presliding distance."""
PRESLIDING_SHARE = 0.5
"""Standard deviation of the presliding distance as a share of the model's value: an assumption."""
SHAPE, SHAPE_DEVIATION = 0.5, 0.5
"""Expected shape of the rise of friction after a reversal, and its standard deviation. 0 is Prandtl's law and 1 is
Dahl's; either is equally likely.
"""


def chosen_unknowns(model: Model, options: FitOptions) -> tuple[Unknown, ...]:
    """Returns the parameters that the options select. Raises SpecError for a pattern without match or a wrong bound."""
    for name in (*options.bounds, *options.priors):
        model.parameter(name)
    expected = {
        p.name: p.value for p in Model(machine=model.machine, effects=model.effects, ties=model.ties).parameters
    }
    wanted = [p for p in model.parameters if _chosen(p, options)]
    for pattern in (*(options.parameters or ()), *options.held):
        if not any(fnmatchcase(p.name, pattern) for p in model.parameters):
            model.parameter(pattern)
    if not wanted:
        raise SpecError("nothing to fit: no parameter is selected; name some, or state their expected deviations")
    return tuple(_unknown(p, expected[p.name], options) for p in wanted)


def with_nuisances(
    model: Model, records: Sequence[Record], options: FitOptions, signal: Signal, first: int = 1
) -> tuple[Model, tuple[Unknown, ...]]:
    """Returns the model with everything that its nuisances need, and these: numbers that matter to records, and that
    neither a machine file states nor a model keeps. None for Nelder–Mead, which is the source's.

    first: index of the first record in which disturbances have a phase of their own, as in `phase_unknowns`.
    """
    if options.method == "nelder_mead":
        return model, ()
    wider, bends = with_bends(model, options, signal)
    forms = friction_forms(wider) if options.friction_form else ()
    phases = phase_unknowns(model, len(records), first)
    if not options.start_posture or signal != "position":
        return wider, (*bends, *forms, *phases)
    postures = start_postures(model.machine, records, any(use.name == BEND for use in wider.effects))
    return wider, (*bends, *forms, *postures, *phases)


def with_bends(model: Model, options: FitOptions, signal: Signal) -> tuple[Model, tuple[Unknown, ...]]:
    """Returns the model with bent potentiometers and the bends as nuisances; without bends, the model as given."""
    if options.sensor_bend is False or signal != "position":
        return model, ()
    taken = {j for use in model.effects if use.name == BEND for j in use.joints}
    joints = tuple(
        j
        for j in model.machine.modelled_joints
        if j not in taken and (options.sensor_bend or _linearity(model.machine, j))
    )
    if not joints:
        return model, ()
    wider = model.with_effect(BEND, joints)
    unknowns = []
    for p in wider.parameters:
        if p.effect == BEND and p.joints[0] in joints:
            number = at.BENDS.index(at.column(p.slots[0])) + 1
            if number > options.bend_terms:
                continue
            size = _linearity(model.machine, p.joints[0]) or 0.0025
            sensor = model.machine.joint(p.joints[0]).sensor
            range_ = 2 * math.pi if sensor is None else sensor.range.value
            deviation = BEND_SHARE * size * range_ / number
            unknowns.append(Unknown(p, 0.0, p.low, p.high, 0.0, deviation, nuisance=True))
    return wider, tuple(unknowns)


def start_postures(machine: Machine, records: Sequence[Record], bends: bool) -> tuple[Unknown, ...]:
    """Returns one unknown for each record and joint: the distance of the arm's start from the measured posture."""
    found = []
    for t in range(len(records)):
        for joint in machine.modelled_joints:
            sensor = machine.joint(joint).sensor
            if sensor is None or not sensor.count:
                continue
            bend = (_linearity(machine, joint) or 0.0) * sensor.range.value if bends else 0.0
            deviation = float(np.hypot(max(sensor_deviation(sensor), sensor.count), bend))
            limit = 20 * deviation
            start = initial_position(joint, t + 1)
            found.append(Unknown(start, 0.0, -limit, limit, 0.0, deviation, nuisance=True, trace=t))
    return tuple(found)


def friction_forms(model: Model) -> tuple[Unknown, ...]:
    """Returns nuisance parameters for the law of friction near zero speed.

    Each joint with sliding friction gets two: the distance over which friction builds up when motion starts or
    reverses, and the shape of that rise, between Prandtl's corner and Dahl's exponential. No machine file states
    either, the sensor hardly shows them, and laws of friction differ in them. Both have a small influence on every
    reversal.
    """
    joints = tuple(
        j
        for j in model.machine.modelled_joints
        if any(use.name in SLIDING_FRICTION and j in use.joints for use in model.effects)
    )
    found = []
    for joint in joints:
        start = float(model.vector[at.slot(joint, at.PRESLIDING)])
        deviation = PRESLIDING_SHARE * start
        distance, shape = presliding(joint, start), presliding_shape(joint, SHAPE)
        found.append(Unknown(distance, start, 0.05 * start, 10 * start, start, deviation, nuisance=True))
        found.append(Unknown(shape, SHAPE, 0.0, 1.0, SHAPE, SHAPE_DEVIATION, nuisance=True))
    return tuple(found)


def _linearity(machine: Machine, joint: int) -> float | None:
    sensor = machine.joint(joint).sensor
    return None if sensor is None or sensor.linearity is None else sensor.linearity.value


def _chosen(p: Parameter, options: FitOptions) -> bool:
    if any(fnmatchcase(p.name, pattern) for pattern in options.held):
        return False
    if options.parameters is not None:
        return any(fnmatchcase(p.name, pattern) for pattern in options.parameters)
    return p.deviation is not None and p.deviation > 0 and not p.sets_torque_scale


def _unknown(p: Parameter, expected: float, options: FitOptions) -> Unknown:
    low, high = options.bounds.get(p.name, (p.low, p.high))
    low, high = -math.inf if low is None else low, math.inf if high is None else high
    if not low < high:
        raise SpecError(f"{p.name}: lower bound {low:g} {p.unit} is not below the upper bound {high:g} {p.unit}")
    if low < p.low or high > p.high:
        raise SpecError(
            f"{p.name}: bounds {low:g} to {high:g} {p.unit} exceed the physical limits, {p.low:g} to {p.high:g}"
        )
    prior = Prior(expected=expected, deviation=p.deviation) if p.deviation else None
    prior = options.priors.get(p.name, prior if options.use_priors else None)
    if prior is None:
        return Unknown(p, p.value, low, high, p.value)
    return Unknown(p, p.value, low, high, prior.expected, prior.deviation)
