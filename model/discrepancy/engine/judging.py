"""Whether a fitted candidate is taken: the evidence that it needs, and what it is refused for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from daq.contracts.machine import Machine
from model.arrays import Floats
from model.discrepancy.diagnosis import Step, Suspicion
from model.discrepancy.engine import holdout
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.case import Case
from model.discrepancy.engine.fitting import STEPS_APART, Fit, fit
from model.discrepancy.engine.priors import prior_distance
from model.discrepancy.engine.search import Findings
from model.discrepancy.engine.standing import Standing
from model.discrepancy.grounds import Refusal
from model.discrepancy.thresholds import CHANCES, LARGER_PART, THRESHOLDS
from model.effects.library import find_named_effect
from model.machine_model.parameter import Parameter
from model.machine_model.record_verdict import FAR_OFF


@dataclass(frozen=True)
class Comparison:
    """What a candidate takes off the residual.

    reference: the fit that it is held against. before, after: mean squares (n,) that the reference and the candidate
    leave on records not fitted to. least_share: of the mean square, that must be gone there.
    """

    chosen: Fitted
    reference: Fit
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
        fitted = _of_own(self.reference.model.machine, self.chosen, self.reference.squares)
        return holdout.share_removed(fitted, self.chosen.fit.squares, self.before, self.after)


def compare(standing: Standing, chosen: Fitted) -> Comparison | None:
    """The candidate beside its reference; None where there was no more than noise to explain."""
    case, reference = standing.case, _reference(standing, chosen.fit.values, chosen.stated)
    before, after = (holdout.squares_unseen(case, f) for f in (reference, chosen.fit))
    noise = case.noise_beside(chosen.fit)
    seen = [(reference.squares, chosen.fit.squares, noise)]
    if case.held_out is not None:
        seen.append((before, after, case.noise_held))
    if not any(_is_beyond_noise(standing, chosen, *one) for one in seen):
        return None
    return Comparison(chosen, reference, before, after, case.options.least_share)


def _reference(standing: Standing, after: Mapping[str, float], stated: Sequence[Parameter]) -> Fit:
    """The fit that an effect is held against: the last one, within what the file allows.

    A number that is off by more than its file allows may have taken over what is missing. It is as the file expects it
    where the effect names that number (`stated`), or the values with the effect (`after`) bring it back.
    """
    now = standing.now
    held = {p.name: p.value for p in stated}
    for unknown in now.unknowns:
        value = after.get(unknown.name)
        if unknown.deviation is not None and value is not None:
            far, near = (abs(prior_distance(unknown, v)[0]) for v in (now.values[unknown.name], value))
            if near < FAR_OFF <= far:
                held[unknown.name] = unknown.expected
    if not held:
        return now
    known = standing.model.by_name
    compared = now.compared.of_model(standing.model.with_values({n: v for n, v in held.items() if n in known}))
    unknowns = [u for u in now.unknowns if u.name not in held]
    return fit(compared, unknowns, now.values, now.memory, now.known, rounds=STEPS_APART)


def share_of_rest(standing: Standing, step: Step) -> float:
    """What an adopted effect explains beside all others, over what stays unexplained beyond noise: mean squares on the
    joints on which it acts. Infinite where nothing stays, or where it takes nothing off the residual and only brings
    numbers back to what the file states.

    Records that were not fitted to decide, unless they cannot show it: where what the effect itself changes is too
    small beside what stays there, whatever its law.
    """
    case, now = standing.case, standing.now
    stated = [p for name, p in standing.stated.items() if name in step.parameters]
    reference = _reference(standing.remove(step), now.values, stated)
    fitted = [_of_own(standing.model.machine, step, reference.squares), now.squares]
    with np.errstate(invalid="ignore"):
        own = fitted[1] < (1 - holdout.AFFECTED) * fitted[0]
    before, after = (holdout.squares_unseen(case, f) for f in (reference, now))
    seen = own & (before > 0.0) & np.isfinite(after)
    noise = case.noise
    if case.held_out is not None:
        noise = case.noise_held
        if seen.any():
            size = holdout.squares_between(case, reference, now)
            rest = np.maximum(after - noise**2, 0.0)
            if np.sum((size / before)[seen]) < LARGER_PART * np.sum((rest / before)[seen]):
                before, after, seen, noise = *fitted, own, case.noise
    with np.errstate(invalid="ignore", divide="ignore"):
        explained = float(np.sum(1 - (after / before)[seen]))
        unexplained = float(np.sum((np.maximum(after - noise**2, 0.0) / before)[seen]))
    return explained / unexplained if unexplained > 0.0 else np.inf


def _is_beyond_noise(standing: Standing, chosen: Fitted, fell: Floats, left: Floats, noise: Floats) -> bool:
    """Whether there was more than noise to explain: of a torque on a joint, on that joint.

    Args:
        fell, left: mean squares (n,) without and with the candidate. noise: (n,) standard deviation of noise.
    """
    own = _of_own(standing.model.machine, chosen, fell)
    return holdout.is_beyond_noise(own, left, noise * (1.0 + standing.case.noise_error))


def _of_own(machine: Machine, one: Fitted | Step, squares: Floats) -> Floats:
    """(n,) mean squares of the joints on which an effect acts, NaN elsewhere: what other joints leave moves with the
    numbers of the machine. A weight or a sensor acts on other joints, too."""
    if not one.joints or one.effect is None or find_named_effect(one.effect).shared_name.acts_on in ("load", "sensor"):
        return squares
    columns = np.isin(machine.modelled_joints, one.joints)
    return np.where(columns, squares, np.nan)


def judge(standing: Standing, chosen: Fitted, refused: Sequence[Fitted]) -> Comparison | None:
    """Whether a candidate is taken; None where it is none to speak of: it lacks evidence, has little beside a rival
    that was refused, or explains noise.

    Args:
        refused: candidates of the same step that were not taken before it.
    """
    if chosen.evidence <= 0:
        return None
    unsure = standing.case.options.least_evidence / THRESHOLDS.significant - 1.0  # priors have no noise in them
    if chosen.evidence + chosen.told + unsure * chosen.relieved < needed_evidence(standing, chosen.joints):
        return None
    if any(chosen.rivals(one) and chosen.evidence < LARGER_PART * one.evidence for one in refused):
        return None
    return compare(standing, chosen)


def needed_evidence(standing: Standing, joints: Sequence[int]) -> float:
    """Evidence from which a candidate on these joints is named: what counts as found, and what other laws leave."""
    return standing.case.options.least_evidence + left_by_laws(standing, joints)


def left_by_laws(standing: Standing, joints: Sequence[int]) -> float:
    """A share of what effects have explained on these joints (on any, for an effect of the whole machine), since no law
    is exactly the machine's."""
    own = set(joints)
    near = (s for s in standing.adopted if not own or not s.joints or own & set(s.joints))
    explained = sum(max(0.0, s.evidence + (s.evidence_held_out or 0.0)) for s in near)
    return standing.case.law_error * explained


