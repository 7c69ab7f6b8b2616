"""Converts a machine file's values to parameters, and computes sizes from them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from daq.contracts.machine import (
    BoardPid,
    Body,
    CurrentDrive,
    Cylinder,
    DcMotor,
    Joint,
    Machine,
    NoController,
    PlainGain,
    Rod,
    SampledPid,
    of_joint,
)
from daq.contracts.quantity import Quantity
from model import layout as at
from model.effects.effect import JointScale
from model.effects.transmission import contact_compliance
from model.machine_model.parameter import Kind, Parameter

NO_LIMIT = 1e9
"""Value in the vector for a limit that is not set."""
SENSOR_COUNTS = 4096
USUAL_DRIVE = 10.0
"""Size of a drive, in its unit, whose largest value is not stated: natural sizes only."""
PRESLIDING_COUNTS = 0.5
"""Distance, in counts of the sensor, over which friction builds up: an assumption, below the sensor's resolution."""


def parameter(
    component: str, kind: Kind, part: str, quantity: Quantity, slot: int, low: float = -math.inf
) -> Parameter:
    """Returns a parameter of the whole machine from a value of its file; `low` bounds it if the file does not."""
    return Parameter(
        name=f"{component}.{part}",
        kind=kind,
        component=component,
        part=part,
        unit=quantity.unit,
        value=quantity.value,
        source=quantity.source + (" (assumed)" if quantity.assumed else ""),
        slots=(slot,),
        low=low if quantity.low is None else quantity.low,
        high=math.inf if quantity.high is None else quantity.high,
        deviation=quantity.deviation,
    )


def base_parameters(machine: Machine) -> tuple[Parameter, ...]:
    """Returns parameters that every model of the machine has: geometry, inertia, motors, controller delay."""
    found = [p for number in machine.modelled_joints for p in _of_joint(number, machine.joint(number))]
    if machine.load is not None:
        found.append(parameter("load", Kind.INERTIA, "mass", machine.load, at.LOAD, 0.0))
    if not isinstance(machine.controller, NoController):
        found.append(parameter("controller", Kind.CONTROLLER, "delay", machine.controller.delay, at.DELAY, 0.0))
    return (*found, *_of_controller(machine))


def _of_controller(machine: Machine) -> Iterator[Parameter]:
    """Yields gains and limits of the controller, if the file states their deviations."""
    for number in machine.modelled_joints:
        numbers = (
            ("gain_error", gain_error(machine, number), at.GAIN_ERROR, -0.95),
            ("output_limit", output_limit(machine, number), at.OUTPUT_LIMIT, 0.0),
        )
        for part, stated, column, low in numbers:
            if stated is not None and stated.deviation is not None:
                own = parameter("controller", Kind.CONTROLLER, part, stated, at.slot(number, column), low)
                yield replace(own, name=f"joint{number}.controller.{part}", joints=(number,))


def gain_error(machine: Machine, number: int) -> Quantity | None:
    """Returns the relative error of the controller's gains on a joint (from 1), if the file states one."""
    controller = machine.controller
    if isinstance(controller, SampledPid):
        return of_joint(controller.gain_error, number)
    if not isinstance(controller, BoardPid) or controller.dac_counts_per_adc_count.deviation is None:
        return None
    stated = controller.dac_counts_per_adc_count
    sides = {s: getattr(stated, s) for s in ("low", "high")}
    relative = {s: None if v is None else v / stated.value - 1.0 for s, v in sides.items()}
    deviation = abs((stated.deviation or 0.0) / stated.value)
    return stated.model_copy(update={"value": 0.0, "unit": "1", "deviation": deviation, **relative})


def output_limit(machine: Machine, number: int) -> Quantity | None:
    """Returns the limit of the controller's output on a joint (from 1), if the file states one."""
    controller = machine.controller
    return of_joint(controller.output_limit, number) if isinstance(controller, SampledPid) else None


def _of_joint(number: int, joint: Joint) -> Iterator[Parameter]:
    for component, kind, part, quantity, column, low in (
        *_of_link(joint),
        *_of_drive(joint.drive),
        *_of_sensor(joint),
    ):
        own = parameter(component, kind, part, quantity, at.slot(number, column), low)
        place = f"link{number}" if component == "link" else f"joint{number}.{component}"
        yield replace(own, name=f"{place}.{part}", joints=(number,))


