"""One step of the search: probe every trial, fit the promising ones with everything else free, weigh the evidence."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from daq.contracts.progress import Cancel, Progress, stop_if
from model.arrays import Floats
from model.discrepancy.diagnosis import Candidate
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.case import Case, far_off, is_strained
from model.discrepancy.engine.fitting import LONG, Fit, Slopes, evaluate, fit, start_values
from model.discrepancy.engine.priors import free_unknown
from model.discrepancy.engine.probing import Probe, Projection, Start, Trial, projection
from model.discrepancy.thresholds import LARGER_PART, THRESHOLDS
from model.effects.names import effect_on
from model.fitting.unknowns import Unknown

SHORTLIST = 7
"""Most effects that are fitted after probing, and most that are begun from other numbers as well."""
REFINED = 6
"""Most candidates that are fitted with derivatives of their own."""
OF_A_JOINT = 3
"""Most of these effects on one joint."""

RESOLVED_ODDS = 2
"""Decimals of evidence by which candidates are ordered."""
LEADING = 8
"""Number of leading candidates that a watcher is told of."""


@dataclass(frozen=True)
class Findings:
    """What one step found: fitted candidates, best first, and all candidates as they were probed.

    now: the fit that they are compared with: the step's, or a better one that was found through them.
    unresolved: fitted candidates that the records may not resolve: none of them is named, but another one that follows
    the same changes of a torque is not named alone beside them.
    """

    now: Fit
    fitted: tuple[Fitted, ...]
    probed: tuple[Probe, ...]
    unresolved: tuple[Fitted, ...] = ()


def search(
    now: Fit, case: Case, needed: Callable[[tuple[int, ...]], float], progress: Progress, cancel: Cancel
) -> Findings:
    """Tries every effect that the model lacks, or that the file states, against what a fit leaves.

    Args:
        needed: evidence from which a candidate on some joints would be named.

    Raises CancelledError when asked to end.
    """
    now = now.with_slopes()
    clear = projection(now)
    probes: list[Probe] = []
    for trial in case.trials(clear, probes):
        stop_if(cancel)
        progress(0.3, f"trying {effect_on(trial.effect, trial.joints)}")
        probes.append(clear.probe(trial))
    probes.sort(key=lambda p: -p.gain)
    hopeful = [p for p in probes if p.gain > case.least_gain(p.trial, needed(p.trial.joints))]
    _tell(case, probes, ())
    work = _Search(now, case, now.slopes())
    singles, several = _shortlist(hopeful, now, case.options.least_margin)
    found: list[Fitted] = []
    for chosen in singles:
        stop_if(cancel)
        progress(0.6, f"fitting {effect_on(chosen[0].trial.effect, _joints(chosen))}")
        found = weigh(now, [*found, work.fit_effect(chosen, work.goal(found))])
        _tell(case, probes, found)
    found = weigh(now, work.refined(found, cancel))
    found = work.from_expected(found, [p.trial for p in probes])
    for chosen in several:
        best = found[0].log_odds if found else 0.0
        own = max((f.log_odds for f in found if f.effect == chosen[0].trial.effect), default=-math.inf)
        if own >= LARGER_PART * best:
            stop_if(cancel)
            progress(0.8, f"fitting {effect_on(chosen[0].trial.effect, _joints(chosen))}")
            found = weigh(now, [*found, work.fit_effect(chosen, work.goal(found))])
    found = weigh(now, work.refined(found, cancel))
    while found and len(found[0].joints) > 1:
        stop_if(cancel)
        fewer = [p for p in _with_fewer_joints(probes, found[0]) if not _is_fitted(p, found)]
        if not fewer:
            break
        fits = weigh(now, [work.fit_effect(p, work.goal(found)) for p in fewer])
        found = weigh(now, [*found, *work.refined(fits, cancel, found)])
    found = work.narrowed(found)
    _tell(case, probes, found)
    return Findings(now, tuple(found), tuple(probes))


def _tell(case: Case, probes: Sequence[Probe], found: Sequence[Fitted]) -> None:
    """Tells who watches: of each effect at a place its fit, or what its probe promises, as evidence."""
    if case.watch is None:
        return
    leading: dict[tuple[str, tuple[int, ...]], Candidate] = {}
    price = math.log(max(float(case.compared.samples.told.sum()), 2.0))
    for effect, joints, evidence, refitted in (
        *((f.effect, f.joints, f.evidence, True) for f in found),
        *((p.trial.effect, p.trial.joints, p.gain - p.trial.size * price, False) for p in probes),
    ):
        told = Candidate(effect=effect, joints=joints, evidence=evidence, refitted=refitted)
        leading.setdefault((effect, joints), told)
    case.watch(tuple(sorted(leading.values(), key=lambda one: -one.evidence)[:LEADING]))


@dataclass(frozen=True)
class _Search:
    """The fits of one step. slopes: by the unknowns of `now`, where it stands."""

    now: Fit
    case: Case
    slopes: Slopes

    def goal(self, found: Sequence[Fitted]) -> float:
        """The cost at which a candidate would still come close to the best of those fitted."""
        return min((f.fit.cost + f.cost for f in found), default=math.inf) + THRESHOLDS.close

    def fit_effect(self, probes: Sequence[Probe], goal: float) -> Fitted:
        """An effect on the joints of its probes, fitted together with all unknowns. Its evidence is not known yet.

        A fit that ends above the one without the effect has lost its way: what the tolerances had taken over of the
        effect was there twice where it began. It is begun again from no effect at all, which is where that other fit
        stands, or from an effect that has taken back what the tolerances took.
        """
        now, case = self.now, self.case
        effect, joints = probes[0].trial.effect, _joints(probes)
        lacking = tuple(j for p in probes if not p.trial.stated for j in p.trial.joints)
        wider = probes[0].trial.model if len(probes) == 1 else now.fitted_model
        if len(probes) > 1 and lacking:
            wider = wider.with_effect(probes[0].trial.law or effect, lacking)
        own = tuple(p for probe in probes for p in probe.trial.parameters)
        stated = tuple(p for probe in probes for p in probe.trial.stated)
        start: Start = {name: value for p in probes for name, value in p.start.items()}
        free = {p.name for p in own}
        kept = (u for u in case.kept(now, wider) if u.name not in free)
        unknowns = (*kept, *(free_unknown(p) for p in own))
        compared = now.compared.of_model(wider)
        begun = {**now.values, **start}
        fitted = fit(compared, unknowns, begun, now.memory, self.slopes_without(free), goal=goal)
        if fitted.cost > now.cost:
            null = {p.name: now.values.get(p.name, float(p.null)) for p in own if p.null is not None}
            begin = {**begun, **null, **case.take_back(effect, own, now)}
            again = fit(compared, unknowns, begin, now.memory, self.slopes_without(free), goal=goal)
            fitted = min(fitted, again, key=lambda f: f.cost)
        places = max(p.trial.places for p in probes)
        return Fitted(effect, joints, wider, own, fitted, places, stated=stated)

    def from_expected(self, found: Sequence[Fitted], tried: Sequence[Trial]) -> list[Fitted]:
        """The candidates, and those that promise most from other numbers, where the fit's are far off: what numbers
        imitate is not seen from there. Others are those of the best candidate, if it brings them back; else as the file
        states them, until one does."""
        now, every = self.now, list(found)
        if not is_strained(now):
            return every
        if not every or is_strained(every[0].fit):
            every = self._begun_at(self.case.where_expected(now), every, tried)
        if not every or is_strained(every[0].fit):
            return every
        values = {u.name: every[0].fit.values.get(u.name, now.values[u.name]) for u in now.unknowns}
        return self._begun_at(evaluate(now.compared, now.unknowns, values, now.memory), every, tried)

    def _begun_at(self, there: Fit, found: Sequence[Fitted], tried: Sequence[Trial]) -> list[Fitted]:
        """The candidates, and those that promise most from other numbers than the fit's, begun there."""
        now, case = self.now, self.case
        if not math.isfinite(there.cost):
            return list(found)
        clear, alike = self._at_numbers_of(there), there.compared is now.compared
        known = there.slopes() if alike else {}
        done = {(f.effect, f.joints) for f in found if f.ended and not is_strained(f.fit)}
        best: dict[tuple[str, tuple[int, ...]], Probe] = {}
        for probe in sorted((clear.probe(t) for t in tried if not t.stated), key=lambda p: -p.gain):
            place = probe.trial.effect, probe.trial.joints
            if len(best) < SHORTLIST and place not in done:
                best.setdefault(place, probe)
        every = list(found)
        for probe in best.values():
            trial, own = probe.trial, {p.name for p in probe.trial.parameters}
            goal = self.goal(every)
            kept = (u for u in case.kept(now, trial.model) if u.name not in own)
            unknowns = (*kept, *(free_unknown(p) for p in trial.parameters))
            compared = now.compared.of_model(trial.model)
            begin = _nearest(
                [{**there.values, **start} for start in (probe.start, *trial.starts)], there, trial, unknowns
            )
            if alike:
                fitted = fit(compared, unknowns, begin, now.memory, known, goal=goal)
            else:
                fitted = case.from_expected(compared, unknowns, begin, now.memory, goal)
            every.append(Fitted(trial.effect, trial.joints, trial.model, trial.parameters, fitted, trial.places))
        return best_of_each(weigh(self.now, every))

    def _at_numbers_of(self, there: Fit) -> Projection:
        """What is left for an effect where the numbers that the fit has far off are as in another one, and stay so: an
        effect that they imitate explains nothing beside them. By the fit's own derivatives, which follow the record."""
        now = self.now
        far = [u.name for u in far_off(now)]  # in their order: a sum in that of a set differs from run to run
        row = now.row + sum((there.values[name] - now.values[name]) * self.slopes[name] for name in far)
        near = tuple(u for u in now.unknowns if u.name not in far)
        return projection(replace(now, unknowns=near, row=row, known={u.name: self.slopes[u.name] for u in near}))

    def narrowed(self, found: Sequence[Fitted]) -> list[Fitted]:
        """The candidates, with each that stands beside the same effect on more joints fitted from where that is, too:
        fits of a periodic law end in one of many minima, and records not fitted to have yet to tell the right one."""
        again = []
        for one in found:
            wider = (f for f in found if f.effect == one.effect and one.joints and set(one.joints) < set(f.joints))
            for other in wider:
                if other.log_odds >= LARGER_PART * found[0].log_odds:
                    last = one.fit
                    values = {name: other.fit.values.get(name, value) for name, value in last.values.items()}
                    again.append(replace(one, fit=fit(last.compared, last.unknowns, values, last.memory, rounds=LONG)))
        return weigh(self.now, [*found, *again])

    def slopes_without(self, free: set[str]) -> Slopes:
        """Derivatives but those by a candidate's own parameters."""
        return {name: row for name, row in self.slopes.items() if name not in free}

    def refined(self, found: Sequence[Fitted], cancel: Cancel, every: Sequence[Fitted] = ()) -> list[Fitted]:
        """The candidates, of which the first have been fitted on with derivatives of their own: those that were reused
        are of another place, and a number that the tolerances had taken far off does not come back by them. Those that
        cannot catch up with the best of all are left as they are."""
        best = max((f.log_odds for f in (*found, *every)), default=0.0)
        refined: list[Fitted] = []
        for one in found[:REFINED]:
            stop_if(cancel)
            last, ended = one.fit, [f for f in (*found, *every, *refined) if f.ended]
            near = one.log_odds >= min(best - THRESHOLDS.close, LARGER_PART * best)
            if near and one.evidence > -THRESHOLDS.close and not one.ended:
                goal, now = self.goal(ended), last
                if all(is_strained(f.fit) for f in ended):
                    now = self.case.or_from_expected(last, goal)
                if now is last or is_strained(now):
                    now = fit(now.compared, now.unknowns, now.values, now.memory, rounds=LONG, goal=goal)
                now = self.case.or_across(now, goal)
                one = replace(one, fit=now, ended=True)  # noqa: PLW2901
            refined.append(one)
        return [*refined, *found[REFINED:]]


