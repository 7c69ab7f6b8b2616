"""Parameters that an effect adds to a model, with bounds and deviations that suit the machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from daq.contracts.machine import DcMotor, Friction, Joint, Machine
from daq.contracts.quantity import Quantity
from model import layout as at
from model.effects.effect import Effect, EffectParameter, JointScale, evaluate_size
from model.effects.library import effect
from model.machine_model.nominal import joint_scale
from model.machine_model.parameter import Kind, Parameter
from model.units import sliding


def effect_parameters(
    machine: Machine,
    name: str,
    joints: tuple[int, ...],
    shared: bool,
    beyond: int = 0,
    scales: Mapping[int, JointScale] | None = None,
) -> tuple[Parameter, ...]:
    """Returns parameters of effect `name` on `joints`: one set per joint, or one set for all if `shared`.

    `beyond`: number of a joint's columns that earlier user effects occupy. `scales`: natural sizes of joints (from 1)
    that are known better than from the machine file.
    """
    known_scales = scales or {}
    kind = effect(name)
    if kind.whole_machine:
        scale = joint_scale(machine, machine.modelled_joints[-1])
        return tuple(
            replace(_parameter(kind, p, scale, kind.group), component=kind.group, slots=(p.column,))
            for p in kind.parameters
        )
    found = []
    for group in [joints] if shared else [(j,) for j in joints]:
        place = f"joint{group[0]}" if len(group) == 1 else "joints" + "+".join(str(j) for j in group)
        first = machine.joint(group[0])
        scale = known_scales.get(group[0]) or joint_scale(machine, group[0])
        known = _known(first.friction, name, scale)
        for p in kind.parameters:
            own = _parameter(kind, p, scale, place)
            if known is not None:
                own = _with_known(own, known)
            unit = _unit_on(first, own.unit)
            slots = tuple(at.slot(j, p.column + beyond) for j in group)
            found.append(replace(own, unit=unit, slots=slots, joints=group))
    return tuple(found)


def _unit_on(joint: Joint, unit: str) -> str:
    """Returns the unit of an effect's parameter on a joint.

    On a prismatic joint it is of lengths and forces; units of a motor's volts become those of the drive, if the file
    states them.
    """
    if unit == "V" and len(joint.drive_units) == 1:
        return joint.drive_units[0]
    return sliding(unit) if joint.kind == "prismatic" else unit


def suits_drive(machine: Machine, name: str, joint: int) -> bool:
    """Whether the file describes what the effect changes: winding and magnet exist only in a DC motor driven by
    volts."""
    kind = effect(name)
    of_motor = kind.file is None and kind.shared_name.family == "motor"
    return not of_motor or isinstance(machine.joint(joint).drive, DcMotor)


def _parameter(kind: Effect, p: EffectParameter, scale: JointScale, place: str) -> Parameter:
    """Returns the parameter at its starting value, not yet on a joint."""
    return Parameter(
        name=f"{place}.{kind.name}.{p.name}",
        kind=Kind.EFFECT,
        part=p.name,
        unit=p.unit,
        value=p.starting_value(scale),
        source=p.source or kind.source,
        low=evaluate_size(p.low, scale),
        high=evaluate_size(p.high, scale),
        null=None if p.null is None else evaluate_size(p.null, scale),
        deviation=evaluate_size(p.deviation, scale),
        effect=kind.name,
    )


def _with_known(p: Parameter, known: Quantity) -> Parameter:
    """Returns the parameter with the value in the machine file, and with the file's bounds and deviation."""
    return replace(
        p,
        value=known.value,
        source=known.source,
        low=p.low if known.low is None else known.low,
        high=p.high if known.high is None else known.high,
        deviation=p.deviation if known.deviation is None else known.deviation,
    )


def _known(friction: Friction, name: str, scale: JointScale) -> Quantity | None:
    """Returns the machine file's own value for a friction effect, in the effect's unit and on its side of the gear."""
    if name == "viscous_friction" and friction.viscous_motor_side is None and friction.viscous is not None:
        return _divided(friction.viscous, scale.gear**2)
    return {
        "viscous_friction": friction.viscous_motor_side,
        "coulomb_friction": friction.coulomb,
        "load_dependent_friction": friction.coulomb_arm,
    }.get(name)


def _divided(quantity: Quantity, by: float) -> Quantity:
    """Converts a quantity at the joint to the motor's side."""
    scaled = {n: getattr(quantity, n) for n in ("value", "low", "high", "deviation")}
    return quantity.model_copy(update={n: None if v is None else v / by for n, v in scaled.items()})
