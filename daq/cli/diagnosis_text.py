"""A diagnosis as text for a terminal: the verdict first, then where, what, added, shown, asked."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

from model.reports.units import shown_unit

if TYPE_CHECKING:
    from model.discrepancy.answer import Candidate, Diagnosis, FoundValue, NextExperiment, SignalError, Step

WIDTH = 100
INDENT = 9
RANKED = 5
"""Candidates that are listed."""
VERDICTS = {
    "nothing-significant": "NOTHING SIGNIFICANT",
    "named": "NAMED",
    "ambiguous": "AMBIGUOUS",
    "unknown-effect": "UNKNOWN EFFECT",
}


def answer_text(found: Diagnosis) -> str:
    """The whole answer."""
    lines = _filled(VERDICTS[found.verdict], _headline(found), len(VERDICTS[found.verdict]) + 2)
    for number, step in enumerate(found.steps, start=1):
        lines += ["", *([f"step {number} of {len(found.steps)}"] if len(found.steps) > 1 else []), *_step(step)]
    if found.remaining:
        first = found.remaining[0]
        torques = [t for t in first.torque if t is not None]
        told = (
            f"a torque at joint {first.joint} of {min(torques):.3g} to {max(torques):.3g} {first.torque_unit} against "
            f"{first.against} would explain {100 * first.explained:.0f} % of what is left"
        )
        lines += ["", *_filled("left", told)]
    if found.next_experiment is not None:
        lines += ["", *_filled("ask", _asked(found.next_experiment))]
    for note in found.notes:
        lines += ["", *_filled("note", note)]
    lines += ["", f"{found.seconds:.1f} s of computing, {found.robot_seconds:.0f} s of motion"]
    return "\n".join(lines)


def _headline(found: Diagnosis) -> str:
    adopted = [s for s in found.steps if s.adopted and s.effect is not None]
    if found.verdict == "named" and adopted:
        return "; ".join(_name(s.effect or "", s.joints) for s in adopted)
    if found.verdict == "ambiguous" and found.steps and found.steps[-1].group:
        return "one of " + ", ".join(_name(c.effect, c.joints) for c in found.steps[-1].group)
    if found.verdict == "nothing-significant":
        if any(s.effect is not None for s in found.steps):
            return "nothing that the held-out traces confirm"
        return "the model explains these traces within their noise and its tolerances"
    return "none of the known effects explains what is left"


def _step(step: Step) -> list[str]:
    lines = _filled("where", step.where.summary)
    lines += _filled("what", step.reason)
    if step.candidates:
        lines += _candidates(step.candidates)
    if step.parameters:
        lines += _filled("added" if step.adopted else "tried", "")
        lines += [f"{'':{INDENT}}{name} = {_value(v)}" for name, v in step.parameters.items()]
    if not step.adopted and step.effect is not None:
        lines += _filled("", f"not taken into the model: {step.rejected_because or 'the held-out error did not fall'}")
    lines += _shown(step)
    return lines


def _candidates(candidates: Sequence[Candidate]) -> list[str]:
    ranked = sorted(candidates, key=lambda c: -c.evidence)
    lines: list[str] = []
    for c in ranked[:RANKED]:
        misfit = "" if c.misfit is None else f"   misfit {c.misfit:.2f}"
        kind = "" if c.refitted else "   probed"
        lines.append(f"{'':{INDENT}}{c.evidence:10.0f}  {_name(c.effect, c.joints)}{misfit}{kind}")
    if len(ranked) > RANKED:
        lines.append(f"{'':{INDENT}}{'':10}  and {len(ranked) - RANKED} more")
    return [f"{'':{INDENT}}{'evidence':>10}", *lines]


def _shown(step: Step) -> list[str]:
    lines: list[str] = []
    for label, errors in (("fitted to", step.rmse_fit), ("held out", step.rmse_holdout)):
        if errors:
            lines += _filled("shown" if not lines else "", f"rms error on traces {label}, before → after (noise)")
            lines += [f"{'':{INDENT}}  {_error(e)}" for e in errors]
    if step.excess_removed_holdout is not None:
        lines += _filled("", f"{100 * step.excess_removed_holdout:.1f} % of the held-out variance beyond noise is gone")
    if step.sum_lambda2_before is not None and step.sum_lambda2_after is not None:
        lines += _filled("", f"Σλ² {step.sum_lambda2_before:.3g} → {step.sum_lambda2_after:.3g}")
    return lines


def _error(e: SignalError) -> str:
    factor, unit = shown_unit(e.unit)
    return f"joint {e.joint}  {e.before * factor:8.4f} → {e.after * factor:8.4f} {unit}  ({e.floor * factor:.4f})"


def _asked(experiment: NextExperiment) -> str:
    return (
        f"{experiment.name}, {experiment.duration:.1f} s on the arm: {experiment.reason}; it would tell "
        f"{' and '.join(experiment.separates)} apart by {experiment.predicted_separation:.1f} standard deviations"
    )


def _value(value: FoundValue) -> str:
    unit = "" if value.unit == "1" else f" {value.unit}"
    if value.low is None or value.high is None:
        return f"{value.value:.4g}{unit} (not bounded by these traces)"
    return f"{value.value:.4g}{unit} (95 %: {value.low:.4g} to {value.high:.4g})"


def _name(effect: str, joints: Sequence[int]) -> str:
    on = f" on joint{'s' if len(joints) > 1 else ''} {', '.join(map(str, joints))}" if joints else ""
    return f"{effect.replace('_', ' ')}{on}"


def _filled(label: str, text: str, indent: int = INDENT) -> list[str]:
    """Text beside a label, wrapped."""
    return wrap(text, WIDTH, initial_indent=f"{label:<{indent}}", subsequent_indent=" " * indent) or [label]
