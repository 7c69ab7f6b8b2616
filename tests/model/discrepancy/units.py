"""The same machine and the same record, with the drive in a unit that many times smaller: V as mV, N as counts."""

from dataclasses import replace

from daq.contracts.machine import CurrentDrive, DcMotor, Joint, Machine, SampledPid, Sizes
from daq.contracts.quantity import Quantity
from daq.contracts.trace import Trace


def in_unit(machine: Machine, factor: float) -> Machine:
    """The machine as its lab would have written it with that unit."""
    controller = machine.controller
    if isinstance(controller, SampledPid):
        gains = tuple(tuple(factor * g for g in row) for row in controller.gains)
        update: dict[str, object] = {"gains": gains}
        if controller.velocity_gains is not None:
            update["gains"] = controller.gains
            update["velocity_gains"] = tuple(tuple(factor * g for g in row) for row in controller.velocity_gains)
        update["drive_resolution"] = _sizes(controller.drive_resolution, factor)
        update["output_limit"] = _sizes(controller.output_limit, factor)
        controller = controller.model_copy(update=update)
    joints = tuple(_joint(joint, factor) for joint in machine.joints)
    return machine.model_copy(update={"controller": controller, "joints": joints})


def recorded(trace: Trace, factor: float) -> Trace:
    """The record in that unit."""
    return replace(trace, drive=factor * trace.drive)


def times(quantity: Quantity, factor: float) -> Quantity:
    """A number with its bounds and deviation."""
    changed = {n: getattr(quantity, n) for n in ("value", "low", "high", "deviation")}
    return quantity.model_copy(update={n: None if v is None else factor * v for n, v in changed.items()})


def _sizes(sizes: Sizes | None, factor: float) -> Sizes | None:
    if sizes is None:
        return None
    return tuple(times(s, factor) for s in sizes) if isinstance(sizes, tuple) else times(sizes, factor)


def _joint(joint: Joint, factor: float) -> Joint:
    """Of a motor, all that is counted in volts: Ω and H are volts an ampere, and the magnet's is volts a rad/s."""
    drive = joint.drive
    if isinstance(drive, DcMotor):
        volts = ("resistance", "inductance", "back_emf_constant", "dac_full_scale", "supply_limit")
        stated = {name: getattr(drive, name) for name in volts}
        changed = {name: times(one, factor) for name, one in stated.items() if one is not None}
    elif isinstance(drive, CurrentDrive):
        changed = {"torque_constant": times(drive.torque_constant, 1 / factor)}
    else:
        changed = {"gain": times(drive.gain, 1 / factor)}
    return joint.model_copy(update={"drive": drive.model_copy(update=changed)})
