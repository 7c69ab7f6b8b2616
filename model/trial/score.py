"""Scores one answer against one truth, by the rules of docs/trial.md."""

from __future__ import annotations

from typing import Any, Literal

from daq.contracts.frozen import FrozenRecord
from daq.contracts.machine import Machine
from model.discrepancy.diagnosis import Diagnosis, Step, Verdict
from model.discrepancy.verdict import excess_removed as share_removed
from model.machine_model.effect_parameters import effect_parameters
from model.trial.conventions import true_parameters
from model.trial.truth import Detectability, HiddenEffect, Kind, Truth, merged

SINGLE = ("single", "later_single")
"""Kinds of arms with one effect of the library and nothing else."""
FIRST = 3
"""Number of names that count for "among the first three"."""

Place = Literal["named", "group", "unknown-effect", "nothing-significant", "failed"]


class Covered(FrozenRecord):
    """A stated interval and the true value, both in the model's conventions."""

    parameter: str
    value: float
    low: float
    high: float
    truth: float

    @property
    def inside(self) -> bool:
        """Whether the interval contains the true value."""
        return self.low <= self.truth <= self.high


class Score(FrozenRecord):
    """The score of one answer. None means that the question does not apply to this case.

    `named_right`: every hidden effect was named, and no other. `merged_right`: the same with all friction kinds as one,
    for which a group of friction kinds alone is that one name. `in_first`: the effect is among the first three of the
    first step's ranking. `honest`: for an effect outside the library, no name was given and the answer is "unknown
    effect" or a group.
    """

    seed: int
    kind: Kind
    load: str
    effects: tuple[str, ...]
    known_as: tuple[str, ...]
    joints: tuple[tuple[int, ...], ...]
    strengths: tuple[float, ...]
    d_primes: tuple[float, ...]
    detectable: bool
    verdict: Verdict | None
    """None if the diagnosis failed."""
    place: Place
    answered: tuple[str, ...]
    """Names in the answer; of a group, all of them."""
    named_right: bool | None = None
    merged_right: bool | None = None
    in_answer: bool | None = None
    """The effect was named, or is in the given group."""
    in_first: bool | None = None
    joint_right: bool | None = None
    at_least_one: bool | None = None
    alarm: bool | None = None
    honest: bool | None = None
    excess_removed: float | None = None
    """Share of the held-out excess after tolerance fits that was removed: the contribution of the effects."""
    excess_removed_whole: float | None = None
    """Share of the held-out excess of the given model that was removed: the contribution of the whole diagnosis."""
    covered: tuple[Covered, ...] = ()
    groups: int = 0
    """Number of adopted steps that gave a group instead of a name."""
    seconds: float
    robot_seconds: float


def score(truth: Truth, seen: Detectability, answer: Diagnosis, machine: Machine) -> Score:
    """Scores an answer. `machine`: with the load that was announced."""
    names = tuple(effect.known_as for effect in truth.effects)
    named, group = named_effects(answer), group_of(answer)
    common = {
        **_case(truth, seen),
        "verdict": answer.verdict,
        "place": _place(answer, named),
        "answered": tuple(dict.fromkeys((*named, *group))),
        "groups": len(grouping_steps(answer)),
        "seconds": answer.seconds,
        "robot_seconds": answer.robot_seconds,
    }
    if truth.kind == "clean":
        return Score(**common, alarm=answer.verdict != "nothing-significant" or bool(named))
    if truth.is_strange:
        return Score(
            **common,
            honest=not named and answer.verdict in ("unknown-effect", "ambiguous"),
            excess_removed=excess_removed(answer),
            excess_removed_whole=excess_removed_whole(answer),
        )
    return Score(
        **common,
        named_right=_same_names(names, named) and not group,
        merged_right=_merged_right(names, named, group),
        in_answer=set(names) <= {*named, *group},
        in_first=_in_first(names, answer),
        at_least_one=bool(set(names) & set(named)),
        joint_right=_joint_right(truth.effects[0], answer) if len(truth.effects) == 1 else None,
        excess_removed=excess_removed(answer),
        excess_removed_whole=excess_removed_whole(answer),
        covered=_covered(truth, answer, machine) if _same_names(names, named) else (),
    )


def score_of_failure(truth: Truth, seen: Detectability, seconds: float) -> Score:
    """Returns the score of a diagnosis without an answer: it is wrong in every question."""
    known = truth.kind != "clean" and not truth.is_strange
    wrong = False if known else None
    return Score(
        **_case(truth, seen),
        verdict=None,
        place="failed",
        answered=(),
        named_right=wrong,
        merged_right=wrong,
        in_answer=wrong,
        in_first=wrong,
        at_least_one=wrong,
        joint_right=False if known and truth.effects[0].joints and len(truth.effects) == 1 else None,
        alarm=True if truth.kind == "clean" else None,
        honest=False if truth.is_strange else None,
        seconds=seconds,
        robot_seconds=0.0,
    )


