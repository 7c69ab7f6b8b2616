"""The trial's table: every rate with its interval, effect by effect, and confusions between effects."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from pydantic import BaseModel, ConfigDict

from daq.contracts.frozen import FrozenRecord
from model.trial.conventions import LEFT_OUT
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


# --- Shares with their uncertainty


class Rate(BaseModel):
    """`hits` of `cases` with the exact 95 % interval (Clopper and Pearson 1934); None without cases."""

    model_config = ConfigDict(frozen=True)

    hits: int
    cases: int
    share: float | None
    low: float | None
    high: float | None

    def __str__(self) -> str:
        if self.share is None or self.low is None or self.high is None:
            return "no cases"
        return f"{self.hits}/{self.cases} = {100 * self.share:.1f} % ({100 * self.low:.1f}–{100 * self.high:.1f})"


def rate(outcomes: Iterable[bool | None]) -> Rate:
    """Returns the share of True; None is not counted."""
    from scipy.stats import binomtest  # imported late, so that the command line starts without it

    counted = [outcome for outcome in outcomes if outcome is not None]
    hits = sum(counted)
    if not counted:
        return Rate(hits=0, cases=0, share=None, low=None, high=None)
    interval = binomtest(hits, len(counted)).proportion_ci(0.95, method="exact")
    return Rate(hits=hits, cases=len(counted), share=hits / len(counted), low=interval.low, high=interval.high)


# --- Every case of a trial as one line of a table, from which its rates can be counted again


_FIELDS = (
    *("seed", "kind", "load", "detectable", "verdict", "named_right", "merged_right", "in_answer", "in_first"),
    *("joint_right", "at_least_one", "alarm", "honest", "excess_removed", "excess_removed_whole"),
    *("seconds", "robot_seconds"),
)
"""Columns that are fields of a score."""
_DERIVED: dict[str, Callable[[Score], str]] = {
    "hidden": lambda score: " + ".join(score.effects),
    "joints": lambda score: " + ".join("".join(map(str, joints)) or "-" for joints in score.joints),
    "strength": lambda score: " + ".join(f"{strength:.2f}" for strength in score.strengths),
    "d_prime": lambda score: " + ".join(f"{value:.1f}" for value in score.d_primes),
    "answered": lambda score: (" | " if score.place == "group" else " + ").join(score.answered),
    "intervals": lambda score: str(len(score.covered)),
    "intervals_right": lambda score: str(sum(covered.inside for covered in score.covered)),
}
"""Columns that are computed from a score, with their functions."""
COLUMNS = (*_FIELDS[:3], *list(_DERIVED)[:4], *_FIELDS[3:5], *list(_DERIVED)[4:], *_FIELDS[5:])
"""Columns of the table, in order."""


def as_csv(scores: Iterable[Score]) -> str:
    """Returns CSV with one line per case, in the order of their seeds; empty if a question does not apply."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    for score in sorted(scores, key=lambda each: each.seed):
        table.writerow(
            [_DERIVED[column](score) if column in _DERIVED else _plain(getattr(score, column)) for column in COLUMNS]
        )
    return text.getvalue()


def _plain(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    return "" if value is None else str(value)


# --- Formats the trial's table as Markdown


def as_markdown(table: TrialTable) -> str:
    """Returns the whole content of a page about the trial: rates, quantiles, effects, and confusions."""
    if not table.cases:
        return "No case has been scored yet.\n"
    kinds = ", ".join(f"{count} {kind.replace('_', ' ')}" for kind, count in table.kinds.items())
    first = (
        f"{table.cases} cases ({kinds}); {table.not_acquired} more could not be recorded to the end. "
        "Rates are of detectable cases (d′ ≥ 5), with exact 95 % intervals."
    )
    parts = [
        first,
        _rows(["what", "result", "to reach"], [[line.what, str(line.rate), line.reach or ""] for line in table.lines]),
        _rows(
            ["over detectable single cases", "cases", "median", "10th percentile", "95th percentile", "largest"],
            [
                ["held-out excess variance removed (%)", *_quantiles(table.excess_removed, 100.0)],
                ["the same, of the model as it was given (%)", *_quantiles(table.excess_removed_whole, 100.0)],
                ["time of a diagnosis (s)", *_quantiles(table.seconds, 1.0)],
            ],
        ),
        _headed("Effects of the library:", _effect_lines(table.by_effect, "named right")),
        _headed("Effects that only the mock knows:", _effect_lines(table.by_open_effect, "unknown, or a group")),
        "No interval is counted for: " + "; ".join(f"{name} ({why})" for name, why in LEFT_OUT.items()) + ".",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _headed(head: str, rows: str) -> str:
    return f"{head}\n\n{rows}" if rows else ""


def _effect_lines(lines: tuple[EffectLine, ...], right: str) -> str:
    return _rows(
        ["hidden", "cases", "detectable", right, "in first three", "joint right", "answered instead"],
        [
            [
                line.effect,
                str(line.cases),
                str(line.detectable),
                _short(line.named_right),
                _short(line.in_first),
                _short(line.joint_right),
                ", ".join(f"{name} {count}" for name, count in line.answers.items()),
            ]
            for line in lines
        ],
    )


def _short(found: Rate) -> str:
    return f"{found.hits}/{found.cases}" if found.cases else "–"


def _quantiles(found: Quantiles, scale: float) -> list[str]:
    values = (found.median, found.tenth, found.ninety_fifth, found.largest)
    return [str(found.cases), *("–" if value is None else f"{scale * value:.1f}" for value in values)]


def _rows(head: list[str], rows: list[list[str]]) -> str:
    if not rows:
        return ""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
