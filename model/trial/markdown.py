"""Formats the trial's table as Markdown."""

from __future__ import annotations

from model.trial.conventions import LEFT_OUT
from model.trial.rates import Rate
from model.trial.table import EffectLine, Quantiles, TrialTable


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
        _headed("Effects of the library:", _effects(table.by_effect, "named right")),
        _headed("Effects that only the mock knows:", _effects(table.by_open_effect, "unknown, or a group")),
        "No interval is counted for: " + "; ".join(f"{name} ({why})" for name, why in LEFT_OUT.items()) + ".",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _headed(head: str, rows: str) -> str:
    return f"{head}\n\n{rows}" if rows else ""


def _effects(lines: tuple[EffectLine, ...], right: str) -> str:
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
