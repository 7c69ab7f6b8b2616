"""What one turn's ranking allows to be said."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

from model.discrepancy.ranking import Ranking
from model.discrepancy.refitting import Refitted
from model.discrepancy.thresholds import Thresholds

Kind = Literal["nothing", "named", "group"]


@dataclass(frozen=True)
class Decision:
    """The answer of one turn: `group` holds candidates that the data cannot tell apart, the best first; `margin` is
    the evidence of the best over the best that would be another answer."""

    kind: Kind
    best: Refitted | None
    margin: float
    group: tuple[Refitted, ...]


def decide(
    ranking: Ranking, thresholds: Thresholds, collected: float = 0.0, added: Collection[str | None] = ()
) -> Decision:  # fmt: skip
    """Nothing significant, one name, or a group.

    Args:
        collected: evidence of the effects that were added before. added: their names: what one joint has, another one
            of the same build is likelier to have.
    """
    fits = ranking.fitted
    if not fits:
        return Decision("nothing", None, 0.0, ())
    needed = thresholds.significant + thresholds.echo * collected
    if fits[0].candidate.name in added:
        needed *= thresholds.kin
    if fits[0].evidence < needed:
        return Decision("nothing", fits[0], 0.0, ())
    best = fits[0]
    rivals = [f for f in fits[1:] if not same_answer(f, best)]
    margin = best.evidence - max([0.0, *(r.evidence for r in rivals)])
    group = (best, *(r for r in rivals if best.evidence - r.evidence < thresholds.margin))
    return Decision("group" if len(group) > 1 else "named", best, margin, group if len(group) > 1 else ())


def same_answer(one: Refitted, other: Refitted) -> bool:
    """Whether two candidates say the same of the machine."""
    return one.candidate.name == other.candidate.name and one.candidate.joints == other.candidate.joints
