"""The headline of an answer: one clause for the terminal, the report, lists and the page."""

from __future__ import annotations

from collections.abc import Sequence

from model.discrepancy.diagnosis import Diagnosis, Inseparable, Step
from model.discrepancy.explanation.class_words import called, class_of_group
from model.discrepancy.explanation.effect_words import words_of
from model.discrepancy.explanation.left_words import doubts_of
from model.discrepancy.explanation.renderer import (
    not_examined_words,
    size_words,
    suspicion_words,
    was_taken_back,
)
from model.effects.machine_numbers import MACHINE_NUMBERS
from model.effects.names import effect_on
from model.record_check.finding import doubts_headline

SHOWN = 3
"""Members of a group that a headline names."""


def headline(found: Diagnosis) -> str:
    """The effects that were found, with joints and sizes; or that none was found, or none that is known; and joints
    that were not examined. A clause."""
    if found.verdict == "check-the-record":
        return f"check the record: {doubts_headline(found.record)}"
    return "; ".join([_finding_of(found), *not_examined_words(found.not_examined)])


def _finding_of(found: Diagnosis) -> str:
    if found.verdict == "suspected" and found.suspicion is not None:
        return f"perhaps {suspicion_words(found.suspicion)}"
    if found.verdict == "nothing-significant":
        return _nothing(found)
    shown = [s for s in found.steps if s.adopted]
    findings = [_group(s, found.inseparable) if s.group else _finding(s) for s in shown]
    if found.verdict == "unknown-effect":
        findings.append("none of the known effects explains what is left")
    if found.verdict == "partly":
        findings.append("and more is missing that no known effect explains")
    return "; ".join(findings) or "several effects that these traces cannot tell apart"


def _nothing(found: Diagnosis) -> str:
    """Why nothing is named; what is left, and what differs from the machine file."""
    if found.examined_nothing:
        return "the traces say nothing of the model"
    doubts = doubts_of(found)
    return "; ".join([_why_nothing(found, doubts), *doubts])


def _why_nothing(found: Diagnosis, doubts: Sequence[str]) -> str:
    if any(map(was_taken_back, found.steps)):
        return "none of the known effects, and what is left has no shape of one"
    if any(s.effect is not None for s in found.steps):
        return "nothing that the held-out traces confirm"
    if doubts:
        return "no known effect has the evidence to be named"
    return "the model explains these traces within their noise and its tolerances"


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
    sizes = [size_words(v) for v in step.parameters.values() if v.part == part or effect in MACHINE_NUMBERS]
    return ", ".join((effect_on(effect, step.joints), *sizes))