def _of_link(joint: Joint) -> Iterator[tuple[str, Kind, str, Quantity, int, float]]:
    """Yields arguments of `parameter`, with the joint's column in place of the slot."""
    geometry, link = joint.geometry, joint.link
    if geometry.a.value != 0.0:
        yield "link", Kind.GEOMETRY, "length", geometry.a, at.A, 0.0
    if geometry.d.value != 0.0:
        yield "link", Kind.GEOMETRY, "offset", geometry.d, at.D, -math.inf
    yield "link", Kind.INERTIA, "mass", link.mass, at.MASS, 0.0
    if isinstance(link, Cylinder):
        yield "link", Kind.GEOMETRY, "radius", link.radius, at.RADIUS, 0.0
    elif isinstance(link, Body):
        for axis, quantity in enumerate(link.centre):
            yield "link", Kind.INERTIA, f"centre_{'xyz'[axis]}", quantity, at.CENTRE_X + axis, -math.inf
        for k, entry in enumerate(("xx", "yy", "zz", "xy", "xz", "yz")):
            low = 0.0 if k < 3 else -math.inf
            yield "link", Kind.INERTIA, f"inertia_{entry}", link.inertia[k], at.INERTIA_XX + k, low


def _of_sensor(joint: Joint) -> Iterator[tuple[str, Kind, str, Quantity, int, float]]:
    """Yields the same for a sensor. A wrong zero turns (or shifts) the link against the reading of its sensor."""
    stated = None if joint.sensor is None else joint.sensor.at_zero
    if stated is None or stated.deviation is None:
        return
    own, column = (joint.geometry.theta, at.THETA) if joint.kind == "revolute" else (joint.geometry.d, at.D)
    shift = own.value - stated.value
    moved = {s: None if (v := getattr(stated, s)) is None else v + shift for s in ("low", "high")}
    zero = stated.model_copy(update={"value": own.value, **moved})
    yield "sensor", Kind.GEOMETRY, "zero", zero, column, -math.inf


def _of_drive(drive: DcMotor | CurrentDrive | PlainGain) -> Iterator[tuple[str, Kind, str, Quantity, int, float]]:
    """Yields arguments of `parameter`, with the joint's column in place of the slot."""
    if isinstance(drive, DcMotor):
        yield "motor", Kind.DRIVE, "resistance", drive.resistance, at.RESISTANCE, 1e-6
        yield "motor", Kind.DRIVE, "torque_constant", drive.torque_constant, at.TORQUE_CONSTANT, 1e-9
        yield "motor", Kind.DRIVE, "back_emf_constant", drive.back_emf_constant, at.BACK_EMF, 0.0
        yield "motor", Kind.INERTIA, "rotor_inertia", drive.rotor_inertia, at.ROTOR_INERTIA, 0.0
        if drive.gear_ratio.deviation is not None:
            yield "motor", Kind.DRIVE, "gear_ratio", drive.gear_ratio, at.GEAR, -math.inf
        if drive.supply_limit is not None and drive.supply_limit.deviation is not None:
            yield "motor", Kind.DRIVE, "supply_limit", drive.supply_limit, at.SUPPLY, 0.0
    elif isinstance(drive, CurrentDrive):
        yield "motor", Kind.DRIVE, "torque_constant", drive.torque_constant, at.TORQUE_CONSTANT, 1e-9
        if drive.rotor_inertia is not None:
            yield "motor", Kind.INERTIA, "rotor_inertia", drive.rotor_inertia, at.ROTOR_INERTIA, 0.0
        if drive.gear_ratio.deviation is not None:
            yield "motor", Kind.DRIVE, "gear_ratio", drive.gear_ratio, at.GEAR, -math.inf
    else:
        yield "drive", Kind.DRIVE, "gain", drive.gain, at.TORQUE_CONSTANT, -math.inf
        if drive.inertia is not None:
            yield "drive", Kind.INERTIA, "inertia", drive.inertia, at.ROTOR_INERTIA, 0.0


