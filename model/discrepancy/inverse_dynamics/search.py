"""One step of the search: probe every trial, fit the promising ones with everything else free, weigh the evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from daq.contracts.progress import Cancel, Progress, stop_if
from model.arrays import Floats
from model.discrepancy.inverse_dynamics.candidates import list_trials, take_back
from model.discrepancy.inverse_dynamics.fitting import BalanceFit, Slopes, TorqueCase, fit, noise_model
from model.discrepancy.inverse_dynamics.probing import Probe, prepare_probes
from model.discrepancy.inverse_dynamics.starts import Start
from model.discrepancy.inverse_dynamics.tolerances import free_unknown
from model.discrepancy.thresholds import LARGER_PART, MOST_ROUNDS, THRESHOLDS, TORQUE_LEAD
from model.effects.library import find_named_effect
from model.effects.machine_numbers import MACHINE_NUMBERS
from model.effects.names import effect_on
from model.fitting.unknowns import Unknown
from model.inverse_dynamics.drive_timing import timing_unknowns
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

SHORTLIST = 7
"""Most effects that are fitted after probing."""
REFINED = 6
"""Most candidates that are fitted with derivatives of their own."""
OF_A_JOINT = 3
"""Most of these effects on one joint."""
ALIKE = 0.97
"""Correlation of the torques of two effects above which they count as the same."""

STRAINED = 50.0
"""Cost of the tolerances, as χ², above which what is missing has driven them far off: one number by 7 deviations."""
RESOLVED_ODDS = 2
"""Decimals of evidence by which candidates are ordered."""
FILE_IS_RIGHT = 2 * float(np.log(100.0))
"""Handicap of a number of the machine file against effects of the library, as evidence. That a file states a number
with a deviation and is wrong by many of them is assumed to be a hundred times rarer than an effect that it leaves out:
on one axis a winding of twice the stated resistance does nearly what a payload does."""


@dataclass(frozen=True)
class Fitted:
    """An effect on joints with everything fitted again, and its evidence."""

    effect: str
    joints: tuple[int, ...]
    model: Model
    parameters: tuple[Parameter, ...]
    fit: BalanceFit
    evidence: float
    cost: float = 0.0
    """Cost of its parameters and of the places searched, which the evidence has paid."""
    stated: tuple[Parameter, ...] = ()
    """Those of its parameters that the file states, as it states them; their priors are lifted."""
    relieved: float = 0.0
    """Part of the evidence that is of priors: of numbers that no longer have to be off."""
    told: float = 0.0
    """What held-out records say for it, as evidence; 0 where there are none."""
    told_compared: float = 0.0
    """The same, counted as for all other candidates (`holdout.Told`)."""

    @property
    def log_odds(self) -> float:
        """Evidence of all records with the prior odds of its kind: what it competes with other candidates by."""
        return self.evidence + self.told_compared - (FILE_IS_RIGHT if self.effect in MACHINE_NUMBERS else 0.0)

    def rivals(self, other: Fitted) -> bool:
        """Whether both explain torques of the same joints by different effects."""
        alike = not self.joints or not other.joints or bool(set(self.joints) & set(other.joints))
        return self.effect != other.effect and alike

    def imitates(self, other: Fitted, before: BalanceFit) -> bool:
        """Whether this effect is a longer law of the same family that gives the torque of the other one.

        Friction that falls with speed is Coulomb friction where it hardly falls: the shorter law is then its name. A
        tilted base that gives the torque of friction by direction is another thing, whatever its parameters.
        """
        family, others = (find_named_effect(f.effect).shared_name.family for f in (self, other))
        if len(self.parameters) <= len(other.parameters) or family != others:
            return False
        own, theirs = (
            np.concatenate([(a - b).ravel() for a, b in zip(f.fit.residual, before.residual, strict=True)])
            for f in (self, other)
        )
        return bool(own @ theirs > ALIKE * np.linalg.norm(own) * np.linalg.norm(theirs))


@dataclass(frozen=True)
class Findings:
    """What one step found: fitted candidates, best first, and all candidates as they were probed.

    unresolved: fitted candidates that the records may not resolve (`resolution`): none of them is named, but another
    one that follows the same changes of a torque is not named alone beside them.
    """

    fitted: tuple[Fitted, ...]
    probed: tuple[Probe, ...]
    unresolved: tuple[Fitted, ...] = ()


def search(
    model: Model,
    now: BalanceFit,
    case: TorqueCase,
    progress: Progress,
    cancel: Cancel,
) -> Findings:
    """Try every effect that the model lacks, or that the file states, against the residuals of a fit.

    Raises CancelledError when asked to end.
    """
    slopes, expected = now.slopes(), _slopes_where_expected(now)
    prober = prepare_probes(now, slopes)
    fitted_model = model.with_values(now.model_values)
    probes: list[Probe] = []
    for trial in list_trials(fitted_model, now, case):
        stop_if(cancel)
        progress(0.3, f"trying {effect_on(trial.effect, trial.joints)}")
        probes.append(prober.probe(trial))
    probes.sort(key=lambda p: -p.gain)
    found: list[Fitted] = []
    for chosen in _shortlist(probes, now):
        stop_if(cancel)
        closest = min(found, key=lambda f: f.fit.criterion, default=None)
        so_far = f"; closest so far: {effect_on(closest.effect, closest.joints)}" if closest else ""
        progress(0.6, f"fitting {effect_on(chosen[0].trial.effect, _joints(chosen))}{so_far}")
        found.append(_fit_effect(fitted_model, now, slopes, expected, chosen))
    places = sum(len(p.trial.starts) for p in probes)
    weighed = _weigh(found, now, places)
    found = _refined(weighed, weighed, cancel)
    weighed = _weigh(found, now, places)
    while weighed and len(weighed[0].joints) > 1:
        stop_if(cancel)
        fewer = [p for p in _with_fewer_joints(probes, weighed[0]) if not _is_fitted(p, found)]
        if not fewer:
            break
        fits = [_fit_effect(fitted_model, now, slopes, expected, p) for p in fewer]
        found += _refined(_weigh(fits, now, places), weighed, cancel)
        weighed = _weigh(found, now, places)
    return Findings(tuple(weighed), tuple(probes))


def _refined(found: Sequence[Fitted], every: Sequence[Fitted], cancel: Cancel) -> list[Fitted]:
    """The candidates, of which the first have been fitted on with derivatives of their own: those that were reused are
    of another place, and a number that the tolerances had taken far off does not come back by them. Those that cannot
    catch up with the best of `every` are left as they are."""
    best = max((f.log_odds for f in every), default=0.0)
    refined = []
    for one in found[:REFINED]:
        stop_if(cancel)
        last = one.fit
        if one.log_odds >= min(best - THRESHOLDS.close, LARGER_PART * best):
            own = (last.balance, last.unknowns, last.values, last.data, last.noise.memory)
            one = replace(one, fit=fit(*own, rounds=MOST_ROUNDS))  # noqa: PLW2901 (the better one in its place)
        refined.append(one)
    return [*refined, *found[REFINED:]]


def _with_fewer_joints(probes: Sequence[Probe], best: Fitted) -> list[list[Probe]]:
    """The probes of an effect without each of its joints: an effect of one joint promises something on its neighbours,
    too."""
    own = [p for p in probes if p.trial.effect == best.effect and set(p.trial.joints) <= set(best.joints)]
    return [[p for p in own if p.trial.joints != (j,)] for j in best.joints]


def _is_fitted(probes: Sequence[Probe], found: Sequence[Fitted]) -> bool:
    """Whether the effect of these probes has been fitted on their joints already."""
    return any((f.effect, f.joints) == (probes[0].trial.effect, _joints(probes)) for f in found)


def _joints(probes: Sequence[Probe]) -> tuple[int, ...]:
    return tuple(sorted({j for p in probes for j in p.trial.joints}))


def _shortlist(probes: Sequence[Probe], now: BalanceFit) -> list[list[Probe]]:
    """For the most promising effects, the best joint alone, and all joints on which there is something to explain; and
    for every joint the effects that explain most of it, where that is the larger part.

    On a joint whose residual is large and slow, few samples count as independent, and no effect promises much there as
    long as it is not fitted.
    """
    by_effect: dict[str, list[Probe]] = {}
    for probe in probes:
        if probe.gain > 0:
            by_effect.setdefault(probe.trial.effect, []).append(probe)
    sets = []
    for own in by_effect.values():
        several = [p for p in own if p.gain > TORQUE_LEAD]
        best = sum(p.gain for p in several) if several else own[0].gain
        sets.append((best, own[0], several))
    chosen = []
    for _, first, several in sorted(sets, key=lambda s: -s[0])[:SHORTLIST]:
        chosen.append([first])
        if len(several) > 1:
            chosen.append(sorted(several, key=lambda p: p.trial.joints))
    listed = {(p.trial.effect, p.trial.joints) for own in chosen for p in own}
    for joint, whole in zip(now.balance.model.machine.modelled_joints, _weighted_squares(now), strict=True):
        large = [p for p in probes if p.trial.joints == (joint,) and p.gain > LARGER_PART * whole]
        chosen += [[p] for p in large[:OF_A_JOINT] if (p.trial.effect, p.trial.joints) not in listed]
    return chosen


def _weighted_squares(now: BalanceFit) -> list[float]:
    """Sum of the weighted squares of every joint's residual: what a probe there can gain at most."""
    return [float(left @ left) for left in now.noise.weighted(now.data.stretches, now.residual)]


