"""Candidates that no motion tells apart, in words. A part of the renderer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from model.discrepancy.diagnosis import Candidate, Inseparable
from model.discrepancy.grounds import Measurement, SharedLaw
from model.effects.names import effect_name, joints_in_words

LAWS: Mapping[SharedLaw, str] = {
    "torque-with-speed": "a torque in proportion to speed",
    "torque-against-motion": "a torque against the motion",
    "torque-with-position": "a torque that goes with position",
    "torque-of-weight": "the torque of a weight",
    "torque-per-volt": "less torque for the same volts",
    "late-drive": "a torque that comes late",
    "play-and-give": "a gear that gives or has play",
    "reading-over-range": "a reading that is off over the range",
    "torque-at-one-rate": "a torque that swings at one rate",
}
"""What the members of a class have in common."""
MEASUREMENTS: Mapping[Measurement, str] = {
    "current-clamp": "a current clamp on the motor's lead",
    "coast-with-drive-open": "a coast with the drive's leads open",
    "force-gauge": "a force gauge that moves the joint, slowly and faster, with the drive switched off",
    "weighed-parts": "a scale, with the load or the link taken off",
    "spirit-level": "a spirit level on the base",
    "loosened-cables": "the same motion with cables and hoses taken off",
    "protractor": "a protractor at a few postures",
    "dial-gauge": "a dial gauge on the joint while its motor is held",
    "oscilloscope": "an oscilloscope on the motor's voltage and current",
    "stopped-arm": "a record of the arm at rest",
}
"""What would tell the members of a class."""


def class_words(found: Inseparable, budget: float | None = None) -> str:
    """A class: its members, what they share, how near the motions came, and what would tell them. A clause."""
    most = (
        f"of {found.tried} motions within the limits{within(budget)}, the best sets two of them "
        f"{found.separation:.1f} standard deviations apart ({found.needed:g} would tell them)"
    )
    law = "one class" if found.shares is None else LAWS[found.shares]
    return (
        f"{members_words(found)} are {law}, which no motion that was tried tells apart: {most}{_told_by(found.told_by)}"
    )


def called(found: Inseparable) -> str:
    """A class in a headline: its law, where, and its members; empty where its law has no name."""
    if found.shares is None:
        return ""
    places = {m.joints for m in found.members}
    joints = next(iter(places)) if len(places) == 1 else ()
    on = f" on {joints_in_words(joints)}" if joints else ""
    names = " or ".join(effect_name(m.effect) + ("" if joints else _on(m.joints)) for m in found.members)
    return f"{LAWS[found.shares]}{on}: {names}"


def members_words(found: Inseparable) -> str:
    """The members of a class, in a row."""
    names = [effect_name(m.effect) + _on(m.joints) for m in found.members]
    return f"{', '.join(names[:-1])} and {names[-1]}"


def class_of_group(group: Sequence[Candidate], classes: Sequence[Inseparable]) -> Inseparable | None:
    """The class, with a name, that all members of a group belong to; None where there is none."""
    own = {(c.effect, c.joints) for c in group}
    for found in classes:
        if found.shares is not None and own <= {(m.effect, m.joints) for m in found.members}:
            return found
    return None


def within(budget: float | None) -> str:
    """Robot time beside the limits of the arm."""
    return "" if budget is None else f" and {budget:.0f} s"


def _told_by(measurements: Sequence[Measurement]) -> str:
    if not measurements:
        return ""
    return f". What would tell them: {', or '.join(MEASUREMENTS[m] for m in measurements)}"


def _on(joints: Sequence[int]) -> str:
    return f" on {joints_in_words(joints)}" if joints else ""
