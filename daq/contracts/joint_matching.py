"""Holds the joints of an imported trace against those of a machine, by their names: no order is ever guessed."""

from __future__ import annotations

from collections.abc import Sequence

from daq.contracts.errors import TraceError
from daq.contracts.machine import Machine
from daq.contracts.trace import Trace


def check_joints(trace: Trace, machine: Machine) -> None:
    """Raises TraceError where a trace's names of joints say, or leave open, that its numbers are not the machine's."""
    names, known = trace.record.joint_names, tuple(joint.name for joint in machine.joints)
    if not names or trace.record.machine is not None:
        return
    if set(names) <= set(known):
        right = all(known[number - 1] == name for number, name in zip(trace.joints, names, strict=True))
    else:
        right = len(names) == 1 or (trace.record.joints_chosen and not set(names) & set(known))
    if not right:
        raise other_joints(trace.called, trace.joints, names, machine.name, known)


def other_joints(
    called: str, numbers: Sequence[int], names: Sequence[str], machine: str, known: Sequence[str]
) -> TraceError:
    """The error for joints whose numbers are not those of a machine with the joints `known`, with what to do."""
    own = ", ".join(f"{number} {name}" for number, name in zip(numbers, names, strict=True))
    if set(names) == set(known):
        advice = f"with --joints {','.join(known)}"
    elif set(names) < set(known):
        advice = "with this machine in the TOML beside it, by which names are matched"
    else:
        advice = f"with --joints and its own names for {', '.join(known)}, in this order"
    line = f"its joints are {own}, those of {machine} {', '.join(known)}"
    return TraceError(f"{called}: {line}; import it again {advice}")


def numbers_by_name(names: Sequence[str], known: Sequence[str]) -> tuple[int, ...]:
    """Number of each joint: the machine's where it has joints of these names, else from 1 in their order."""
    if set(names) <= set(known):
        return tuple(known.index(name) + 1 for name in names)
    return tuple(range(1, len(names) + 1))
