"""Notes on an answer: as data, and in words."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import Inseparable
from model.discrepancy.explanation.effect_words import NOTES, class_words, plain, within
from model.discrepancy.grounds import Note, NoteKind
from model.effects.names import effect_name, joints_in_words
from model.fitting.unknowns import Unknown
from model.machine_model.parameter import Parameter
from model.machine_model.record_verdict import FAR_OFF


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


def on_stated_numbers(numbers: Iterable[Unknown], values: Mapping[str, float]) -> tuple[Note, ...]:
    """One warning about all numbers of the machine file whose estimates are far from what it states, the furthest
    first; none where there are no such numbers.

    Args:
        numbers: with the value and the deviation that are expected. values: their estimates, by name.
    """
    moved = [
        _moved(n, values[n.name], n.expected, n.deviation)
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
    numbers = [_moved(p, values[p.name], p.value, p.deviation or 1.0) for p in stated]
    if not numbers:
        return ()
    return (Note(kind="stated-numbers-moved", values={"limit": FAR_OFF, "numbers": numbers, "named": True}),)


def _moved(number: Unknown | Parameter, value: float, expected: float, deviation: float) -> dict[str, Any]:
    away = abs(value - expected) / deviation
    return {"name": number.name, "unit": number.unit, "value": value, "expected": expected, "deviations": away}


Values = Mapping[str, Any]


def note_words(note: Note) -> str:
    """The note as a clause."""
    v = note.values
    if note.kind in WHOLE:
        return WHOLE[note.kind](v)
    return NOTES[note.kind].format_map({**v, **(WRITTEN[note.kind](v) if note.kind in WRITTEN else {})})


def _drive_at_limit(v: Values) -> Values:
    unknown = ", ".join(map(str, v["unknown_joints"]))
    return {
        "shares": ", ".join(f"{share:.0%} of joint {joint}'s time" for joint, share in v["shares"]),
        "unknown": f"; a record tells nothing of joint {unknown}, which is not examined there" if unknown else "",
    }


def _noise_of(joint: Values) -> str:
    unit = " counts" if joint["unit"] == "count" else f" {joint['unit']}"
    return f"joint {joint['joint']} {joint['size']:.2g}{unit} for {joint['stated']:.2g}"


def _torque_left(v: Values) -> Values:
    doubt = "; that is more than there is: see whether units (s, rad, m) and signs (drive, gravity) suit the file"
    return {
        "records": "held-out traces" if v["held_out"] else "the traces fitted to",
        "given": f"{v['given']:.1%} of the recorded by the model as given, ",
        "doubt": doubt if v["doubted"] else "",
    }


def _stated_numbers_moved(v: Values) -> str:
    numbers = v["numbers"]
    if v.get("named"):
        named = "; ".join(
            f"{n['name']} is {_rounded(n['value'], n['unit'])} and not {_rounded(n['expected'], n['unit'])} "
            f"({n['deviations']:.1f} stated deviations away{_times(n['value'], n['expected'])})"
            for n in numbers
        )
        return f"what is named differs from what the machine file states: {named}"
    listed = ", ".join(
        f"{n['name']} {_rounded(n['value'], n['unit'])} ({n['deviations']:.2g} deviations; {n['expected']:.4g} stated)"
        for n in numbers
    )
    subject, own = ("this number", "its") if len(numbers) == 1 else ("these numbers", "their")
    return (
        f"{subject} came out more than {v['limit']:g} of {own} stated deviations from what is expected: {listed}. The "
        "file may be wrong there, file and records may not be of the same machine (units, signs, the direction of "
        "gravity?), or an effect is missing that was not found"
    )


def _times(value: float, stated: float) -> str:
    """How many times as large a number is as it is stated."""
    if stated <= 0.0:
        return ""
    return ", next to nothing" if value < 0.005 * stated else f", {value / stated:.2g} times as much"


def _tolerance_source(v: Values) -> str:
    unknown = "the machine file states no deviations"
    if v["source"] == "fitted-before":
        return f"{unknown}; fitted bodies are taken to be known to {v['share']:.0%}"
    if v["source"] != "stated":
        return f"{unknown}; masses, centres and inertias are free"
    known = v.get("fitted", 0)
    better = f"; an earlier fit, to other records, knows {known} of them better" if known else ""
    return f"parameters may be off by what the machine file states{better}"


def _rounded(value: float, unit: str) -> str:
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"


def limited_search(v: Values) -> str:
    """To which effects and joints a search was limited, as a clause."""
    count = len(v["effects"] or ())
    effects = f"{count} effect{'' if count == 1 else 's'}" if v["effects"] else "effects"
    places = f" on {joints_in_words(v['joints'])}" if v["joints"] else ""
    return f"only {effects}{places} {'was' if count == 1 else 'were'} looked for"


WRITTEN: dict[NoteKind, Callable[[Values], Values]] = {
    "drive-at-limit": _drive_at_limit,
    "larger-noise": lambda v: {"joints": "; ".join(map(_noise_of, v["joints"]))},
    "no-experiment-left": lambda v: {"within": within(v["budget"]), "candidates": " from ".join(v["candidates"])},
    "not-looked-for": lambda v: {
        "effects": "; ".join(f"{effect_name(name)} ({why})" for name, why in v["effects"].items())
    },
    "not-separable": lambda v: {
        "within": within(v["budget"]),
        "pairs": "; ".join(f"{one} and {other} ({most:.1f} at most)" for one, other, most in v["pairs"]),
    },
    "shakes-above-cutoff": lambda v: {
        "joints": ", ".join(
            f"joint {j['joint']} at {plain(j['frequency'], 2)} Hz ({plain(j['factor'], 2)} times)" for j in v["joints"]
        )
    },
    "taken-out-again": lambda v: {"effect": effect_name(v["effect"])},
    "tolerances-fitted-first": lambda v: {"traces": f"{v['traces']} trace{'' if v['traces'] == 1 else 's'}"},
    "torque-left": _torque_left,
    "unfinished-record": lambda v: {"called": v.get("file") or f"trace {v['trace']}"},
}
"""Values that a phrase has otherwise than the note."""
WHOLE: dict[NoteKind, Callable[[Values], str]] = {
    "limited-search": limited_search,
    "one-class": lambda v: class_words(
        Inseparable.model_validate({name: v[name] for name in Inseparable.model_fields}), v["budget"]
    ),
    "stated-numbers-moved": _stated_numbers_moved,
    "tolerance-source": _tolerance_source,
}
"""Notes that have no phrase of their own."""