def _nearest(begun: Sequence[Start], there: Fit, trial: Trial, unknowns: Sequence[Unknown]) -> Start:
    """The start of the lowest cost: what gives or has play is not in proportion to its size."""
    compared = there.compared.of_model(trial.model)
    tried = [evaluate(compared, unknowns, start_values(unknowns, one), there.memory) for one in begun]
    return min(zip(tried, begun, strict=True), key=lambda pair: pair[0].cost)[1]


def weigh(now: Fit, found: Sequence[Fitted]) -> list[Fitted]:
    """Candidates beside the fit without them, with their evidence, best first. A fit without a finite value is none."""
    found = [f for f in found if math.isfinite(f.fit.cost)]
    if not found:
        return []
    (before, *after), memory = now.compared.descriptions([now.row, *(f.fit.row for f in found)])
    weighed = []
    for f, described in zip(found, after, strict=True):
        cost = cost_of(now, memory, f.size, f.places)
        fell = float((before - described).sum()) + now.prior - f.fit.prior
        weighed.append(replace(f, evidence=fell - cost, cost=cost, relieved=max(now.prior - f.fit.prior, 0.0)))
    return sorted(weighed, key=order_by_odds)


def improved(before: Fit, after: Fit) -> Fit | None:
    """A better fit of a model from the values that another one, with a further effect, has found for its unknowns; None
    if it is not better by as much as an effect needs."""
    values = {name: after.values.get(name, value) for name, value in before.values.items()}
    tried = evaluate(before.compared, before.unknowns, values, before.memory)
    if not tried.cost < before.cost - THRESHOLDS.significant:
        return None
    return fit(before.compared, before.unknowns, values, before.memory, rounds=LONG)


