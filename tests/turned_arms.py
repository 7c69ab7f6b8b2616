"""The MA2000 with other signs: sensors that count down, gears that turn the motion round, the arm in a mirror."""

import math

from daq.contracts.machine import DcMotor, Joint, Machine
from firmware_protocol.units import JointCalibration

AXES = (2 * math.pi, math.pi, 0.0)
"""Twice the angle (rad) of each joint's plane of symmetry: any does for the waist, the others' hold the vertical."""


def turned(machine: Machine, sensors: tuple[bool, ...] = (), gears: tuple[bool, ...] = ()) -> Machine:
    """The same arm with some sensors connected the other way round, and some gears that reverse."""
    joints = list(machine.joints)
    for k, turn in enumerate(sensors):
        joints[k] = with_turned_sensor(joints[k]) if turn else joints[k]
    for k, turn in enumerate(gears):
        joints[k] = with_turned_gear(joints[k]) if turn else joints[k]
    return machine.model_copy(update={"joints": tuple(joints)})


def with_turned_sensor(joint: Joint) -> Joint:
    """Its readings are 4096 less what they were, at the same angles."""
    sensor = joint.sensor
    assert sensor is not None
    zero = sensor.at_zero.model_copy(update={"value": sensor.at_zero.value + sensor.direction * sensor.range.value})
    return joint.model_copy(
        update={"sensor": sensor.model_copy(update={"direction": -sensor.direction, "at_zero": zero})}
    )


def with_turned_gear(joint: Joint) -> Joint:
    """Its motor turns the other way."""
    drive = joint.drive
    assert isinstance(drive, DcMotor)
    ratio = drive.gear_ratio.model_copy(update={"value": -drive.gear_ratio.value})
    return joint.model_copy(update={"drive": drive.model_copy(update={"gear_ratio": ratio})})


def mirrored(machine: Machine) -> Machine:
    """The arm seen in a mirror: sensors that count the other way, from the mirrored angle on."""
    joints = list(machine.joints)
    for k, axis in enumerate(AXES):
        sensor = joints[k].sensor
        assert sensor is not None
        zero = sensor.at_zero.model_copy(update={"value": axis - sensor.at_zero.value})
        own = sensor.model_copy(update={"direction": -sensor.direction, "at_zero": zero})
        joints[k] = joints[k].model_copy(update={"sensor": own})
    return machine.model_copy(update={"joints": tuple(joints)})


def with_sensors(machine: Machine, sensors: tuple[JointCalibration, ...]) -> Machine:
    """The machine with these sensors on its first joints."""
    joints = list(machine.joints)
    for k, own in enumerate(sensors):
        stated = joints[k].sensor
        assert stated is not None
        values = {"range": own.range_rad, "at_zero": own.angle_at_zero_rad}
        changed = {name: getattr(stated, name).model_copy(update={"value": value}) for name, value in values.items()}
        sensor = stated.model_copy(update={**changed, "direction": own.direction})
        joints[k] = joints[k].model_copy(update={"sensor": sensor})
    return machine.model_copy(update={"joints": tuple(joints)})
