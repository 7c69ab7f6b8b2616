"""The parameters that an effect brings into a model, with bounds and deviations that suit the machine."""

from __future__ import annotations

from daq.contracts.machine import Friction, Machine
from daq.contracts.quantity import Quantity
from model.effects.effect import Effect, EffectParameter, JointScale, sized
from model.effects.library import effect
from model.machine_model import layout as at
from model.machine_model.nominal import joint_scale
from model.machine_model.parameter import Parameter


def effect_parameters(
    machine: Machine, name: str, joints: tuple[int, ...], shared: bool, beyond: int = 0
) -> tuple[Parameter, ...]:
    """Parameters of effect `name` on `joints`: one set a joint, or one set for all when `shared`.

    `beyond` columns of a joint are taken by effects of the user's own that come before this one.
    """
    kind = effect(name)
    if kind.whole_machine:
        scale = joint_scale(machine, machine.modelled_joints[-1])
        return tuple(
            _parameter(kind, p, f"{kind.group}.{name}", scale, (), (p.column,), None, "") for p in kind.parameters
        )
    groups = [joints] if shared else [(j,) for j in joints]
    found = []
    for group in groups:
        label = f"joint{group[0]}" if len(group) == 1 else "joints" + "+".join(str(j) for j in group)
        scale = joint_scale(machine, group[0])
        for p in kind.parameters:
            slots = tuple(at.slot(j, p.column + beyond) for j in group)
            known = _known(machine.joint(group[0]).friction, name, scale)
            found.append(
                _parameter(kind, p, f"{label}.{name}", scale, group, slots, known, machine.joint(group[0]).kind)
            )
    return tuple(found)


def _parameter(
    kind: Effect, p: EffectParameter, prefix: str, scale: JointScale, joints: tuple[int, ...], slots: tuple[int, ...],
    known: Quantity | None, joint_kind: str,
) -> Parameter:  # fmt: skip
    unit = p.unit.replace("N·m", "N").replace("rad", "m") if joint_kind == "prismatic" else p.unit
    null = None if p.null is None else sized(p.null, scale)
    if known is not None:
        low = sized(p.low, scale) if known.low is None else known.low
        high = sized(p.high, scale) if known.high is None else known.high
        deviation = sized(p.deviation, scale) if known.deviation is None else known.deviation
        return Parameter(
            f"{prefix}.{p.name}", unit, known.value, known.source, slots, low, high, null, deviation,
            kind.name, joints,
        )  # fmt: skip
    return Parameter(
        f"{prefix}.{p.name}", unit, p.starting_value(scale), p.source or kind.source, slots, sized(p.low, scale),
        sized(p.high, scale), null, sized(p.deviation, scale), kind.name, joints,
    )  # fmt: skip


def _known(friction: Friction, name: str, scale: JointScale) -> Quantity | None:
    """The machine file's own number for a friction effect, on the side and in the unit of the effect."""
    if name == "viscous_friction" and friction.viscous_motor_side is None and friction.viscous is not None:
        return _divided(friction.viscous, scale.gear**2)
    return {
        "viscous_friction": friction.viscous_motor_side,
        "coulomb_friction": friction.coulomb,
        "load_dependent_friction": friction.coulomb_arm,
    }.get(name)


def _divided(quantity: Quantity, by: float) -> Quantity:
    """A number of the joint's side seen from the motor's."""
    scaled = {n: getattr(quantity, n) for n in ("value", "low", "high", "deviation")}
    return quantity.model_copy(update={n: None if v is None else v / by for n, v in scaled.items()})