def _case(truth: Truth, seen: Detectability) -> dict[str, Any]:
    return {
        "seed": truth.seed,
        "kind": truth.kind,
        "load": truth.load,
        "effects": tuple(effect.effect for effect in truth.effects),
        "known_as": tuple(effect.known_as for effect in truth.effects),
        "joints": tuple(effect.joints for effect in truth.effects),
        "strengths": tuple(effect.strength for effect in truth.effects),
        "d_primes": tuple(effect.d_prime for effect in seen.effects),
        "detectable": seen.every_effect_detectable,
    }


def named_effects(answer: Diagnosis) -> tuple[str, ...]:
    """Returns effects of the adopted steps that gave one name; a group of one effect at several joints counts as a
    name."""
    found = [step.effect for step in answer.steps if step.adopted and step.effect is not None and _one_name(step)]
    return tuple(dict.fromkeys(found))


def _one_name(step: Step) -> bool:
    """Whether the step gives one name, not a group of several."""
    return {candidate.effect for candidate in step.group} <= {step.effect}


def group_of(answer: Diagnosis) -> tuple[str, ...]:
    """Returns effects of the group that was given instead of a name, in an adopted step of an ambiguous answer.

    Groups that were withdrawn, or rejected by held-out traces, are no answer.
    """
    return tuple(dict.fromkeys(candidate.effect for step in grouping_steps(answer) for candidate in step.group))


def grouping_steps(answer: Diagnosis) -> list[Step]:
    """Returns the adopted steps of an ambiguous answer that gave a group instead of a name."""
    if answer.verdict != "ambiguous":
        return []
    return [step for step in answer.steps if step.adopted and not _one_name(step)]


def excess_removed(answer: Diagnosis) -> float | None:
    """Returns the share of the held-out variance above the noise floor that all adopted steps removed.

    None without a held-out trace or an adopted step, and if no joint showed enough of it before.
    """
    adopted = [step for step in answer.steps if step.adopted and step.rmse_holdout]
    if not adopted:
        return None
    first, last = adopted[0].rmse_holdout, adopted[-1].rmse_holdout
    return share_removed([b.model_copy(update={"after": a.after}) for b, a in zip(first, last, strict=True)])


def excess_removed_whole(answer: Diagnosis) -> float | None:
    """Returns the same share from the given model to the resulting one, so that fitted tolerance parameters count
    too."""
    return share_removed(answer.rmse_holdout)


def _place(answer: Diagnosis, named: tuple[str, ...]) -> Place:
    if named:
        return "named"
    if answer.verdict == "ambiguous":
        return "group"
    return "nothing-significant" if answer.verdict == "nothing-significant" else "unknown-effect"


def _same_names(names: tuple[str, ...], named: tuple[str, ...]) -> bool:
    return set(names) == set(named)


def _merged_right(names: tuple[str, ...], named: tuple[str, ...], group: tuple[str, ...]) -> bool:
    truths, given = {merged(name) for name in names}, {merged(name) for name in named}
    groups = {merged(name) for name in group}
    if len(groups) > 1:
        return False
    return truths == given | groups


def _in_first(names: tuple[str, ...], answer: Diagnosis) -> bool:
    """Whether the effect (any of several) is among the first names of the ranking of the first step."""
    if not answer.steps:
        return False
    ranked = dict.fromkeys(candidate.effect for candidate in answer.steps[0].candidates)
    own = answer.steps[0].effect
    first = ([own] if own is not None else []) + [name for name in ranked if name != own]
    return bool(set(names) & set(first[:FIRST]))


def _joint_right(effect: HiddenEffect, answer: Diagnosis) -> bool | None:
    """Whether the answered joints are those of the effect; None for answers in which nothing is significant."""
    if not effect.joints or answer.verdict == "nothing-significant":
        return None
    return _answered_joints(effect, answer) == set(effect.joints)


def _answered_joints(effect: HiddenEffect, answer: Diagnosis) -> set[int]:
    """Returns joints of the adopted steps that name the effect; else those of the first step, which may know only the
    place.

    Without any step, the joint whose remaining torque comes first in the answer; none if it names no joint.
    """
    same = [step for step in answer.steps if step.adopted and step.effect == effect.known_as]
    if same:
        alike = [c.joints for step in same for c in step.group if c.effect == effect.known_as]
        return {joint for joints in (*(step.joints for step in same), *alike) for joint in joints}
    if not answer.steps:
        return {shape.joint for shape in answer.remaining[:1]}
    first = answer.steps[0]
    if first.joints or first.effect is not None:
        return set(first.joints)
    return set() if first.where.joint is None else {first.where.joint}


def _covered(truth: Truth, answer: Diagnosis, machine: Machine) -> tuple[Covered, ...]:
    found: dict[str, Covered] = {}
    for step in answer.steps:
        effect = next((e for e in truth.effects if e.known_as == step.effect), None)
        if effect is None or not step.adopted:
            continue
        for joint in effect.joints or (None,):
            on = () if joint is None else (joint,)
            names = {p.part: p.name for p in effect_parameters(machine, effect.known_as, on, shared=False)}
            for part, value in true_parameters(effect, joint, truth, machine).items():
                stated = step.parameters.get(names[part])
                if stated is not None and stated.low is not None and stated.high is not None:
                    found[names[part]] = Covered(
                        parameter=names[part], value=stated.value, low=stated.low, high=stated.high, truth=value
                    )
    return tuple(found.values())