def evidence(before: Fit, after: Fit, parameters: int, places: int) -> float:
    """Fall of −2 log posterior from one fit to another, less the cost of its parameters and of the places searched."""
    (first, last), memory = after.compared.descriptions([before.row, after.row])
    fell = float((first - last).sum()) + before.prior - after.prior
    return fell - cost_of(before, memory, parameters, places)


def cost_of(before: Fit, memory: Floats, parameters: int, places: int) -> float:
    """k ln n for k parameters and n independent samples, and twice the logarithm of the places searched."""
    independent = max(float((before.compared.samples.told / memory).sum()), 2.0)
    return parameters * float(np.log(independent)) + 2 * float(np.log(max(places, 1)))


def _with_fewer_joints(probes: Sequence[Probe], best: Fitted) -> list[list[Probe]]:
    """The probes of an effect without each of its joints: an effect of one joint promises something on its neighbours,
    too."""
    laws = {p.effect for p in best.parameters}
    own = [
        p
        for p in probes
        if p.trial.effect == best.effect
        and (p.trial.law or p.trial.effect) in laws
        and set(p.trial.joints) <= set(best.joints)
    ]
    return [[p for p in own if p.trial.joints != (j,)] for j in best.joints]


def _is_fitted(probes: Sequence[Probe], found: Sequence[Fitted]) -> bool:
    """Whether the effect of these probes has been fitted on their joints already."""
    return any((f.effect, f.joints) == (probes[0].trial.effect, _joints(probes)) for f in found)


