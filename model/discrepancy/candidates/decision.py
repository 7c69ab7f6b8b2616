"""The answer that a ranking allows: nothing, one name, or a group."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from model.discrepancy.candidates.candidate_fit import CandidateFit, cannot_be_told, same_answer
from model.discrepancy.candidates.ranking import Ranking
from model.discrepancy.thresholds import Thresholds

Kind = Literal["nothing", "named", "group"]


@dataclass(frozen=True)
class Decision:
    """best: the candidate with the answer. margin: its lead in evidence over the best that would be another answer.
    group: candidates that the data cannot tell apart, the best first."""

    kind: Kind
    best: CandidateFit | None
    margin: float
    group: tuple[CandidateFit, ...]


@dataclass(frozen=True)
class Added:
    """An effect that has been added to the model, and the evidence it had."""

    effect: str | None
    joints: tuple[int, ...]
    evidence: float


def decide(ranking: Ranking, thresholds: Thresholds, added: Sequence[Added] = ()) -> Decision:
    """The answer, from the first candidate of the ranking that has the evidence it needs, and those after it.

    Candidates below their threshold are skipped: those ranked higher are artefacts of an effect already in the model.
    """
    fits = ranking.fitted
    place = next((k for k, f in enumerate(fits) if f.evidence >= _needed(f, thresholds, added)), None)
    if place is None:
        return Decision("nothing", fits[0] if fits else None, 0.0, ())
    best = fits[place]
    rivals = [f for f in fits[place + 1 :] if not same_answer(f, best)]
    margin = best.evidence - max([0.0, *(r.evidence for r in rivals)])
    group = (best, *(r for r in rivals if _is_member(r, best, thresholds, added)))
    return Decision("group" if len(group) > 1 else "named", best, margin, group if len(group) > 1 else ())


def _is_member(rival: CandidateFit, best: CandidateFit, thresholds: Thresholds, added: Sequence[Added]) -> bool:
    """Whether a rival belongs to the group of the best. One that costs more has to be significant by itself."""
    if best.evidence - rival.evidence < thresholds.margin:
        return True
    return cannot_be_told(rival, best, thresholds.margin) and rival.evidence >= _needed(rival, thresholds, added)


def _needed(found: CandidateFit, thresholds: Thresholds, added: Sequence[Added]) -> float:
    joints = set(found.hypothesis.joints)
    near = [not joints or not a.joints or bool(joints & set(a.joints)) for a in added]
    here = sum(a.evidence for a, on in zip(added, near, strict=True) if on)
    elsewhere = sum(a.evidence for a, on in zip(added, near, strict=True) if not on)
    return thresholds.needed(here, elsewhere, kin=any(a.effect == found.hypothesis.name for a in added))
