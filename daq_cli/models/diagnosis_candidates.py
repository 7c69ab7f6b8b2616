"""The candidates of a diagnosis for a terminal: those that were fitted, and below them those that were only probed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from model.discrepancy.diagnosis import in_order
from model.effects.names import effect_on

if TYPE_CHECKING:
    from model.discrepancy.diagnosis import Candidate, Step

FITTED = 5
"""Fitted candidates that are listed; those that the step names always are."""
PROBED = 2
"""Probed candidates that are listed: few, because their estimates are not comparable with those of fits."""
COLUMN = 10
"""Width of the column of evidence."""


def candidates_lines(step: Step, earlier: Sequence[Step] = ()) -> list[str]:
    """The list of a step, a line each; empty where nothing was tried (what the controller's own numbers prove).

    earlier: the steps before; a probe of a candidate that they fitted is not listed again.
    """
    if not step.candidates:
        return []
    tried = {(s.effect, s.joints) for s in earlier}
    fitted, probed = in_order([c for c in step.candidates if c.refitted or (c.effect, c.joints) not in tried])
    named = {(step.effect, step.joints), *((c.effect, c.joints) for c in step.group)}
    shown = [c for rank, c in enumerate(fitted) if rank < FITTED or (c.effect, c.joints) in named]
    lines = [f"{'evidence':>{COLUMN}}", *map(_line, shown)]
    promising = [c for c in probed if c.evidence > 0][:PROBED]
    if promising:
        lines += ["promised by probes alone (not fitted)", *map(_line, promising)]
    if more := len(fitted) + len(probed) - len(shown) - len(promising):
        lines.append(f"{'':{COLUMN}}  and {more} more")
    return lines


def _line(candidate: Candidate) -> str:
    misfit = "" if candidate.misfit is None else f"   misfit {candidate.misfit:.2f}"
    return f"{candidate.evidence:{COLUMN}.0f}  {effect_on(candidate.effect, candidate.joints)}{misfit}"
