"""Every case of a trial as one line of a table, from which its rates can be counted again."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable

from model.trial.score import Score

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