def nominal_vector(machine: Machine) -> NDArray[np.float64]:
    """Returns the flat vector of the machine file alone: every effect, friction included, at its null value."""
    n = len(machine.modelled_joints)
    vector = np.zeros(at.size(n))
    vector[at.GRAVITY_X : at.GRAVITY_Z + 1] = machine.gravity
    vector[at.LOAD] = 0.0 if machine.load is None else machine.load.value
    vector[at.PERIOD] = 0.0 if isinstance(machine.controller, NoController) else machine.controller.period.value
    vector[at.DELAY] = 0.0 if isinstance(machine.controller, NoController) else machine.controller.delay.value
    for number in machine.modelled_joints:
        _fill_joint(vector[at.slot(number, 0) : at.slot(number + 1, 0)], machine, number)
    return vector


def _fill_joint(row: NDArray[np.float64], machine: Machine, number: int) -> None:
    joint, scale = machine.joint(number), joint_scale(machine, number)
    geometry = joint.geometry
    row[at.A], row[at.ALPHA] = geometry.a.value, geometry.alpha.value
    row[at.D], row[at.THETA] = geometry.d.value, geometry.theta.value
    row[at.MASS] = joint.link.mass.value
    if isinstance(joint.link, Cylinder):
        row[at.RADIUS] = joint.link.radius.value
    elif isinstance(joint.link, Body):
        row[at.CENTRE_X : at.CENTRE_Z + 1] = [c.value for c in joint.link.centre]
        row[at.INERTIA_XX : at.INERTIA_YZ + 1] = [i.value for i in joint.link.inertia]
    row[at.SHAPE] = {"cylinder": at.CYLINDER, "rod": at.ROD, "body": at.BODY}[joint.link.shape]
    row[at.PRISMATIC] = float(joint.kind == "prismatic")
    _fill_drive(row, joint.drive)
    row[at.PRESLIDING] = PRESLIDING_COUNTS * scale.resolution
    row[at.STRIBECK_SPEED], row[at.COOLING_TIME], row[at.RIPPLE_CYCLES] = 1.0, 1.0, 1.0
    row[at.CONTACT_COMPLIANCE] = contact_compliance(scale)
    row[at.RANGE], row[at.RAD_PER_COUNT] = scale.range, 0.0
    limit, error = output_limit(machine, number), gain_error(machine, number)
    row[at.OUTPUT_LIMIT] = NO_LIMIT if limit is None else limit.value
    row[at.GAIN_ERROR] = 0.0 if error is None else error.value
    sensor = joint.sensor
    if sensor is not None:
        row[at.AT_ZERO] = sensor.at_zero.value
        row[at.RAD_PER_COUNT] = sensor.direction * sensor.count
        row[at.RANGE] *= sensor.direction
    if isinstance(machine.controller, BoardPid):
        row[at.VOLTS_PER_COUNT] *= machine.drive_sign(number)


def _fill_drive(row: NDArray[np.float64], drive: DcMotor | CurrentDrive | PlainGain) -> None:
    if isinstance(drive, DcMotor):
        row[at.RESISTANCE], row[at.INDUCTANCE] = drive.resistance.value, drive.inductance.value
        row[at.TORQUE_CONSTANT], row[at.BACK_EMF] = drive.torque_constant.value, drive.back_emf_constant.value
        row[at.ROTOR_INERTIA], row[at.GEAR] = drive.rotor_inertia.value, drive.gear_ratio.value
        row[at.VOLTS_PER_COUNT] = 1.0 if drive.dac_full_scale is None else drive.scale.counts_to_volts(1.0)
        row[at.SUPPLY] = NO_LIMIT if drive.supply_limit is None else drive.supply_limit.value
    else:
        row[at.RESISTANCE] = row[at.GEAR] = row[at.VOLTS_PER_COUNT] = 1.0
        row[at.INDUCTANCE] = 1e-3
        row[at.SUPPLY] = NO_LIMIT
        if isinstance(drive, CurrentDrive):
            row[at.TORQUE_CONSTANT], row[at.GEAR] = drive.torque_constant.value, drive.gear_ratio.value
            row[at.ROTOR_INERTIA] = 0.0 if drive.rotor_inertia is None else drive.rotor_inertia.value
        else:
            row[at.TORQUE_CONSTANT] = drive.gain.value
            row[at.ROTOR_INERTIA] = 0.0 if drive.inertia is None else drive.inertia.value


