"""What an answer has to say of the traces that it was made from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

from daq.contracts.trace import Trace
from model.discrepancy.observation import FOLLOWING_FOR_ERRORS

NOTHING_HELD_OUT = "no held-out trace was given: nothing here has been shown on data it was not fitted to"
ERRORS_FOLLOW = (
    "errors, their floor and the map are of a simulation whose controller is given "
    f"{FOLLOWING_FOR_ERRORS:g} of the way to each recorded reading; reasons tell sizes of the closed loop alone"
)
FAR = 4.0
"""Of its stated deviations, from which what a fit made of a number has to be said aloud."""


class _Expected(Protocol):
    @property
    def name(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def expected(self) -> float: ...
    @property
    def deviation(self) -> float | None: ...


def on_unfinished(traces: Sequence[Trace]) -> tuple[str, ...]:
    """Notes on records that did not come to their end."""
    return tuple(
        f"trace {t.record.trace_id} was not recorded to its end ({t.record.outcome}): "
        f"what there is of it, {t.time[-1] - t.time[0]:.1f} s, was used"
        for t in traces
        if t.record.outcome not in (None, "complete")
    )


def on_what_is_stated(numbers: Iterable[_Expected], values: Mapping[str, float]) -> tuple[str, ...]:
    """Notes on numbers of the machine file that the records have drawn far from what it states.

    Args:
        numbers: with the value and the deviation that are expected. values: what the fit has made of them, by name.
    """
    return tuple(
        f"{n.name} came out as {values[n.name]:.4g} {n.unit}, {abs(values[n.name] - n.expected) / n.deviation:.1f} of "
        f"its stated deviations from {n.expected:.4g}: file and records do not speak of the same machine (units, "
        "signs, which way gravity acts?), or something is missing that was not found"
        for n in numbers
        if n.deviation is not None and abs(values[n.name] - n.expected) > FAR * n.deviation
    )