SUSPECTED_SHARE = 0.05
"""Least share by which a suspected effect must make the mean square smaller on records not fitted to. Two thousandths
of the viscous friction, as Coulomb friction, took 1 to 3 % of what was left of a sound axis."""
ROUNDED = 5.0
"""s to which the time that is still to be recorded is rounded up."""


def suspect(standing: Standing, found: Findings, recorded: float) -> Suspicion | None:
    """The best candidate that was not named for want of evidence alone; None where there is none.

    What speaks for it and what the laws of other effects leave grow in proportion to the time `recorded`, s; its cost
    hardly does.
    """
    case = standing.case
    for chosen in found.fitted[:CHANCES]:
        total = chosen.evidence + chosen.told
        laws = left_by_laws(standing, chosen.joints)
        least, needed = case.options.least_evidence, needed_evidence(standing, chosen.joints)
        if chosen.evidence <= 0 or not max(THRESHOLDS.significant, laws) <= total < needed:
            continue
        comparison = compare(standing, chosen)
        if comparison is None or comparison.removed < max(SUSPECTED_SHARE, case.options.least_share):
            continue
        seconds = recorded * ((least + chosen.cost) / (total + chosen.cost - laws) - 1)
        return Suspicion(
            effect=chosen.effect,
            joints=chosen.joints,
            evidence=total,
            needed=needed,
            seconds=ROUNDED * float(np.ceil(seconds / ROUNDED)),
        )
    return None


FAR_ABOVE_NOISE = 10.0
"""Residual, in deviations of noise, that is taken for something missing even where no shape of it is found: friction at
a place, for one, depends on neither position nor direction alone. Sound rigs of other worlds leave up to 2.6, where
friction turns."""


def is_left_beside(standing: Standing) -> bool:
    """Whether far more than noise is left, on fitted and on held-out records, on a joint of an effect that was
    adopted: its name is then not all of the answer."""
    joints = standing.model.machine.modelled_joints
    own = {j for step in standing.adopted for j in step.joints or joints}
    far = noises_left(standing.case, standing.now) > FAR_ABOVE_NOISE
    return any(is_far and j in own for j, is_far in zip(joints, far, strict=True))


def noises_left(case: Case, now: Fit) -> Floats:
    """(n,) what fitted and held-out records leave at least, in noise floors: a record in which a joint rests says
    nothing of it."""
    left = [np.sqrt(now.squares) / case.noise]
    if case.held_out is not None:
        left.append(np.sqrt(case.held_squares(now)) / case.noise_held)
    return np.asarray(np.fmin.reduce(left))
