"""Whether a fitted candidate is taken: the evidence that it needs, and what it is refused for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from model.arrays import Floats
from model.discrepancy.diagnosis import CLEAR_SHAPE, Step, Suspicion
from model.discrepancy.grounds import Refusal
from model.discrepancy.inverse_dynamics import holdout
from model.discrepancy.inverse_dynamics.fitting import BalanceFit, fit
from model.discrepancy.inverse_dynamics.localisation import is_function_of, remaining_shapes
from model.discrepancy.inverse_dynamics.search import Findings, Fitted
from model.discrepancy.inverse_dynamics.standing import Standing
from model.discrepancy.inverse_dynamics.tolerances import prior_distance
from model.discrepancy.thresholds import CHANCES, LARGER_PART, THRESHOLDS, UNSURE_NOISE, WITHIN_NOISE
from model.effects.library import find_named_effect
from model.machine_model.parameter import Parameter
from model.machine_model.record_verdict import FAR_OFF


@dataclass(frozen=True)
class Comparison:
    """What a candidate takes off the residual.

    reference: the fit that it is held against. fitted_before, fitted_after: mean squares (n,), (N·m)² or N², that the
    reference and the candidate leave on the records fitted to. before, after: those (n,) on records not fitted to.
    least_share: of the mean square, that must be gone there.
    """

    chosen: Fitted
    reference: BalanceFit
    fitted_before: Floats
    fitted_after: Floats
    before: Floats
    after: Floats
    least_share: float

    @property
    def refusal(self) -> Refusal | None:
        """Why an effect is not taken, though it has the evidence: it explains too little of records not fitted to."""
        if self.removed < self.least_share:
            return Refusal(kind="falls-too-little", numbers={"share": self.removed})
        return None

    @property
    def removed(self) -> float:
        """Share of the mean square that is gone on records not fitted to."""
        return holdout.share_removed(self.fitted_before, self.fitted_after, self.before, self.after)


def compare(standing: Standing, chosen: Fitted) -> Comparison | None:
    """The candidate beside its reference; None where there was no more than noise to explain."""
    reference = _reference(standing, chosen.fit.values, chosen.stated)
    fell, left = (standing.case.stretches.mean_squares(f.residual) for f in (reference, chosen.fit))
    if not _is_beyond_noise(standing, chosen, fell, left):
        return None
    before, after = (_squares_not_fitted(standing, f) for f in (reference, chosen.fit))
    return Comparison(chosen, reference, fell, left, before, after, standing.case.options.least_share)


def _reference(standing: Standing, after: Mapping[str, float], stated: Sequence[Parameter]) -> BalanceFit:
    """The fit that an effect is held against: the last one, within what the file allows.

    A number that is off by more than its file allows may have taken over what is missing. It is as the file expects it
    where the effect names that number (`stated`), or the values with the effect (`after`) bring it back.
    """
    case, now = standing.case, standing.now
    held = {p.name: p.value for p in stated}
    for unknown in now.unknowns:
        value = after.get(unknown.name)
        if unknown.deviation is not None and value is not None:
            far, near = (abs(prior_distance(unknown, v)[0]) for v in (now.values[unknown.name], value))
            if near < FAR_OFF <= far:
                held[unknown.name] = unknown.expected
    if not held:
        return now
    unknowns = [u for u in now.unknowns if u.name not in held]
    balance = case.balance(standing.model.with_values({**now.model_values, **held}))
    return fit(balance, unknowns, now.values, case.data, now.noise.memory, near=now.derivatives)


def share_of_rest(standing: Standing, step: Step) -> float:
    """What an adopted effect explains beside all others, over what stays unexplained beyond noise: mean squares on the
    joints on which it acts. Infinite where nothing stays, or where it takes nothing off the torques and only brings
    numbers back to what the file states.

    Records that were not fitted to decide, unless they cannot show it: where the effect's own torque is too small
    beside what stays there, whatever its law.
    """
    case, now = standing.case, standing.now
    stated = [p for name, p in standing.stated.items() if name in step.parameters]
    reference = _reference(standing.remove(step), now.values, stated)
    fitted = [case.stretches.mean_squares(f.residual) for f in (reference, now)]
    own = fitted[1] < (1 - holdout.AFFECTED) * fitted[0]
    before, after = (_squares_not_fitted(standing, f) for f in (reference, now))
    seen = own & (before > 0.0) & np.isfinite(after)
    if case.held_out and seen.any():
        size = holdout.squares_between(reference, now, case.held_out)
        rest = np.maximum(after - case.noise**2, 0.0)
        if np.sum((size / before)[seen]) < LARGER_PART * np.sum((rest / before)[seen]):
            before, after, seen = *fitted, own
    with np.errstate(invalid="ignore", divide="ignore"):
        explained = float(np.sum(1 - (after / before)[seen]))
        unexplained = float(np.sum((np.maximum(after - case.noise**2, 0.0) / before)[seen]))
    return explained / unexplained if unexplained > 0.0 else np.inf


def _squares_not_fitted(standing: Standing, fitted: BalanceFit) -> Floats:
    """(n,) mean squares on the held-out records, or on blocks of the fitted ones, each predicted from the others."""
    held = standing.case.held_out
    model, values = fitted.balance.model, fitted.values
    return holdout.held_out_squares(model, values, held) if held else holdout.block_squares(fitted)


def _is_beyond_noise(standing: Standing, chosen: Fitted, fell: Floats, left: Floats) -> bool:
    """Whether there was more than noise to explain: of a torque on a joint, on that joint.

    Args:
        fell, left: mean squares (n,) on the fitted records without and with the candidate.
    """
    if chosen.joints and find_named_effect(chosen.effect).shared_name.acts_on == "joint torque":
        elsewhere = np.array([j not in chosen.joints for j in standing.model.machine.modelled_joints])
        fell = np.where(elsewhere, np.nan, fell)
    return holdout.is_beyond_noise(fell, left, standing.case.noise)


def judge(standing: Standing, chosen: Fitted, refused: Sequence[Fitted]) -> Comparison | None:
    """Whether a candidate is taken; None where it is none to speak of: it lacks evidence, has little beside a rival
    that was refused, or explains noise.

    Args:
        refused: candidates of the same step that were not taken before it.
    """
    if chosen.evidence <= 0:
        return None
    if chosen.evidence + chosen.told + (UNSURE_NOISE - 1.0) * chosen.relieved < standing.case.options.least_evidence:
        return None
    if any(chosen.rivals(one) and chosen.evidence < LARGER_PART * one.evidence for one in refused):
        return None
    return compare(standing, chosen)


SUSPECTED_SHARE = 0.05
"""Least share by which a suspected effect must make the mean square smaller on records not fitted to. Two thousandths
of the viscous friction, as Coulomb friction, took 1 to 3 % of what was left of a sound axis."""
ROUNDED = 5.0
"""s to which the time that is still to be recorded is rounded up."""


def suspect(standing: Standing, found: Findings) -> Suspicion | None:
    """The best candidate that was not named for want of evidence alone; None where there is none.

    What speaks for it grows in proportion to the time recorded, and its cost hardly does.
    """
    case = standing.case
    for chosen in found.fitted[:CHANCES]:
        if chosen.evidence <= 0:
            continue
        total = chosen.evidence + chosen.told
        needed = case.options.least_evidence
        if not THRESHOLDS.significant <= total < needed:
            continue
        comparison = compare(standing, chosen)
        if comparison is None or comparison.removed < max(SUSPECTED_SHARE, case.options.least_share):
            continue
        recorded = sum(float(np.ptp(r.time)) for r in (*case.records, *case.held_out))
        seconds = recorded * ((needed + chosen.cost) / (total + chosen.cost) - 1)
        return Suspicion(
            effect=chosen.effect,
            joints=chosen.joints,
            evidence=total,
            needed=needed,
            seconds=ROUNDED * float(np.ceil(seconds / ROUNDED)),
        )
    return None


FAR_ABOVE_NOISE = 10.0
"""Residual torque, in deviations of noise, that is taken for something missing even where no shape of it is found:
friction at a place, for one, depends on neither position nor direction alone. Sound rigs of other worlds leave up to
2.6, where friction turns (docs/how-well.md)."""
LONG_MEMORY = 4.0
"""Memory of a residual, in samples, beyond which it is slower than noise. White noise of a drive comes to 1.9 behind
the low-pass, that of accelerations to 2.7."""


def is_left_beside(standing: Standing) -> bool:
    """Whether far more than noise is left, on fitted and on held-out records, on a joint of an effect that was
    adopted: its name is then not all of the answer."""
    own = {j for step in standing.steps if step.adopted for j in step.joints}
    joints = standing.model.machine.modelled_joints
    far = _noises_left(standing) > FAR_ABOVE_NOISE
    return any(is_far and (j in own or not own) for j, is_far in zip(joints, far, strict=True))


def joints_left_over(standing: Standing) -> tuple[int, ...]:
    """Joints whose residual is above noise on fitted and on held-out records, and is no noise: far above and slower, or
    of a shape."""
    case, now = standing.case, standing.now
    least = _noises_left(standing)
    shaped = {shape.joint for shape in remaining_shapes(now, case) if shape.explained >= CLEAR_SHAPE}
    joints = standing.model.machine.modelled_joints
    slow = (least > FAR_ABOVE_NOISE) & (now.noise.memory > LONG_MEMORY)
    shapes = (least > WITHIN_NOISE) & np.array([j in shaped for j in joints])
    return tuple(j for j, left in zip(joints, slow | shapes, strict=True) if left)


def has_another_form(standing: Standing, step: Step) -> tuple[int, ...]:
    """Joints on which what is left is a function of a step's own torque.

    The numbers of a law are fitted. What is left as a function of the law's own torque is then something that the form
    of the law has not: it is another law of the same quantity, as drag that grows with the square of speed is beside
    viscous friction.
    """
    now, case = standing.now, standing.case
    absent = {p.name: p.null for n in step.parameters if (p := now.balance.model.by_name[n]).null is not None}
    left = set(joints_left_over(standing)) & set(step.joints)
    if not left or not absent:
        return ()
    without = now.balance.residual({**now.values, **absent})
    own = [less - all_of_it for less, all_of_it in zip(without, now.residual, strict=True)]
    joints = standing.model.machine.modelled_joints
    return tuple(j for k, j in enumerate(joints) if j in left and is_function_of(own, now, case, k))


def _noises_left(standing: Standing) -> Floats:
    """(n,) what fitted and held-out records leave at least, in noise floors: a record in which a joint rests says
    nothing of it."""
    case, now = standing.case, standing.now
    left = [np.sqrt(case.stretches.mean_squares(now.residual))]
    if case.held_out:
        left.append(np.sqrt(holdout.held_out_squares(standing.model, now.values, case.held_out)))
    return np.asarray(np.fmin.reduce(left) / case.noise)
