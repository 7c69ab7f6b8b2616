"""Notes that both methods make on an answer, as data."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol

from daq.contracts.trace import Trace
from model.discrepancy.grounds import Note
from model.machine_model.parameter import Parameter
from model.machine_model.record_verdict import FAR_OFF


class _Expected(Protocol):
    """A number of a fit: `Unknown`, or a number that torques determine."""

    @property
    def name(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def expected(self) -> float: ...
    @property
    def deviation(self) -> float | None: ...


def on_unfinished(traces: Sequence[Trace]) -> tuple[Note, ...]:
    """Notes on records that ended before the experiment did."""
    return tuple(
        Note(
            kind="unfinished-record",
            values={
                "trace": t.record.trace_id,
                **({"file": t.file} if t.file else {}),
                "outcome": t.record.outcome,
                "seconds": float(t.time[-1] - t.time[0]),
            },
        )
        for t in traces
        if t.record.outcome not in (None, "complete")
    )


def on_drives_at_limit(shares: Sequence[tuple[int, float]], unknown_joints: Sequence[int]) -> tuple[Note, ...]:
    """A note on drives that stood at limits of which no file tells; none where there are none.

    Args:
        shares: joints, with the share of the time (0 to 1) that their drives stood there. unknown_joints: those of
            which a record tells nothing for that reason.
    """
    values = {"shares": list(shares), "unknown_joints": list(unknown_joints)}
    return (Note(kind="drive-at-limit", values=values),) if shares else ()


def on_stated_numbers(numbers: Iterable[_Expected], values: Mapping[str, float]) -> tuple[Note, ...]:
    """One warning about all numbers of the machine file whose estimates are far from what it states, the furthest
    first; none where there are no such numbers.

    Args:
        numbers: with the value and the deviation that are expected. values: their estimates, by name.
    """
    moved: list[dict[str, Any]] = [
        {
            "name": n.name,
            "unit": n.unit,
            "value": values[n.name],
            "expected": n.expected,
            "deviations": abs(values[n.name] - n.expected) / n.deviation,
        }
        for n in numbers
        if n.deviation is not None and abs(values[n.name] - n.expected) > FAR_OFF * n.deviation
    ]
    if not moved:
        return ()
    moved.sort(key=lambda one: one["deviations"], reverse=True)
    return (Note(kind="stated-numbers-moved", values={"limit": FAR_OFF, "numbers": moved}, warning=True),)


def on_named_numbers(stated: Iterable[Parameter], values: Mapping[str, float]) -> tuple[Note, ...]:
    """What the machine file states of numbers that a step has named, which may be larger or smaller than that.

    Args:
        stated: the numbers, with value and deviation as stated. values: their estimates, by name.
    """
    numbers = [
        {
            "name": p.name,
            "unit": p.unit,
            "value": values[p.name],
            "expected": p.value,
            "deviations": abs(values[p.name] - p.value) / (p.deviation or 1.0),
        }
        for p in stated
    ]
    if not numbers:
        return ()
    return (Note(kind="stated-numbers-moved", values={"limit": FAR_OFF, "numbers": numbers, "named": True}),)
