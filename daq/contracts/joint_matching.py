"""The joints of an imported trace are those of a machine by their names: no order is ever guessed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from daq.contracts.errors import TraceError
from daq.contracts.machine import Machine
from daq.contracts.trace import BY_JOINT, Trace


def matched(trace: Trace, machine: Machine) -> Trace:
    """The trace with the machine's numbers of its joints, by their names, and without joints that the machine lacks.

    A trace without names, of one joint, or of the machine itself, is returned as it is, and so is one whose order of
    joints a person gave, if it calls all of them otherwise. Raises TraceError where names say, or leave open, that its
    joints are not the machine's.
    """
    names, known = trace.record.joint_names, tuple(joint.name for joint in machine.joints)
    if not names or trace.record.machine is not None:
        return trace
    if {machine.joint(joint).name for joint in machine.modelled_joints} <= set(names):
        columns = [column for column, name in enumerate(names) if name in known]
        numbers = tuple(known.index(names[column]) + 1 for column in columns)
        return trace if numbers == trace.joints else _with_joints(trace, columns, numbers)
    if len(names) == 1 or (trace.record.joints_chosen and not set(names) & set(known)):
        return trace
    raise other_joints(trace.called, trace.joints, names, machine.name, known)


def _with_joints(trace: Trace, columns: list[int], numbers: tuple[int, ...]) -> Trace:
    """Some columns of a trace, as joints of these numbers."""
    there = {name: getattr(trace, name) for name in BY_JOINT}
    signals: dict[str, Any] = {name: None if signal is None else signal[:, columns] for name, signal in there.items()}
    names = tuple(trace.record.joint_names[column] for column in columns)
    return replace(trace, record=trace.record.model_copy(update={"joint_names": names}), joints=numbers, **signals)


def other_joints(
    called: str, numbers: Sequence[int], names: Sequence[str], machine: str, known: Sequence[str]
) -> TraceError:
    """The error for joints whose numbers are not those of a machine with the joints `known`, with what to do."""
    own = ", ".join(f"{number} {name}" for number, name in zip(numbers, names, strict=True))
    advice = f"with --joints and its own names for {', '.join(known)}, in this order"
    line = f"its joints are {own}, those of {machine} {', '.join(known)}"
    return TraceError(f"{called}: {line}; import it again {advice}")


def numbers_by_name(names: Sequence[str], known: Sequence[str]) -> tuple[int, ...]:
    """Number of each joint: the machine's where it has joints of these names, else from 1 in their order."""
    if set(names) <= set(known):
        return tuple(known.index(name) + 1 for name in names)
    return tuple(range(1, len(names) + 1))


def taken_names(
    called: str, names: Sequence[str], machine: Machine | None, known: Sequence[str], *, chosen: bool
) -> tuple[str, ...]:
    """The joints that an import takes: those of the machine where all of these are there, else every one.

    Args:
        machine: that the file names; None where only `known`, the joints of the machine in use, is known.
        chosen: whether a person named the joints.

    Raises TraceError where the file names a machine and its joints are called otherwise.
    """
    if known and not chosen and set(known) <= set(names):
        return tuple(name for name in names if name in known)
    if machine is not None and not chosen and len(names) > 1 and not set(names) <= set(known):
        raise other_joints(called, tuple(range(1, len(names) + 1)), names, machine.name, known)
    return tuple(names)
