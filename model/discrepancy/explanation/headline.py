"""The headline of an answer: one clause for the terminal, the report, lists and the page."""

from __future__ import annotations

from collections.abc import Sequence

from model.discrepancy.diagnosis import Diagnosis, Inseparable, Step
from model.discrepancy.explanation.class_words import called, class_of_group
from model.discrepancy.explanation.effect_words import words_of
from model.discrepancy.explanation.left_words import left_words
from model.discrepancy.explanation.renderer import (
    not_examined_words,
    size_words,
    suspicion_words,
    was_found_one_way,
    was_taken_back,
)
from model.effects.machine_numbers import MACHINE_NUMBERS
from model.effects.names import effect_on
from model.units import with_unit

SHOWN = 3
"""Members of a group that a headline names."""


def headline(found: Diagnosis) -> str:
    """The effects that were found, with joints and sizes; or that none was found, or none that is known; and joints
    that were not examined. A clause."""
    return "; ".join([_finding_of(found), *not_examined_words(found.not_examined)])


def _finding_of(found: Diagnosis) -> str:
    if found.verdict == "suspected" and found.suspicion is not None:
        return f"perhaps {suspicion_words(found.suspicion)}"
    if found.verdict == "nothing-significant":
        return _nothing(found)
    shown = [s for s in found.steps if s.adopted and (s.main_joints or not s.joints)]
    findings = [_group(s, found.inseparable) if s.group else _finding(s) for s in shown]
    if found.verdict == "unknown-effect":
        findings.append("none of the known effects explains what is left")
    return "; ".join(findings) or "several effects that these traces cannot tell apart"


def _nothing(found: Diagnosis) -> str:
    """Why nothing is named."""
    if found.examined_nothing:
        return "the traces say nothing of the model"
    if any(map(was_taken_back, found.steps)):
        return "none of the known effects, and what is left has no shape of one"
    if any(map(was_found_one_way, found.steps)):
        return "nothing that all traces show"
    if any(s.effect is not None for s in found.steps):
        return "nothing that the held-out traces confirm"
    left, moved = left_words(found), _moved_number(found)
    if left is not None:
        why = f"nothing has the shape of a known effect; {left}"
    elif moved is not None:
        why = "the model explains these traces within their noise"
    else:
        why = "the model explains these traces within their noise and its tolerances"
    return why if moved is None else f"{why}; {moved}"


def _moved_number(found: Diagnosis) -> str | None:
    """The number of the machine file whose estimate is farthest from what it states, as a clause; None where all are
    near."""
    for note in found.notes_data:
        if note.kind == "stated-numbers-moved" and note.warning:
            farthest = note.values["numbers"][0]
            number = found.model_before.by_name.get(farthest["name"])
            effect = None if number is None else number.effect
            called = farthest["name"] if number is None or effect is None else effect_on(effect, number.joints)
            value = with_unit(f"{farthest['value']:.3g}", farthest["unit"])
            return f"{called} comes out at {value}, where {farthest['expected']:.3g} is stated"
    return None


def _group(step: Step, classes: Sequence[Inseparable]) -> str:
    """The class that all members of a group belong to; else the first members, and how many more there are."""
    whole = class_of_group(step.group, classes)
    if whole is not None:
        return called(whole)
    names = [effect_on(c.effect, c.joints) for c in step.group]
    more = [] if len(names) <= SHOWN else [f"{len(names) - SHOWN} more"]
    return f"one of: {' or '.join(names[:SHOWN] + more)}"


def _finding(step: Step) -> str:
    effect = step.effect or ""
    part = words_of(effect).size
    sizes = [
        size_words(v)
        for v in step.parameters.values()
        if (v.part == part or effect in MACHINE_NUMBERS) and not (v.joints and set(v.joints) <= set(step.slight_joints))
    ]
    return ", ".join((effect_on(effect, step.main_joints), *sizes))
