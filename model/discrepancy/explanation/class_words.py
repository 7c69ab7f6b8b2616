"""Candidates that no motion tells apart, in words. `laws.toml` has the laws that they share."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources

from model.discrepancy.diagnosis import Candidate, Inseparable
from model.discrepancy.grounds import Measurement, SharedLaw
from model.effects.names import effect_name, effect_on, joints_in_words


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
