"""Computes what the records of an arm can distinguish, and whether an answer is as sharp as they allow."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

from model.discrepancy.diagnosis import Diagnosis
from model.trial.score import SINGLE, Score

TOLD = 5.0
"""Least d′ at which the records distinguish a rival from the hidden effect."""


class Rival(BaseModel):
    """An effect that an answer names besides or instead of the hidden one; d′ at the joints where it is least."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    effect: str
    joints: tuple[int, ...]
    d_prime: float


class Sharpness(BaseModel):
    """The rivals of one arm, computed on the mock's side after its answer was sealed."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    seed: int
    rivals: tuple[Rival, ...]


def asks_for_rivals(score: Score) -> bool:
    """Whether d′ of the rivals is needed: for a group with the right name in it, and for a single wrong name."""
    if score.kind not in SINGLE or not score.detectable or score.named_right:
        return False
    if score.place == "group":
        return bool(score.in_answer) and score.groups <= 1
    return score.place == "named" and len(score.answered) == 1


def named_rivals(score: Score, answer: Diagnosis) -> tuple[tuple[str, tuple[int, ...]], ...]:
    """Returns effects other than the hidden one that the adopted steps of an answer name or group, with their
    joints.
    """
    steps = [step for step in answer.steps if step.adopted]
    named = [(step.effect, step.joints) for step in steps if step.effect is not None]
    named += [(candidate.effect, candidate.joints) for step in steps for candidate in step.group]
    wanted = set(score.answered) - set(score.known_as)
    return tuple(dict.fromkeys((effect, joints) for effect, joints in named if effect in wanted))


def as_sharp(score: Score) -> bool | None:
    """Whether the answer is as sharp as the records allow.

    It is if it is the right name alone, or a group of it and indistinguishable rivals. None if the question does not
    apply, or depends on an unknown d′.
    """
    if score.kind not in SINGLE or not score.detectable:
        return None
    if score.named_right:
        return True
    if score.place != "group" or not asks_for_rivals(score):
        return False
    others = [score.rivals.get(name) for name in set(score.answered) - set(score.known_as)]
    if any(d_prime is not None and d_prime >= TOLD for d_prime in others):
        return False
    return None if None in others else True