def joint_scale(machine: Machine, number: int) -> JointScale:
    """Returns natural sizes of a joint (from 1)."""
    joint = machine.joint(number)
    drive = joint.drive
    range_ = 2 * math.pi if joint.sensor is None else joint.sensor.range.value
    speed, supply, bounded = 0.0, NO_LIMIT, False
    if isinstance(drive, DcMotor):
        supply = NO_LIMIT if drive.supply_limit is None else drive.supply_limit.value
        bounded = math.isfinite(drive.highest)
        volts = drive.highest if bounded else USUAL_DRIVE
        gear = abs(drive.gear_ratio.value)
        torque = gear * drive.torque_constant.value * volts / drive.resistance.value
        if drive.back_emf_constant.value > 0:
            speed = volts / (drive.back_emf_constant.value * gear)
    else:
        gear = abs(drive.gear_ratio.value) if isinstance(drive, CurrentDrive) else 1.0
        gain = gear * drive.torque_constant.value if isinstance(drive, CurrentDrive) else drive.gain.value
        volts, torque = USUAL_DRIVE, abs(gain) * USUAL_DRIVE
    friction = joint.friction.viscous_motor_side or joint.friction.viscous
    controller = machine.controller
    return JointScale(
        torque=torque,
        volts=volts,
        strongest=torque if bounded else math.inf,
        highest=volts if bounded else math.inf,
        speed=speed or 1.0,
        fastest=speed if bounded and speed else math.inf,
        resolution=joint.count or range_ / SENSOR_COUNTS,
        range=range_,
        viscous=0.0 if friction is None else friction.value,
        inertia=_transmission_inertia(machine, number),
        period=0.02 if isinstance(controller, NoController) else controller.period.value,
        length=abs(joint.geometry.a.value) or _radius(joint),
        mass=joint.link.mass.value,
        supply=supply,
        gear=gear,
        resistance=drive.resistance.value if isinstance(drive, DcMotor) else 1.0,
    )


def is_rod_arm(machine: Machine) -> bool:
    """Whether the closed form and (7.32) to (7.34) describe this machine: waist, shoulder and elbow of rods."""
    joints = [machine.joint(j) for j in machine.modelled_joints]
    if len(joints) != 3 or any(j.kind != "revolute" for j in joints):
        return False
    right_angle = math.isclose(joints[0].geometry.alpha.value, math.pi / 2, abs_tol=1e-12)
    shapes = isinstance(joints[0].link, Cylinder) and all(isinstance(j.link, Rod) for j in joints[1:])
    return right_angle and joints[1].geometry.alpha.value == 0.0 and joints[0].geometry.a.value == 0.0 and shapes


def _radius(joint: Joint) -> float:
    return joint.link.radius.value if isinstance(joint.link, Cylinder) else 0.1


def _transmission_inertia(machine: Machine, number: int) -> float:
    """Returns the inertia of rotor and link in series (kg·m²), with the link's least inertia: its own bodies, the arm
    folded."""
    joint = machine.joint(number)
    link = joint.link
    own = link.mass.value
    if joint.kind == "revolute":
        if isinstance(link, Cylinder):
            own *= 0.5 * link.radius.value**2
        elif isinstance(link, Rod):
            own *= joint.geometry.a.value**2 / 3
        else:
            own = max(float(i.value) for i in link.inertia[:3]) or own * 0.01
    if number == machine.modelled_joints[-1] and machine.load is not None:
        own += machine.load.value * (joint.geometry.a.value**2 if joint.kind == "revolute" else 1.0)
    drive = joint.drive
    if isinstance(drive, PlainGain):
        rotor = 0.0 if drive.inertia is None else drive.inertia.value
    else:
        rotor = 0.0 if drive.rotor_inertia is None else drive.rotor_inertia.value * drive.gear_ratio.value**2
    both = [i for i in (own, rotor) if i > 0]
    if not both:
        raise SpecError(f"machine {machine.name}: joint {number} has no inertia: neither its link nor its drive")
    return both[0] * both[1] / (both[0] + both[1]) if len(both) == 2 else both[0]
