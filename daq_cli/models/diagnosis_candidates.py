"""The candidates of a diagnosis for a terminal: what fits have shown, and below it what probes only promise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from model.discrepancy.diagnosis import in_order

if TYPE_CHECKING:
    from model.discrepancy.diagnosis import Candidate, Step

FITTED = 5
"""Fitted candidates that are listed; what the step names always is."""
PROBED = 2
"""Candidates that were only probed: what they promise is not comparable with what fits have shown."""
COLUMN = 10
"""Width of the evidence."""


def candidates_lines(step: Step, earlier: Sequence[Step] = ()) -> list[str]:
    """The list of a step, a line each; empty where nothing was tried (what the controller's own numbers prove).

    earlier: the steps before. What they have fitted and refused is no promise any more.
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


def best_of(candidates: Sequence[Candidate], significant: float | None) -> str:
    """How near the best candidate has come to the evidence that is needed; empty where that is not known."""
    if not candidates or significant is None:
        return ""
    fitted, probed = in_order(candidates)
    best = (fitted or probed)[0]
    count = "the only candidate" if len(candidates) == 1 else f"the best of {len(candidates)} candidates"
    shown = "" if fitted else " (by its probe; none was worth a fit)"
    return (
        f"{count}, {effect_on(best.effect, best.joints)}, comes to {best.evidence:.0f} of the {significant:g} of "
        f"evidence that are needed{shown}"
    )


def effect_on(effect: str, joints: Sequence[int]) -> str:
    """An effect in words: backlash on joint 2."""
    on = f" on joint{'s' if len(joints) > 1 else ''} {', '.join(map(str, joints))}" if joints else ""
    return f"{effect.replace('_', ' ')}{on}"


def _line(candidate: Candidate) -> str:
    misfit = "" if candidate.misfit is None else f"   misfit {candidate.misfit:.2f}"
    return f"{candidate.evidence:{COLUMN}.0f}  {effect_on(candidate.effect, candidate.joints)}{misfit}"
