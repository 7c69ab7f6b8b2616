"""Answers and truths made by hand, as short as they can be."""

from collections.abc import Sequence

from daq.contracts.machine import load_machine
from model.discrepancy.diagnosis import (
    Candidate,
    Diagnosis,
    FoundValue,
    SignalError,
    Step,
    Verdict,
    Where,
)
from model.machine_model.model import base_model
from model.trial.truth import Detectability, HiddenEffect, Kind, SeenEffect, Truth
from tests.model.discrepancy.steps import answer_of
from tests.model.discrepancy.steps import step as plain_step

MACHINE = load_machine("ma2000")
MODEL = base_model(MACHINE)

Hidden = tuple[str, tuple[int, ...]]


def candidate(effect: str, *joints: int, evidence: float = 10.0) -> Candidate:
    return Candidate(effect=effect, joints=joints, evidence=evidence)


def step(
    effect: str | None,
    *joints: int,
    ranked: Sequence[str] = (),
    group: Sequence[str] = (),
    adopted: bool = True,
    holdout: tuple[float, float] | None = None,
    parameters: dict[str, FoundValue] | None = None,
    seen_at: int | None = 1,
) -> Step:
    """A step with its ranking; `holdout`: held-out error before and after, in floors."""
    errors = ()
    if holdout is not None:
        errors = (SignalError(joint=1, unit="rad", before=holdout[0] * 1e-3, after=holdout[1] * 1e-3, floor=1e-3),)
    return plain_step(
        effect,
        joints,
        parameters=parameters or {},
        evidence=100.0,
        candidates=tuple(candidate(name, *joints) for name in ranked),
        group=tuple(candidate(name, *joints) for name in group),
        rmse_holdout=errors,
        where=Where(joint=seen_at, phase=None, summary="", cells=(), dependences=()),
        adopted=adopted,
    )


def answer(verdict: Verdict, *steps: Step) -> Diagnosis:
    return answer_of(MODEL, *steps, verdict=verdict, seconds=5.0, robot_seconds=56.0)


def truth(kind: Kind, *hidden: Hidden, parameters: dict[str, float] | None = None, known: bool = True) -> Truth:
    names = [f"{name}_{j}" for name in ("viscous_friction", "coulomb_arm") for j in (1, 2, 3)]
    effects = tuple(
        HiddenEffect(
            effect=name,
            known_as=name if known else "unknown_effect",
            joints=joints,
            parameters=tuple({"joint": j, **(parameters or {})} for j in joints) or (parameters or {},),
            strength=0.5,
        )
        for name, joints in hidden
    )
    return Truth(
        seed=120, kind=kind, load="nominal", load_kg=None, effects=effects, deviations=dict.fromkeys(names, 0.1)
    )


def seen(of: Truth, d_prime: float = 20.0) -> Detectability:
    effects = tuple(SeenEffect(effect=effect.effect, d_prime=d_prime) for effect in of.effects)
    return Detectability(seed=of.seed, d_prime=d_prime, effects=effects)


def found(value: float, low: float | None, high: float | None) -> FoundValue:
    return FoundValue(value=value, low=low, high=high, unit="1")