def _fit_effect(
    model: Model,
    now: BalanceFit,
    slopes: Slopes,
    expected: Slopes | None,
    probes: Sequence[Probe],
) -> Fitted:
    """An effect on the joints of its probes, fitted together with all unknowns. Its evidence is not known yet.

    A fit that ends above the one without the effect has lost its way: what the tolerances had taken over of the effect
    was there twice where it began. It is begun again from no effect at all, which is where that other fit stands, or
    from an effect that has taken back what the tolerances took. Where tolerances are far off without it, it is begun
    from what the file states as well.

    slopes, expected: derivatives by the unknowns of `now`, where it stands and where the file states; None where
    tolerances are not far off.
    """
    effect, joints = probes[0].trial.effect, _joints(probes)
    lacking = tuple(j for p in probes if not p.trial.stated for j in p.trial.joints)
    wider = model if all(p.trial.stated for p in probes) else model.with_effect(effect, lacking)
    own = tuple(p for probe in probes for p in probe.trial.parameters)
    free, stated = {p.name for p in own}, tuple(p for probe in probes for p in probe.trial.stated)
    start: Start = {name: value for p in probes for name, value in p.start.items()}
    timing = {u.name for u in timing_unknowns(wider)}
    kept = (u for u in now.unknowns if u.name not in free and (not u.nuisance or u.name in timing))
    unknowns = (*kept, *(free_unknown(p) for p in own))
    balance = now.balance.of_model(wider)
    fitted = fit(balance, unknowns, {**now.values, **start}, now.data, now.noise.memory, slopes)
    if fitted.criterion > now.criterion:
        null = {p.name: now.values.get(p.name, float(p.null)) for p in own if p.null is not None}
        begin = {**now.values, **start, **null, **take_back(effect, own, now)}
        again = fit(balance, unknowns, begin, now.data, now.noise.memory, near=slopes)
        fitted = min(fitted, again, key=lambda f: f.criterion)
    if expected is not None:
        begin = {**now.values, **start, **_expected_values(unknowns)}
        second = fit(balance, unknowns, begin, now.data, now.noise.memory, expected)
        fitted = min(fitted, second, key=lambda f: f.criterion)
    return Fitted(effect, joints, wider, own, fitted, 0.0, stated=stated)


