"""What an answer has to say of the traces that it was made from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

from daq.contracts.trace import Trace
from model.discrepancy.thresholds import FEEDBACK_SHARE_FOR_ERRORS

NOTHING_HELD_OUT = "no held-out trace was given: nothing here has been shown on data it was not fitted to"
ERRORS_FOLLOW = (
    "errors, their floor and the map are of a simulation whose controller is given "
    f"{FEEDBACK_SHARE_FOR_ERRORS:g} of the way to each recorded reading; reasons tell sizes of the closed loop alone"
)
FAR = 4.0
"""Of its stated deviations, from which what a fit made of a number has to be said aloud."""
FAR_OFF = "stated deviations from what is expected"
"""What the note on such numbers says, and no other."""


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
    """One note on all numbers of the machine file that the records have drawn far from what it states, the furthest
    first; none where there are no such numbers.

    Args:
        numbers: with the value and the deviation that are expected. values: what the fit has made of them, by name.
    """
    away = [
        (abs(values[n.name] - n.expected) / n.deviation, n)
        for n in numbers
        if n.deviation is not None and abs(values[n.name] - n.expected) > FAR * n.deviation
    ]
    if not away:
        return ()
    told = ", ".join(
        f"{n.name} {_with_unit(values[n.name], n.unit)} ({deviations:.0f} deviations; {n.expected:.4g} stated)"
        for deviations, n in sorted(away, key=lambda one: -one[0])
    )
    subject = "this number" if len(away) == 1 else "these numbers"
    own = "its" if len(away) == 1 else "their"
    said = (
        f"{subject} came out more than {FAR:g} of {own} {FAR_OFF}: {told}; file and records do not speak of the same "
        "machine (units, signs, which way gravity acts?), or something is missing that was not found"
    )
    return (said,)


def on_tolerances(traces: int) -> str:
    """The note on what was fitted before anything was called missing. traces: how many it was fitted to."""
    count = "1 trace" if traces == 1 else f"{traces} traces"
    return (
        "numbers that may be a little off on a sound machine (tolerance parameters) were fitted first, to "
        f"{count}, by as much as the machine file states"
    )


def is_warning(note: str) -> bool:
    """Whether a note speaks against the whole answer, so that it has to be read before it."""
    return FAR_OFF in note


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"
