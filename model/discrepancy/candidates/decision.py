"""What one turn's ranking allows to be said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from model.discrepancy.candidates.ranking import Ranking
from model.discrepancy.output_error.refitting import Refitted, same_answer
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


@dataclass(frozen=True)
class Added:
    """An effect that has been added, where, and the evidence it had."""

    effect: str | None
    joints: tuple[int, ...]
    evidence: float


def decide(ranking: Ranking, thresholds: Thresholds, added: Sequence[Added] = ()) -> Decision:
    """Nothing significant, one name, or a group: of the first that brings what it has to bring, and what comes after.
    What is ranked above it is the echo of an effect that has been added, and says nothing of another joint's."""
    fits = ranking.fitted
    place = next((k for k, f in enumerate(fits) if f.evidence >= _needed(f, thresholds, added)), None)
    if place is None:
        return Decision("nothing", fits[0] if fits else None, 0.0, ())
    best = fits[place]
    rivals = [f for f in fits[place + 1 :] if not same_answer(f, best)]
    margin = best.evidence - max([0.0, *(r.evidence for r in rivals)])
    group = (best, *(r for r in rivals if best.evidence - r.evidence < thresholds.margin))
    return Decision("group" if len(group) > 1 else "named", best, margin, group if len(group) > 1 else ())


def _needed(found: Refitted, thresholds: Thresholds, added: Sequence[Added]) -> float:
    joints = set(found.candidate.joints)
    near = [not joints or not a.joints or bool(joints & set(a.joints)) for a in added]
    here = sum(a.evidence for a, on in zip(added, near, strict=True) if on)
    elsewhere = sum(a.evidence for a, on in zip(added, near, strict=True) if not on)
    return thresholds.needed(here, elsewhere, kin=any(a.effect == found.candidate.name for a in added))