def _slopes_where_expected(now: BalanceFit) -> Slopes | None:
    """Derivatives by all unknowns where the file states their values, if tolerances are far from there."""
    if now.prior <= STRAINED:
        return None
    values = {**now.values, **_expected_values(now.unknowns)}
    return replace(now, values=values, residual=now.balance.residual(values)).slopes()


def _expected_values(unknowns: Sequence[Unknown]) -> Start:
    return {u.name: u.expected for u in unknowns if u.deviation is not None}


def _weigh(found: Sequence[Fitted], now: BalanceFit, places: int) -> list[Fitted]:
    """The candidates with their evidence, best first; on every joint the residual of the fit that leaves least there
    decides how many samples are independent. A fit without a finite value is none."""
    found = [f for f in found if np.isfinite(f.fit.criterion)]
    if not found:
        return []
    models = [noise_model(now.data.stretches, f.fit.residual, now.data.floor) for f in found]
    least = [min(range(len(found)), key=lambda k: found[k].fit.by_joint[j]) for j in range(len(now.by_joint))]
    memory = np.array([models[k].memory[j] for j, k in enumerate(least)])
    weighed = [
        replace(
            f,
            evidence=evidence(now, f.fit, memory, len(f.parameters), places),
            cost=cost_of(now, memory, len(f.parameters), places),
            relieved=max(now.prior - f.fit.prior, 0.0),
        )
        for f in found
    ]
    return sorted(weighed, key=order_by_odds)


