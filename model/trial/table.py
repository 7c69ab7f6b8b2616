"""The trial's table: every rate with its interval, effect by effect, and confusions between effects."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from daq.contracts.frozen import FrozenRecord
from model.trial.rates import Rate, rate
from model.trial.score import SINGLE, Score
from model.trial.truth import is_mock_friction


class Line(FrozenRecord):
    """One line of the table: its question, the rate, and the target (None: only reported)."""

    what: str
    rate: Rate
    reach: str | None = None


class Quantiles(FrozenRecord):
    """Quantiles of a quantity over cases."""

    cases: int
    median: float | None
    tenth: float | None
    ninety_fifth: float | None
    largest: float | None


class EffectLine(FrozenRecord):
    """One effect: cases, how many are detectable, and of those how many were named, placed, and found at the joint."""

    effect: str
    cases: int
    detectable: int
    named_right: Rate
    in_first: Rate
    joint_right: Rate
    answers: dict[str, int]
    """Answers other than the right name, and how often."""


class TrialTable(FrozenRecord):
    """The whole table."""

    cases: int
    not_acquired: int
    kinds: dict[str, int]
    lines: tuple[Line, ...]
    excess_removed: Quantiles
    excess_removed_whole: Quantiles
    seconds: Quantiles
    by_effect: tuple[EffectLine, ...]
    by_open_effect: tuple[EffectLine, ...]
    confusion: dict[str, dict[str, int]]
    """By hidden effect (single, detectable), then by answer."""


def trial_table(scores: Iterable[Score], not_acquired: int = 0) -> TrialTable:
    """Returns the table over scored cases."""
    every = sorted(scores, key=lambda s: s.seed)
    seen = [s for s in every if s.detectable]

    def of(*kinds: str) -> list[Score]:
        return [s for s in seen if s.kind in kinds]

    single = of(*SINGLE)
    shared, pairs, strange, wrong = map(of, ("shared_by_joints", "pair", "open_set", "wrong_priors"))
    clean = [s for s in every if s.kind == "clean"]
    intervals = [covered.inside for s in single for covered in s.covered]
    lines = (
        Line(what="named right, strict", rate=rate(s.named_right for s in single), reach="≥ 92 %"),
        Line(what="friction kinds merged", rate=rate(s.merged_right for s in single), reach="≥ 97 %"),
        Line(what="named right, or in the group that was given", rate=rate(s.in_answer for s in single)),
        Line(what="right name among the first three", rate=rate(s.in_first for s in single), reach="≥ 97 %"),
        Line(what="joint right", rate=rate(s.joint_right for s in single), reach="≥ 98 %"),
        Line(what="false alarm on clean arms", rate=rate(s.alarm for s in clean), reach="≤ 1.5 %, upper bound ≤ 3 %"),
        Line(
            what="effect not in the library: unknown, or a group", rate=rate(s.honest for s in strange), reach="≥ 85 %"
        ),
        Line(
            what="the same inside the friction family",
            rate=rate(s.honest for s in strange if is_mock_friction(s.effects[0])),
            reach="≥ 60 %",
        ),
        Line(what="pairs: both, and no other", rate=rate(s.named_right for s in pairs), reach="aim 75 %"),
        Line(what="pairs: at least one", rate=rate(s.at_least_one for s in pairs), reach="aim 97 %"),
        Line(what="shared by several joints: name", rate=rate(s.named_right for s in shared), reach="aim 85 %"),
        Line(what="shared by several joints: all joints, no other", rate=rate(s.joint_right for s in shared)),
        Line(what="wrong priors: named right, strict", rate=rate(s.named_right for s in wrong)),
        Line(what="95 % intervals that cover the truth", rate=rate(intervals), reach="90–98 %"),
    )
    return TrialTable(
        cases=len(every),
        not_acquired=not_acquired,
        kinds=dict(Counter(s.kind for s in every)),
        lines=lines,
        excess_removed=quantiles(s.excess_removed for s in single),
        excess_removed_whole=quantiles(s.excess_removed_whole for s in single),
        seconds=quantiles(s.seconds for s in single),
        by_effect=_effects([s for s in every if s.kind in SINGLE], lambda s: s.named_right),
        by_open_effect=_effects([s for s in every if s.kind == "open_set"], lambda s: s.honest),
        confusion=_confusion(single),
    )


def quantiles(values: Iterable[float | None]) -> Quantiles:
    """Returns median, 10th and 95th percentile, largest; None does not count."""
    found = [value for value in values if value is not None]
    if not found:
        return Quantiles(cases=0, median=None, tenth=None, ninety_fifth=None, largest=None)
    tenth, median, high = (float(value) for value in np.percentile(found, (10, 50, 95)))
    return Quantiles(cases=len(found), median=median, tenth=tenth, ninety_fifth=high, largest=max(found))


def _effects(scores: Sequence[Score], right: Callable[[Score], bool | None]) -> tuple[EffectLine, ...]:
    lines = []
    for name in sorted({s.effects[0] for s in scores}):
        own = [s for s in scores if s.effects[0] == name]
        seen = [s for s in own if s.detectable]
        lines.append(
            EffectLine(
                effect=name,
                cases=len(own),
                detectable=len(seen),
                named_right=rate(right(s) for s in seen),
                in_first=rate(s.in_first for s in seen),
                joint_right=rate(s.joint_right for s in seen),
                answers=dict(Counter(answer_in_words(s) for s in seen if not right(s)).most_common()),
            )
        )
    return tuple(lines)


def _confusion(scores: Sequence[Score]) -> dict[str, dict[str, int]]:
    found: dict[str, Counter[str]] = {}
    for s in scores:
        found.setdefault(s.effects[0], Counter())[answer_in_words(s)] += 1
    return {name: dict(counter.most_common()) for name, counter in sorted(found.items())}


def answer_in_words(score: Score) -> str:
    """Returns the answer in words, as a column of the confusion matrix."""
    if score.place == "named":
        return " + ".join(score.answered)
    if score.place == "group":
        return f"group with it of {len(score.answered)}" if score.in_answer else "group without it"
    return score.place
