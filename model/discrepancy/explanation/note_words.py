"""Notes in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from model.discrepancy.diagnosis import Inseparable
from model.discrepancy.explanation.class_words import class_words, within
from model.discrepancy.grounds import Note, NoteKind
from model.discrepancy.numbers import plain
from model.effects.names import effect_name, effect_on

Values = Mapping[str, Any]


def note_words(note: Note) -> str:
    """The note as a clause."""
    words = WORDS[note.kind]
    return words.format_map(note.values) if isinstance(words, str) else words(note.values)


def _drive_at_limit(v: Values) -> str:
    shares = ", ".join(f"{share:.0%} of joint {joint}'s time" for joint, share in v["shares"])
    unknown = ", ".join(map(str, v["unknown_joints"]))
    return (
        f"the recorded drive stands at its largest value ({shares}), where less may act than is recorded: how much "
        "less is found beside all else, and nothing is concluded from it"
    ) + (f"; a record tells nothing of joint {unknown}, which is not examined there" if unknown else "")


def _larger_noise(v: Values) -> str:
    def of(joint: Values) -> str:
        apart = joint["apart"]
        left_out = "" if not apart else f" beside {apart} reading{'' if apart == 1 else 's'} far off, left out"
        unit = " counts" if joint["unit"] == "count" else f" {joint['unit']}"
        return f"joint {joint['joint']} {joint['size']:.2g}{unit} for {joint['stated']:.2g}{left_out}"

    return (
        "the noise of readings is larger than what the machine file states of noise and rounding: "
        f"{'; '.join(map(of, v['joints']))}; no dependence of it on time, position, speed, direction or drive was "
        "found, and no tone"
    )


def _not_separable(v: Values) -> str:
    pairs = "; ".join(f"{one} and {other} ({most:.1f} at most)" for one, other, most in v["pairs"])
    limits = f"the limits{within(v['budget'])}"
    return f"no experiment within {limits} separates these by {v['least']:g} standard deviations: {pairs}"


def _shakes_above_cutoff(v: Values) -> str:
    joints = ", ".join(
        f"joint {j['joint']} at {plain(j['frequency'], 2)} Hz ({plain(j['factor'], 2)} times)" for j in v["joints"]
    )
    return (
        f"joints shake faster than torques are compared: {joints}, in brackets their acceleration above "
        f"{v['cutoff']:g} Hz over that below. What makes them shake is not looked for: a gear that gives or has play, "
        "a delay, or gains that are too high for these; a record with lower gains would tell"
    )


def _size_at_bound(v: Values) -> str:
    return (
        f"{effect_on(v['effect'], v['joints'])} would explain more (evidence {v['evidence']:.0f}), but only with "
        f"{v['name']} at the end of what it may be, {_rounded(v['value'], v['unit'])}: no machine has that, so that it "
        "is not named, and something like it may be missing"
    )


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
    match v["source"], v.get("fitted", 0):
        case "stated", 0:
            return "parameters may be off by what the machine file states"
        case "stated", known:
            better = f"an earlier fit, to other records, knows {known} of them better"
            return f"parameters may be off by what the machine file states; {better}"
        case "fitted-before", _:
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


def _on_joints(effects: Sequence[Values]) -> str:
    return " and ".join(effect_on(one["effect"], one["joints"]) for one in effects)


def _rounded(value: float, unit: str) -> str:
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"


WORDS: dict[NoteKind, str | Callable[[Values], str]] = {
    "cutoff": "torques are compared below {cutoff:g} Hz; faster effects are not seen",
    "drive-at-limit": _drive_at_limit,
    "drive-timing": lambda v: (
        f"drives are taken to act {', '.join(f'{samples:.2g}' for samples in v['late'])} samples of their record late: "
        f"up to {v['samples']:g} samples are how a drive is formed and held, which no record tells, and are not named "
        "as a delay"
    ),
    "errors-follow-record": "the gap and the sizes in reasons are of the closed loop; the map, and the errors by which "
    "held-out traces decide, are of a simulation whose controller is given the simulated reading moved {share:g} of "
    "the way to the recorded one",
    "larger-noise": _larger_noise,
    "names-excluded": "a group has fewer names than the fitted traces leave: the held-out ones, fitted to in turn, "
    "exclude the others",
    "no-experiment-left": lambda v: (
        f"no experiment within the limits{within(v['budget'])} is left that could tell {' from '.join(v['candidates'])}"
    ),
    "not-exchanged": lambda v: (
        "held-out traces were a check alone, and were not fitted to in turn, which would show whether they lead to the "
        f"same answer: {v.get('why', 'they are too short for the cutoff that they bear')}"
    ),
    "not-looked-for": lambda v: (
        "not looked for: " + "; ".join(f"{effect_name(name)} ({why})" for name, why in v["effects"].items())
    ),
    "not-separable": _not_separable,
    "nothing-held-out": "no held-out trace was given: nothing here has been shown on data it was not fitted to",
    "one-class": lambda v: class_words(
        Inseparable.model_validate({name: v[name] for name in Inseparable.model_fields}), v["budget"]
    ),
    "positions-of-links": "positions are taken to be those of the links, behind the transmission",
    "resting-left-out": "samples at which a joint rests are left out: friction holds it with whatever torque that "
    "takes",
    "shakes-above-cutoff": _shakes_above_cutoff,
    "size-at-bound": _size_at_bound,
    "stated-numbers-moved": _stated_numbers_moved,
    "suspicion-dropped": lambda v: (
        f"{effect_on(v['effect'], v['joints'])} has evidence of {v['evidence']:.0f}, but the held-out traces, fitted "
        "to in turn, neither show it nor raise a suspicion: it is not suspected"
    ),
    "taken-out-again": lambda v: (
        f"{effect_name(v['effect'])}, step {v['step']}, was taken out again: the others explain it"
    ),
    "tolerances-fitted-first": lambda v: (
        "numbers that may be a little off on a sound machine (tolerance parameters) were fitted first, to "
        f"{v['traces']} trace{'' if v['traces'] == 1 else 's'}, within what the machine file states"
    ),
    "tolerance-source": _tolerance_source,
    "torque-left": _torque_left,
    "traces-contradict": lambda v: (
        f"{_on_joints(v['effects'])} would explain the traces that were given to be fitted to, but not those held out, "
        "which are fitted to here: what is missing is something else, which none of the effects that were tried "
        "describes"
    ),
    "traces-exchanged": "the traces that were given to be fitted to show nothing plain that has a name: this is what "
    "those held out show, which are fitted to here, while the others are held out in turn",
    "unfinished-record": lambda v: (
        f"{v.get('file') or 'trace ' + v['trace']} was not recorded to its end ({v['outcome']}); the "
        f"{v['seconds']:.1f} s that there are were used"
    ),
}