def order_by_odds(found: Fitted) -> float:
    """Sort key: the most probable candidate first. Those that differ by rounding alone keep their order, so that no
    answer depends on the unit of a drive."""
    return -round(found.log_odds, RESOLVED_ODDS)


def prefer_fewer_joints(found: Sequence[Fitted]) -> list[Fitted]:
    """Candidates, best first, of which the best gives way to the same effect on fewer joints where the others bring
    little: `TORQUE_LEAD` for each is what a joint is taken in for."""
    if not found:
        return []
    best = found[0]

    def does_as_much(other: Fitted) -> bool:
        more = len(best.joints) - len(other.joints)
        is_part = other.effect == best.effect and set(other.joints) < set(best.joints)
        return is_part and bool(other.joints) and best.log_odds - other.log_odds < more * TORQUE_LEAD

    fewer = sorted((f for f in found if does_as_much(f)), key=lambda f: len(f.joints))
    return _led_by(fewer[:1], found)


def prefer_shorter_laws(found: Sequence[Fitted], before: BalanceFit, lead: float) -> list[Fitted]:
    """Candidates, best first, of which the best gives way to a shorter law that it imitates on the same joints, where
    it leads by less than `lead`: four waves of a bent sensor follow a wrong scale, and a little noise besides."""
    if not found:
        return []
    best = found[0]
    shorter = [
        f
        for f in found[1:]
        if f.joints == best.joints and best.imitates(f, before) and best.log_odds - f.log_odds < lead
    ]
    return _led_by(shorter[:1], found)


def _led_by(first: Sequence[Fitted], found: Sequence[Fitted]) -> list[Fitted]:
    return [*first, *(f for f in found if not any(f is one for one in first))]


def evidence(before: BalanceFit, after: BalanceFit, memory: Floats, parameters: int, places: int) -> float:
    """Fall of −2 log posterior from one fit to another, less the cost of its parameters and of the places searched."""
    return _fell(before, after, memory) + before.prior - after.prior - cost_of(before, memory, parameters, places)


def _fell(before: BalanceFit, after: BalanceFit, memory: Floats) -> float:
    """Fall of −2 log likelihood, with the independent samples of both counted by one memory (n,)."""
    return float(((before.by_joint * before.noise.memory - after.by_joint * after.noise.memory) / memory).sum())


def cost_of(before: BalanceFit, memory: Floats, parameters: int, places: int) -> float:
    """k ln n for k parameters and n independent samples, and twice the logarithm of the places searched."""
    independent = max(float((before.data.stretches.counts / memory).sum()), 2.0)
    return parameters * float(np.log(independent)) + 2 * float(np.log(max(places, 1)))
