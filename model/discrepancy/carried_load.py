"""A load that a user states for the arm: the model with this load, and whether the motors could hold it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from daq.contracts.carried_load import carrying
from daq.contracts.errors import SpecError
from daq.contracts.machine import DcMotor, Machine

if TYPE_CHECKING:
    from daq.contracts.trace import Trace
    from model.machine_model.model import Model

ROOM = 2.0
"""Largest torque of gravity that a joint is taken to hold, in stall torques of its motor. More than 1, because friction
and the gear hold some of it, and supply limits are often assumed."""


def with_load(model: Model, kilograms: float) -> Model:
    """The model of the same machine with another load at its end. Raises SpecError as `carrying` does."""
    from model.machine_model.model import Model

    machine = carrying(model.machine, kilograms, "given with --load")
    values = {name: value for name, value in model.values.items() if name != "load.mass"}
    fields = {name: getattr(model, name) for name in type(model).model_fields}
    return Model(**{**fields, "machine": machine, "values": values})


def require_load_held(model: Model, traces: Sequence[Trace]) -> None:
    """Raises SpecError where gravity asks more of a joint, somewhere along the traces, than its motor could ever hold.

    A machine whose file limits no supply, or has another drive than a motor, is taken to hold anything.
    """
    import numpy as np

    from model import layout as at
    from model.inverse_dynamics.supplied_torque import gravity_along
    from model.simulation.bodies import chain_body

    joints = np.ascontiguousarray(model.vector[at.SHARED :].reshape(model.joint_count, at.PER_JOINT))
    chain = chain_body(np.ascontiguousarray(model.vector[: at.SHARED]), joints, model.flags)
    for trace in traces:
        columns = [trace.column(j) for j in model.machine.modelled_joints]
        position = np.ascontiguousarray(trace.position[:, columns])
        torques = np.empty_like(position)
        gravity_along(chain, position, torques)
        for joint, needed in zip(model.machine.modelled_joints, np.abs(torques).max(axis=0), strict=True):
            most = _stall_torque(model.machine, joint)
            if most is not None and needed > ROOM * most:
                raise SpecError(
                    f"load {model.machine.load.value if model.machine.load else 0.0:g} kg: joint {joint} would need "
                    f"{needed:.0f} N·m to hold it in these traces, and its motor gives {most:.0f} N·m at most"
                )


def _stall_torque(machine: Machine, joint: int) -> float | None:
    """Torque of a motor at rest under its full supply, N·m at the joint; None where no supply limits it."""
    drive = machine.joint(joint).drive
    if not isinstance(drive, DcMotor) or drive.supply_limit is None:
        return None
    stall = drive.supply_limit.value / drive.resistance.value * drive.torque_constant.value
    return abs(stall * drive.gear_ratio.value)
