"""Matches the joints of an imported trace to a machine by name. It never guesses their order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from daq.contracts.errors import TraceError
from daq.contracts.machine import Machine
from daq.contracts.trace import BY_JOINT, Trace


def matched(trace: Trace, machine: Machine) -> Trace:
    """Returns the trace with the machine's joint numbers, and without joints that the machine lacks.

    Returned unchanged: a trace without joint names; with one joint; with a machine file in its record; or whose joint
    order a person gave, if none of its names is the machine's. Raises TraceError if the names do not identify the
    machine's joints.
    """
    names, machine_joints = trace.record.joint_names, tuple(joint.name for joint in machine.joints)
    if not names or trace.record.machine is not None:
        return trace
    if {machine.joint(joint).name for joint in machine.modelled_joints} <= set(names):
        columns = [column for column, name in enumerate(names) if name in machine_joints]
        numbers = tuple(machine_joints.index(names[column]) + 1 for column in columns)
        return trace if numbers == trace.joints else _with_joints(trace, columns, numbers)
    if len(names) == 1 or (trace.record.joints_chosen and not set(names) & set(machine_joints)):
        return trace
    raise other_joints(trace.called, trace.joints, names, machine.name, machine_joints)


def _with_joints(trace: Trace, columns: list[int], numbers: tuple[int, ...]) -> Trace:
    """Returns some columns of a trace, as joints with these numbers."""
    there = {name: getattr(trace, name) for name in BY_JOINT}
    signals: dict[str, Any] = {name: None if signal is None else signal[:, columns] for name, signal in there.items()}
    names = tuple(trace.record.joint_names[column] for column in columns)
    return replace(trace, record=trace.record.model_copy(update={"joint_names": names}), joints=numbers, **signals)


def other_joints(
    called: str, numbers: Sequence[int], names: Sequence[str], machine: str, machine_joints: Sequence[str]
) -> TraceError:
    """Returns the error for joints that are not the machine's, with advice."""
    own = ", ".join(f"{number} {name}" for number, name in zip(numbers, names, strict=True))
    advice = f"with --joints and its own names for {', '.join(machine_joints)}, in this order"
    line = f"its joints are {own}, those of {machine} {', '.join(machine_joints)}"
    return TraceError(f"{called}: {line}; import it again {advice}")


def numbers_by_name(names: Sequence[str], machine_joints: Sequence[str]) -> tuple[int, ...]:
    """Returns the number of each joint: the machine's numbers if all names are its, otherwise 1, 2 … in file order.
    `matched` later refuses an order that nobody confirmed."""
    if set(names) <= set(machine_joints):
        return tuple(machine_joints.index(name) + 1 for name in names)
    return tuple(range(1, len(names) + 1))


def taken_names(
    called: str, names: Sequence[str], machine: Machine | None, machine_joints: Sequence[str], *, chosen: bool
) -> tuple[str, ...]:
    """Returns the joints that an import keeps: the machine's, if the file has all of them, otherwise all.

    Args:
        machine: the machine named in the file, or None.
        machine_joints: joint names of the machine in use.
        chosen: whether a person named the joints.

    Raises TraceError if the file names a machine, but its joints have other names.
    """
    if machine_joints and not chosen and set(machine_joints) <= set(names):
        return tuple(name for name in names if name in machine_joints)
    if machine is not None and not chosen and len(names) > 1 and not set(names) <= set(machine_joints):
        raise other_joints(called, tuple(range(1, len(names) + 1)), names, machine.name, machine_joints)
    return tuple(names)
