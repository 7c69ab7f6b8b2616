"""The words for an effect: its name in a sentence, its size, what it does to torques, and the class that it is of.

Effects are entries of `daq/contracts/effects.toml`, laws and measurements of `laws.toml`, phrases of `phrases.toml`.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources

import numpy as np

from daq.contracts.effects import FORMER_EFFECTS, EffectName, effect_names
from model.discrepancy.diagnosis import Candidate, FoundValue, Inseparable
from model.discrepancy.grounds import Measurement, SharedLaw
from model.effects.library import find_named_effect
from model.effects.machine_numbers import MACHINE_NUMBERS
from model.effects.names import effect_name, effect_on, joints_in_words


def plain(value: float, digits: int = 2) -> str:
    """A number with so many significant digits: 720, −0.15, 0.00008."""
    text = np.format_float_positional(abs(value), precision=digits, unique=False, fractional=False, trim="-")
    return f"−{text}" if value < 0 and text != "0" else text


_ALL = tomllib.loads(resources.files("model.discrepancy.explanation").joinpath("phrases.toml").read_text("utf-8"))
PHASES: Mapping[str, str] = _ALL["phases"]
REFUSALS: Mapping[str, str] = _ALL["refusals"]
STAGES: Mapping[str, str] = _ALL["stages"]
METHODS: Mapping[str, str] = _ALL["methods"]
NOTHING: Mapping[str, str] = _ALL["nothing"]
NOTHING_AT_LENGTH: Mapping[str, str] = _ALL["nothing_at_length"]
NOTES: Mapping[str, str] = _ALL["notes"]


TURNING = {"torque": "torque", "angle": "angle", "turn": "turn"}
SLIDING = {"torque": "force", "angle": "position", "turn": "metre"}
"""Words for joints that turn, and for joints that slide."""
SHOWN = {"rad": (math.degrees(1.0), "°"), "1": (100.0, " %"), "s": (1e3, " ms"), "H": (1e3, " mH")}
"""Factor and unit in which people read a size, by its unit in SI."""


def entry_of(effect: str) -> EffectName | None:
    """The entry of an effect of the shared list, or of a number of the machine; None for another's."""
    number = MACHINE_NUMBERS.get(effect)
    return effect_names().get(effect) if number is None else number.own_entry


def called(effect: str, joints: Sequence[int] = ()) -> str:
    """The effect in a sentence: “a dead zone of the amplifier on joint 2”."""
    entry = entry_of(effect)
    own = "" if effect in FORMER_EFFECTS else " (an effect of the user's own)"
    name = f"{effect_name(effect)}{own}" if entry is None else entry.called
    return f"{name} on {joints_in_words(joints)}" if joints else name


def sizes_of(effect: str, parameters: Mapping[str, FoundValue]) -> list[FoundValue]:
    """The parameters that are sizes of an effect: one of each joint, or every one of a number of the machine."""
    entry = entry_of(effect)
    return [v for v in parameters.values() if effect in MACHINE_NUMBERS or (entry and v.part == entry.size)]


def size_words(value: FoundValue) -> str:
    """“0.93° (0.90 to 0.96)”: an estimate in the units that people read, with its interval if it has one."""
    factor, unit = SHOWN.get(value.unit, (1.0, f" {value.unit}"))
    interval = ""
    if value.low is not None and value.high is not None:
        interval = f" ({plain(value.low * factor, 3)} to {plain(value.high * factor, 3)})"
    return f"{plain(value.value * factor, 3)}{unit}{interval}"


def shape_of(effect: str, *, sliding: bool) -> str:
    """What an effect does to torques; of the user's own effects, the equation."""
    entry = entry_of(effect)
    if entry is None:
        return find_named_effect(effect).physics
    return entry.in_torques.format(**(SLIDING if sliding else TURNING)) or entry.line


@dataclass(frozen=True)
class Law:
    """A law that effects have in common, in words. told_by: measurements that may tell them. one_joint: only effects on
    the same joint have it in common."""

    words: str
    effects: Sequence[str]
    told_by: Sequence[Measurement]
    one_joint: bool = True


@dataclass(frozen=True)
class Measured:
    """A measurement in words, and the effects that it shows by themselves: it tells a class with one of them."""

    words: str
    shows: Sequence[str]


_TABLE = tomllib.loads(resources.files("model.discrepancy.explanation").joinpath("laws.toml").read_text("utf-8"))
LAWS: Mapping[SharedLaw, Law] = {name: Law(**entry) for name, entry in _TABLE["laws"].items()}
MEASUREMENTS: Mapping[Measurement, Measured] = {name: Measured(**one) for name, one in _TABLE["measurements"].items()}


def class_words(found: Inseparable, budget: float | None = None) -> str:
    """A class: its members, what they share, how near the motions came, and what would tell them. A clause."""
    *names, last = (effect_on(m.effect, m.joints) for m in found.members)
    law = "one class" if found.shares is None else LAWS[found.shares].words
    words = (
        f"{', '.join(names)} and {last} are {law}, which no motion that was tried tells apart: of {found.tried} "
        f"motions within the limits{within(budget)}, the best sets two of them {found.separation:.1f} standard "
        f"deviations apart ({found.needed:g} would tell them)"
    )
    told_by = ", or ".join(MEASUREMENTS[m].words for m in found.told_by)
    return f"{words}. What would tell them: {told_by}" if told_by else words


def class_headline(found: Inseparable, law: SharedLaw) -> str:
    """A class in a headline: its law, where, and its members."""
    places = {m.joints for m in found.members}
    joints = next(iter(places)) if len(places) == 1 else ()
    names = (effect_name(m.effect) if joints else effect_on(m.effect, m.joints) for m in found.members)
    on = f" on {joints_in_words(joints)}" if joints else ""
    return f"{LAWS[law].words}{on}: {' or '.join(names)}"


def class_of_group(group: Sequence[Candidate], classes: Sequence[Inseparable]) -> Inseparable | None:
    """The class, with a name, that all members of a group belong to; None where there is none."""
    own = {(c.effect, c.joints) for c in group}
    named = (one for one in classes if one.shares is not None and own <= {(m.effect, m.joints) for m in one.members})
    return next(named, None)


def within(budget: float | None) -> str:
    """Robot time beside the limits of the arm."""
    return "" if budget is None else f" and {budget:.0f} s"