def _joints(probes: Sequence[Probe]) -> tuple[int, ...]:
    return tuple(sorted({j for p in probes for j in p.trial.joints}))


def _shortlist(probes: Sequence[Probe], now: Fit, lead: float) -> tuple[list[list[Probe]], list[list[Probe]]]:
    """The most promising effects, each on its best joint; and each on all joints on which there is something to
    explain. Among the first are for every joint the effects that explain most of it, where that is the larger part.

    On a joint whose residual is large and slow, few samples count as independent, and no effect promises much there as
    long as it is not fitted.
    """
    by_effect: dict[tuple[str, str], list[Probe]] = {}
    for probe in probes:
        if probe.gain > 0:
            by_effect.setdefault((probe.trial.effect, probe.trial.law), []).append(probe)
    sets = []
    for own in by_effect.values():
        several = [p for p in own if p.gain > lead and p.trial.joints]
        best = sum(p.gain for p in several) if several else own[0].gain
        sets.append((best, own[0], several))
    chosen = sorted(sets, key=lambda s: -s[0])[:SHORTLIST]
    singles = [[first] for _, first, _ in chosen]
    wider = [sorted(several, key=lambda p: p.trial.joints) for _, _, several in chosen if len(several) > 1]
    listed = {(own[0].trial.effect, own[0].trial.joints) for own in singles}
    weighted = now.weighted(now.row)
    for joint, columns in zip(now.model.machine.modelled_joints, now.compared.samples.columns, strict=True):
        whole = float(weighted[columns] @ weighted[columns])
        large = [p for p in probes if p.trial.joints == (joint,) and p.gain > LARGER_PART * whole]
        singles += [[p] for p in large[:OF_A_JOINT] if (p.trial.effect, p.trial.joints) not in listed]
    return singles, wider


def best_of_each(found: Sequence[Fitted]) -> list[Fitted]:
    """Of several fits of one effect at one place, the best first: the first."""
    kept: dict[tuple[str, tuple[int, ...]], Fitted] = {}
    for one in found:
        kept.setdefault((one.effect, one.joints), one)
    return list(kept.values())


def order_by_odds(found: Fitted) -> float:
    """Sort key: the most probable candidate first. Those that differ by rounding alone keep their order, so that no
    answer depends on the unit of a drive."""
    return -round(found.log_odds, RESOLVED_ODDS)


def prefer_fewer_joints(found: Sequence[Fitted], lead: float) -> list[Fitted]:
    """Candidates, best first, of which the best gives way to the same effect on fewer joints where the others bring
    little: `lead` for each is what a joint is taken in for."""
    if not found:
        return []
    best = found[0]

    def does_as_much(other: Fitted) -> bool:
        more = len(best.joints) - len(other.joints)
        is_part = other.effect == best.effect and set(other.joints) < set(best.joints)
        return is_part and bool(other.joints) and best.log_odds - other.log_odds < more * lead

    fewer = sorted((f for f in found if does_as_much(f)), key=lambda f: len(f.joints))
    return _led_by(fewer[:1], found)


def prefer_shorter_laws(found: Sequence[Fitted], before: Fit, lead: float) -> list[Fitted]:
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
