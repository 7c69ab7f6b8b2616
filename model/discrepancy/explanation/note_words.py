"""Notes in words. A part of the renderer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from model.discrepancy.diagnosis import Inseparable
from model.discrepancy.explanation.class_words import class_words, within
from model.discrepancy.grounds import Note, NoteKind
from model.discrepancy.numbers import plain
from model.effects.names import effect_name

Values = Mapping[str, Any]


def note_words(note: Note) -> str:
    """The note as a clause."""
    return WORDS[note.kind](note.values)


def _cutoff(v: Values) -> str:
    return f"torques are compared below {v['cutoff']:g} Hz; faster effects are not seen"


def _drive_at_limit(v: Values) -> str:
    shares = ", ".join(f"{share:.0%} of joint {joint}'s time" for joint, share in v["shares"])
    unknown = ", ".join(map(str, v["unknown_joints"]))
    return (
        f"the recorded drive stands at its largest value ({shares}), where less may act than is recorded: how much "
        "less is found beside all else, and nothing is concluded from it"
    ) + (f"; a record tells nothing of joint {unknown}, which is not examined there" if unknown else "")


def _errors_follow_record(v: Values) -> str:
    return (
        "the gap and the sizes in reasons are of the closed loop; the map, and the errors by which held-out traces "
        "decide, are of a simulation whose controller is given the simulated reading moved "
        f"{v['share']:g} of the way to the recorded one"
    )


def _larger_noise(v: Values) -> str:
    def of(joint: Values) -> str:
        unit = " counts" if joint["unit"] == "count" else f" {joint['unit']}"
        return f"joint {joint['joint']} {joint['size']:.2g}{unit} for {joint['stated']:.2g}"

    return (
        "the noise of readings is larger than what the machine file states of noise and rounding: "
        f"{'; '.join(map(of, v['joints']))}; no dependence of it on time, position, speed, direction or drive was "
        "found"
    )


def _no_experiment_left(v: Values) -> str:
    return (
        f"no experiment within the limits{within(v['budget'])} is left that could tell {' from '.join(v['candidates'])}"
    )


def _not_looked_for(v: Values) -> str:
    return "not looked for: " + "; ".join(f"{effect_name(name)} ({why})" for name, why in v["effects"].items())


def _not_separable(v: Values) -> str:
    pairs = "; ".join(f"{one} and {other} ({most:.1f} at most)" for one, other, most in v["pairs"])
    limits = f"the limits{within(v['budget'])}"
    return f"no experiment within {limits} separates these by {v['least']:g} standard deviations: {pairs}"


def _nothing_held_out(_: Values) -> str:
    return "no held-out trace was given: nothing here has been shown on data it was not fitted to"


def _one_class(v: Values) -> str:
    return class_words(Inseparable.model_validate({k: v[k] for k in Inseparable.model_fields}), v["budget"])


def _positions_of_links(_: Values) -> str:
    return "positions are taken to be those of the links, behind the transmission"


def _resting_left_out(_: Values) -> str:
    return "samples at which a joint rests are left out: friction holds it with whatever torque that takes"


def _shakes_above_cutoff(v: Values) -> str:
    def of(joint: Values) -> str:
        return f"joint {joint['joint']} at {plain(joint['frequency'], 2)} Hz ({plain(joint['factor'], 2)} times)"

    return (
        f"joints shake faster than torques are compared: {', '.join(map(of, v['joints']))}, in brackets their "
        f"acceleration above {v['cutoff']:g} Hz over that below. What makes them shake is not looked for: a gear that "
        "gives or has play, a delay, or gains that are too high for these; a record with lower gains would tell"
    )


def _stated_numbers_moved(v: Values) -> str:
    numbers = v["numbers"]
    listed = ", ".join(
        f"{n['name']} {_rounded(n['value'], n['unit'])} ({n['deviations']:.2g} deviations; {n['expected']:.4g} stated)"
        for n in numbers
    )
    if v.get("named"):
        named = "; ".join(
            f"{n['name']} is {_rounded(n['value'], n['unit'])} and not {_rounded(n['expected'], n['unit'])} "
            f"({n['deviations']:.1f} stated deviations away{_times(n['value'], n['expected'])})"
            for n in numbers
        )
        return f"what is named differs from what the machine file states: {named}"
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


def _taken_out_again(v: Values) -> str:
    return f"{effect_name(v['effect'])}, step {v['step']}, was taken out again: the others explain it"


def _tolerances_fitted_first(v: Values) -> str:
    traces = "1 trace" if v["traces"] == 1 else f"{v['traces']} traces"
    return (
        "numbers that may be a little off on a sound machine (tolerance parameters) were fitted first, to "
        f"{traces}, within what the machine file states"
    )


def _tolerance_source(v: Values) -> str:
    match v["source"]:
        case "stated":
            stated = "parameters may be off by what the machine file states"
            known = v.get("fitted", 0)
            return f"{stated}; an earlier fit, to other records, knows {known} of them better" if known else stated
        case "fitted-before":
            return f"the machine file states no deviations; fitted bodies are taken to be known to {v['share']:.0%}"
        case _:
            return "the machine file states no deviations; masses, centres and inertias are free"


def _torque_left(v: Values) -> str:
    records = "held-out traces" if v["held_out"] else "the traces fitted to"
    given = f"{v['given']:.1%} of the recorded by the model as given, " if "given" in v else ""  # older answers lack it
    shares = f"{given}{v['before']:.1%} with its numbers fitted, {v['after']:.1%} at the end"
    doubt = "; that is more than there is: see whether units (s, rad, m) and signs (drive, gravity) suit the file"
    return (
        f"torque left unexplained on {records}: {shares}{doubt if v.get('doubted', v.get('given', 0.0) > 1.0) else ''}"
    )


def _unfinished_record(v: Values) -> str:
    called = v.get("file") or f"trace {v['trace']}"
    return f"{called} was not recorded to its end ({v['outcome']}); the {v['seconds']:.1f} s that there are were used"


def _rounded(value: float, unit: str) -> str:
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"


WORDS: dict[NoteKind, Callable[[Values], str]] = {
    "cutoff": _cutoff,
    "drive-at-limit": _drive_at_limit,
    "errors-follow-record": _errors_follow_record,
    "larger-noise": _larger_noise,
    "no-experiment-left": _no_experiment_left,
    "not-looked-for": _not_looked_for,
    "not-separable": _not_separable,
    "nothing-held-out": _nothing_held_out,
    "one-class": _one_class,
    "positions-of-links": _positions_of_links,
    "resting-left-out": _resting_left_out,
    "shakes-above-cutoff": _shakes_above_cutoff,
    "stated-numbers-moved": _stated_numbers_moved,
    "taken-out-again": _taken_out_again,
    "tolerances-fitted-first": _tolerances_fitted_first,
    "tolerance-source": _tolerance_source,
    "torque-left": _torque_left,
    "unfinished-record": _unfinished_record,
}
