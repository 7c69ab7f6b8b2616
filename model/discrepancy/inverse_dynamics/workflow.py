"""Steps of a diagnosis by inverse dynamics: find an effect that is missing, add it, check that it holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from daq.contracts.progress import Cancel, Progress, stop_if
from model.arrays import Floats
from model.discrepancy.diagnosis import (
    UNWRITTEN,
    Candidate,
    Diagnosis,
    FoundValue,
    RemainingShape,
    SignalError,
    Step,
    Suspicion,
)
from model.discrepancy.explanation.notes import on_named_numbers, on_stated_numbers
from model.discrepancy.grounds import Note, Reason, Refusal
from model.discrepancy.inverse_dynamics import holdout
from model.discrepancy.inverse_dynamics.case import TorqueCase
from model.discrepancy.inverse_dynamics.estimates import found_values, signal_errors
from model.discrepancy.inverse_dynamics.fitting import BalanceFit, fit
from model.discrepancy.inverse_dynamics.gap import torque_gap
from model.discrepancy.inverse_dynamics.judged_controller import JudgedController
from model.discrepancy.inverse_dynamics.localisation import bends_with_speed, locate, remaining_shapes
from model.discrepancy.inverse_dynamics.priors import prior_distance
from model.discrepancy.inverse_dynamics.resolution import OF_CHANGES, is_resolved
from model.discrepancy.inverse_dynamics.search import Findings, Fitted, evidence, search
from model.discrepancy.inverse_dynamics.tolerances import FITTED_SHARE, tolerances
from model.discrepancy.verdict import verdict, withdrawn
from model.effects.library import effect
from model.inverse_dynamics.drive_timing import MOST, samples_late, timing_unknowns
from model.inverse_dynamics.recorded_motion import RecordedMotion
from model.inverse_dynamics.recorded_sizes import recorded_sizes
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Lineage, Model
from model.machine_model.parameter import Parameter

BESIDE_REFUSED = 0.5
"""Least evidence of an effect beside that of a rival which was refused before it: with less, it takes a small part of
something else."""
CHANCES = 3
"""Candidates of a step that may fail on records not fitted to before the search ends."""
SHOWN = 12
"""Most candidates that a step lists."""
FAR_OFF = 4.0
"""Deviations from what a file states, beyond which a number is taken for another than the file's."""
SUSPECTED = 10.0
"""Evidence from which an effect is suspected: odds above 100 to 1, by the usual scale of BIC (Kass and Raftery 1995),
and still short of what naming it takes."""
SUSPECTED_SHARE = 0.05
"""Least share by which a suspected effect must make the mean square smaller on records not fitted to. Two thousandths
of the viscous friction, as Coulomb friction, took 1 to 3 % of what was left of a sound axis."""
FAR_ABOVE_NOISE = 10.0
"""Residual torque, in deviations of noise, that is taken for something missing even where no shape of it is found:
friction at a place, for one, depends on neither position nor direction alone. Sound rigs of other worlds leave up to
2.6, where friction turns (docs/worlds.md)."""
MOST_OF_IT = 0.6
"""Share of a residual far above noise with which an effect that takes it is named on less evidence."""
SLOW = 4.0
"""Memory of a residual, in samples, beyond which it is slower than noise. White noise of a drive comes to 1.9 behind
the low-pass, that of accelerations to 2.7."""
VISCOUS = "viscous_friction"
MOSTLY = 0.5
"""Share of an effect's evidence from priors, above which it is taken for one that the tolerances had imitated."""
LEAD = 4.0
"""Lead with which an effect is named alone where all evidence, its own and the rival's, comes from priors: that of the
other method."""
ROUNDED = 5.0
"""s to which the time that is still to be recorded is rounded up."""
SLIGHTLY_LATE = 0.1
"""Least lateness of a drive that is told, in samples."""
ABOVE_NOISE = 1.2
"""Least mean square of a joint on held-out records, relative to that of noise, with which it counts for the share
removed."""


@dataclass
class TorqueWorkflow:
    """State of a diagnosis: model and fit so far, the steps taken, and the ranking of a step that added nothing."""

    model: Model
    case: TorqueCase
    controller: JudgedController
    progress: Progress
    cancel: Cancel
    added: dict[str, Parameter] = field(default_factory=dict)
    steps: list[Step] = field(default_factory=list)
    tried: tuple[Candidate, ...] = ()
    notes: list[Note] = field(default_factory=list)
    suspicion: Suspicion | None = None
    stated: dict[str, Parameter] = field(default_factory=dict)
    """Numbers that steps have named although the file states them, as it states them."""
    lowered: set[int] = field(default_factory=set)
    """Steps (indices) that lower what the file states. A law that is missing may do that as well."""

    def __post_init__(self) -> None:
        self.begin = self.model
        self.now = self._fit(self.model, {}, self.added)
        self.first = self.now
        source = {"source": tolerances(self.model)[1], "share": FITTED_SHARE}
        self.notes.append(Note(kind="tolerance-source", values=source))

    def run(self) -> None:
        """Take steps until nothing more is significant or holds."""
        while len([s for s in self.steps if s.adopted]) < self.case.options.most_steps:
            done = len(self.steps)
            self._report(0.1, "what is missing")
            found = self._search()
            if not self._adopt(found):
                self.tried = self._candidates(found)
                self.suspicion = self._suspect(found)
                break
            self._report(0.9, "what is not needed any more")
            self._prune(done)
        self._withdraw_wrong_laws()

    def _withdraw_wrong_laws(self) -> None:
        """Take back effects that the residual contradicts, and all effects after them: friction that was lowered far
        below what the file states where something is still missing, and viscous friction whose own residual bends
        with speed."""
        while (first := self._contradicted()) is not None:
            wrong = self.steps[first].joints
            for index, step in enumerate(self.steps[first:], start=first):
                if not step.adopted:
                    continue
                self.model = self._without(step)
                self.added = {name: p for name, p in self.added.items() if name not in step.parameters}
                self.steps[index] = withdrawn(step, wrong)
            self.now = self._fit(self.model, {}, self.added)
            self.suspicion, self.tried = None, ()  # they were of the model with these effects

    def _contradicted(self) -> int | None:
        """Index of the first step that the residual contradicts."""
        shapes, left = remaining_shapes(self.now, self.case), set(self._left_over())
        for index, step in enumerate(self.steps):
            joints = left & set(step.joints) if step.adopted else ()
            if any(index in self.lowered or self._bends(step, j, shapes) for j in joints):
                return index
        return None

    def _bends(self, step: Step, joint: int, shapes: Sequence[RemainingShape]) -> bool:
        """Whether a step is viscous friction, the only friction named on a joint, and another law is left there."""
        return step.effect == VISCOUS and self._only_viscous(joint) and bends_with_speed(shapes, joint)

    def _only_viscous(self, joint: int) -> bool:
        """Whether viscous friction is the only friction that was named on a joint."""
        named = {s.effect for s in self.steps if s.adopted and joint in s.joints and s.effect is not None}
        return {name for name in named if effect(name).shared_name.family == "friction"} == {VISCOUS}

    def _left_over(self) -> tuple[int, ...]:
        """Joints whose residual is far above noise on fitted and on held-out records, and slower than noise is."""
        fitted = [np.sqrt(holdout.mean_squares(self.case.stretches, self.now.residual))]
        if self.case.held_out:
            held = holdout.held_out_squares(self.model, self.now.values, self.case.held_out)
            fitted.append(np.sqrt(held))
        least = np.min(np.nan_to_num(fitted), axis=0) / self.case.noise
        beyond = (least > FAR_ABOVE_NOISE) & (self.now.noise.memory > SLOW)
        return tuple(j for j, left in zip(self.model.machine.modelled_joints, beyond, strict=True) if left)

    def _search(self) -> Findings:
        """What a step found, without what the records do not resolve."""
        found = search(self.model, self.now, self.case, self._report, self.cancel)
        resolved = [is_resolved(f, self.now, self.case) for f in found.fitted]
        return replace(
            found,
            fitted=tuple(f for f, is_one in zip(found.fitted, resolved, strict=True) if is_one),
            unresolved=tuple(f for f, is_one in zip(found.fitted, resolved, strict=True) if not is_one),
        )

    def _report(self, fraction: float, text: str) -> None:
        stop_if(self.cancel)
        whole = self.case.options.most_steps
        self.progress(min(0.99, (len(self.steps) + fraction) / (whole + 1)), f"step {len(self.steps) + 1}: {text}")

    def _fit(self, model: Model, begin: Mapping[str, float], added: Mapping[str, Parameter]) -> BalanceFit:
        """The model fitted again, with the parameters that the diagnosis has `added` without priors."""
        records, names = self.case.records, frozenset(added)
        own = [u for u in tolerances(self.begin, sizes=recorded_sizes(self.begin, records))[0] if u.name not in names]
        known = {u.name for u in own}
        sizes = {**recorded_sizes(model, records), **added}
        found = [u for u in tolerances(model, names, sizes)[0] if u.name not in known]
        unknowns = (*own, *found, *timing_unknowns(model))
        return fit(TorqueBalance(model, self.case.records), unknowns, begin, self.case.data)

    def _adopt(self, found: Findings) -> bool:
        """Adopt the best candidate that holds. False when there is none."""
        refused: list[Fitted] = []
        for chosen in found.fitted[:CHANCES]:
            told = self._evidence_held_out(chosen)
            if chosen.evidence <= 0 or chosen.evidence + told < self._needed(chosen):
                continue
            if any(chosen.rivals(one) and chosen.evidence < BESIDE_REFUSED * one.evidence for one in refused):
                continue
            reference = self._reference(chosen)
            if not self._is_beyond_noise(reference, chosen):
                continue
            before, after = self._predicted(reference, chosen.fit)
            removed = self._removed(reference, chosen, before, after)
            refusal = self._refusal(chosen, removed)
            self.steps.append(self._step(found, chosen, reference, (before, after), removed, told, refused, refusal))
            if refusal is None:
                self._take(chosen)
                return True
            refused.append(chosen)
        return False

    def _refusal(self, chosen: Fitted, removed: float) -> Refusal | None:
        """Why an effect is not taken, though it has the evidence: it explains too little of records not fitted to, or
        asks for another machine than the file describes. An effect that is there brings stated numbers back."""
        if removed < self.case.options.least_share:
            return Refusal(kind="falls-too-little", numbers={"share": removed})
        if grown := self._grown_held_out(chosen):
            return Refusal(kind="worse-than-given", numbers={"share": grown})
        if tolerances(self.model)[1] != "stated" or self._explains_most(chosen):
            return None
        before = {u.name: abs(prior_distance(u, self.now.values[u.name])[0]) for u in self.now.unknowns}
        stated = [
            u for u in chosen.fit.unknowns if u.parameter.effect is None and before.get(u.name, FAR_OFF) < FAR_OFF
        ]
        farthest = max((abs(prior_distance(u, chosen.fit.values[u.name])[0]) for u in stated), default=0.0)
        return Refusal(kind="contradicts-file", numbers={"deviations": farthest}) if farthest >= FAR_OFF else None

    def _grown_held_out(self, chosen: Fitted) -> float:
        """By which share the held-out variance is larger with an effect than with the model as given, on every joint of
        the effect; 0 where it is not. What the fit of the stated numbers has followed is then nothing that the machine
        does again, and an effect that only makes up for a part of that is none."""
        if not self.case.held_out:
            return 0.0
        given = holdout.held_out_squares(self.begin, {}, self.case.held_out)
        after = holdout.held_out_squares(chosen.model, chosen.fit.values, self.case.held_out)
        own = [j in chosen.joints or not chosen.joints for j in self.model.machine.modelled_joints]
        growth = after[own] / np.maximum(given[own], 1e-300) - 1.0
        return max(0.0, float(np.min(growth))) if np.isfinite(growth).all() else 0.0

    def _reference(self, chosen: Fitted) -> BalanceFit:
        """The fit that a candidate is held against: the last one, or that with a number as the file states it. With
        its prior, a number far off may be fitted as well as without. An effect that the tolerances can imitate, at the
        price of numbers far from what is stated, is held against what they are with it."""
        if chosen.relief > MOSTLY:
            return self._without_effect(chosen)
        if not chosen.stated:
            return self.now
        held = {p.name: p.value for p in chosen.stated}
        unknowns = [u for u in self.now.unknowns if u.name not in held]
        balance = TorqueBalance(self.model.with_values({**self.now.model_values, **held}), self.case.records)
        return fit(balance, unknowns, self.now.values, self.case.data, self.now.noise.memory)

    def _without_effect(self, chosen: Fitted) -> BalanceFit:
        """The model that lacks an effect, or has its numbers as the file states them, with all others as they are with
        it."""
        stated = {p.name: p.value for p in chosen.stated}
        known = {name: v for name, v in chosen.fit.model_values.items() if name in self.model.by_name} | stated
        balance = TorqueBalance(self.model.with_values(known), self.case.records)
        begin = {**self.now.values, **chosen.fit.values, **stated}
        return fit(balance, self.now.unknowns, begin, self.case.data, self.now.noise.memory, rounds=0)

    def _needed(self, chosen: Fitted) -> float:
        """Evidence from which a candidate is named.

        How far numbers are from what a file states does not depend on what a residual is made of, against which the
        larger least evidence guards. Of evidence that comes from priors, as much as arouses a suspicion is enough.
        """
        least = self.case.options.least_evidence
        if self._explains_most(chosen):
            least = min(least, SUSPECTED)
        least -= chosen.relief * max(least - SUSPECTED, 0.0)
        return least + self.case.options.echo * self._collected(chosen.joints)

    def _explains_most(self, chosen: Fitted) -> bool:
        """Whether an effect takes most of a residual far above noise, on the records fitted to and on held-out ones.

        A slow residual has few independent samples, so that evidence alone would ask for a longer record of what is
        plain to see: a square wave, of which a sine takes four fifths, or a spring that gets stiffer.
        """
        held = self.case.held_out
        if not held or not chosen.joints:
            return False
        fitted = [holdout.mean_squares(self.case.stretches, f.residual) for f in (self.now, chosen.fit)]
        other = [holdout.held_out_squares(f.balance.model, f.values, held) for f in (self.now, chosen.fit)]
        own = np.array([j in chosen.joints for j in self.model.machine.modelled_joints])
        far = (FAR_ABOVE_NOISE * self.case.noise[own]) ** 2
        return all(
            bool((before[own] > far).all() and (after[own] < (1 - MOST_OF_IT) * before[own]).all())
            for before, after in (fitted, other)
        )

    def _margin(self, chosen: Fitted, rival: Fitted) -> float:
        """Lead in evidence over a rival with which a candidate is named alone: as `_needed`, less where the evidence of
        both comes from priors. What one of them takes off a residual counts no more for being compared with a prior."""
        least = self.case.options.least_margin
        return least - min(chosen.relief, rival.relief) * max(least - LEAD, 0.0)

    def _is_beyond_noise(self, reference: BalanceFit, chosen: Fitted) -> bool:
        """Whether there was more than noise to explain: of a torque on a joint, on that joint."""
        fell, left = (holdout.mean_squares(self.case.stretches, f.residual) for f in (reference, chosen.fit))
        if chosen.joints and effect(chosen.effect).shared_name.acts_on == "joint torque":
            elsewhere = np.array([j not in chosen.joints for j in self.model.machine.modelled_joints])
            fell = np.where(elsewhere, np.nan, fell)
        return holdout.is_beyond_noise(fell, left, self.case.noise)

    def _removed(self, reference: BalanceFit, chosen: Fitted, before: Floats, after: Floats) -> float:
        """Share of the mean square that is gone on records not fitted to, from mean squares (n,) there."""
        fell, left = (holdout.mean_squares(self.case.stretches, f.residual) for f in (reference, chosen.fit))
        return holdout.share_removed(fell, left, before, after)

    def _suspect(self, found: Findings) -> Suspicion | None:
        """The best candidate that was not named for want of evidence alone.

        What speaks for it grows in proportion to the time recorded, and its cost hardly does.
        """
        for chosen in found.fitted[:CHANCES]:
            total, needed = chosen.evidence + self._evidence_held_out(chosen), self._needed(chosen)
            if chosen.evidence <= 0 or not SUSPECTED <= total < needed:
                continue
            reference = self._reference(chosen)
            if not self._is_beyond_noise(reference, chosen):
                continue
            elsewhere = self._predicted(reference, chosen.fit)
            if self._removed(reference, chosen, *elsewhere) < max(SUSPECTED_SHARE, self.case.options.least_share):
                continue
            recorded = sum(float(np.ptp(r.time)) for r in (*self.case.records, *self.case.held_out))
            seconds = recorded * ((needed + chosen.cost) / (total + chosen.cost) - 1)
            return Suspicion(
                effect=chosen.effect,
                joints=chosen.joints,
                evidence=total,
                needed=needed,
                seconds=ROUNDED * float(np.ceil(seconds / ROUNDED)),
            )
        return None

    def _collected(self, joints: tuple[int, ...]) -> float:
        """Evidence of the steps adopted so far on these joints, or on any for an effect of the whole machine."""
        near = (s for s in self.steps if s.adopted and (not joints or not s.joints or set(s.joints) & set(joints)))
        return sum(s.evidence + (s.evidence_held_out or 0.0) for s in near)

    def _evidence_held_out(self, chosen: Fitted) -> float:
        """What held-out records say for an effect, beside its evidence on the fitted ones; 0 where there are none."""
        if not self.case.held_out:
            return 0.0
        return holdout.evidence(self.now, chosen.fit, self.case.held_out)

    def _take(self, chosen: Fitted) -> None:
        if chosen.stated and all(chosen.fit.values[p.name] < p.value for p in chosen.stated):
            self.lowered.add(len(self.steps) - 1)
        self.stated |= {p.name: p for p in chosen.stated}
        self.added |= {p.name: p for p in chosen.parameters}
        self.model = chosen.model.with_values(chosen.fit.model_values)
        self.now = self._fit(self.model, chosen.fit.values, self.added)

    def _timing(self) -> tuple[Note, ...]:
        """How late the drives were found to act, which is taken for the way in which they are formed and held."""
        late = samples_late(self.model, self.now.values)
        if late.max() < SLIGHTLY_LATE:
            return ()
        return (Note(kind="drive-timing", values={"late": list(map(float, late)), "samples": MOST}),)

    def _at_limits(self) -> tuple[Note, ...]:
        """Where drives were at limits that no file states."""
        records = (*self.case.records, *self.case.held_out)
        shares = np.average(
            [r.at_limit.mean(axis=0) for r in records], axis=0, weights=[np.ptp(r.time) for r in records]
        )
        joints = self.model.machine.modelled_joints
        found = [(joint, float(share)) for joint, share in zip(joints, shares, strict=True) if share > 0.0]
        return (Note(kind="drive-at-limit", values={"shares": found}),) if found else ()

    def _predicted(self, before: BalanceFit, after: BalanceFit) -> tuple[Floats, Floats]:
        """Mean squares of both on records not fitted to: held-out ones, else blocks of the fitted ones."""
        held = self.case.held_out
        if held:
            squares = [holdout.held_out_squares(f.balance.model, f.values, held) for f in (before, after)]
        else:
            squares = [holdout.block_squares(f) for f in (before, after)]
        return squares[0], squares[1]

    def _step(
        self,
        found: Findings,
        chosen: Fitted,
        reference: BalanceFit,
        elsewhere: tuple[Floats, Floats],
        removed: float,
        told: float,
        refused: Sequence[Fitted],
        refusal: Refusal | None,
    ) -> Step:
        """The step that the chosen effect is.

        Args:
            reference: the fit that it is held against.
            elsewhere: mean squares (n,) on records not fitted to, before and after. told: evidence that held-out ones
                give. refused: candidates of this step that were not taken; they are no rivals. refusal: why this one
                is not.
        """
        before, after = elsewhere
        case = self.case
        standing = [c for c in found.fitted if not any(c is one for one in refused)]
        if chosen.effect in OF_CHANGES:
            standing += [c for c in found.unresolved if c.effect in OF_CHANGES and c.joints == chosen.joints]
        rivals = [c for c in standing if c.rivals(chosen) and not c.imitates(chosen, self.now)]
        near = [r for r in rivals if chosen.evidence - r.evidence < self._margin(chosen, r)]
        group = sorted({c.effect: c for c in reversed([chosen, *near])}.values(), key=lambda c: -c.evidence)
        values = found_values(chosen.fit, chosen.parameters)
        squares = [holdout.mean_squares(case.stretches, f.residual) for f in (reference, chosen.fit)]
        return Step(
            effect=chosen.effect,
            joints=chosen.joints,
            parameters=values,
            evidence=chosen.evidence,
            evidence_held_out=told if case.held_out else None,
            margin=chosen.evidence - max([0.0, *(r.evidence for r in rivals)]),
            candidates=self._candidates(found),
            group=tuple(self._candidate(c) for c in group) if near else (),
            rmse_fit=signal_errors(self.model, squares[0], squares[1], case.noise),
            rmse_holdout=signal_errors(self.model, before, after, case.noise) if case.held_out else (),
            excess_removed_holdout=self._excess_removed(squares[0], before, after) if case.held_out else None,
            where=locate(self.now, case),
            reason=UNWRITTEN,
            reason_data=Reason(removed=removed, slides=self._slides(chosen.joints)),
            adopted=refusal is None,
            refusal=refusal,
        )

    def _excess_removed(self, fitted: Floats, before: Floats, after: Floats) -> float | None:
        """Share of the held-out variance above noise that is gone, joints weighted by their fitted mean square (n,)."""
        noise = self.case.noise**2
        excess = np.maximum(before - noise, 1e-300)
        usable = np.isfinite(before) & np.isfinite(after) & (before > ABOVE_NOISE * noise)
        if not usable.any():
            return None
        weight = np.where(usable, 1 / np.maximum(fitted, 1e-300), 0.0)
        return float((weight * (before - after))[usable].sum() / (weight * excess)[usable].sum())

    def _slides(self, joints: tuple[int, ...]) -> bool:
        machine = self.model.machine
        return all(machine.joint(j).kind == "prismatic" for j in joints or machine.modelled_joints)

    def _candidates(self, found: Findings) -> tuple[Candidate, ...]:
        fitted = [self._candidate(c) for c in found.fitted[:SHOWN]]
        done = {(c.effect, c.joints) for c in found.fitted}
        cost = float(np.log(max(self.case.stretches.samples, 2)))
        others = [
            Candidate(effect=p.trial.effect, joints=p.trial.joints, evidence=p.gain - p.trial.size * cost)
            for p in found.probed
            if (p.trial.effect, p.trial.joints) not in done
        ]
        return (*fitted, *others[: max(0, SHOWN - len(fitted))])

    def _candidate(self, c: Fitted) -> Candidate:
        squares = holdout.mean_squares(self.case.stretches, c.fit.residual)
        values = {p.name: FoundValue.of(p, c.fit.values[p.name]) for p in c.parameters}
        return Candidate(
            effect=c.effect,
            joints=c.joints,
            evidence=c.evidence,
            refitted=True,
            misfit=float(np.nanmean(squares / self.case.noise**2)),
            parameters=values,
        )

    def _prune(self, latest: int) -> None:
        """Take out effects of earlier steps that the latest one has made superfluous."""
        for index, step in enumerate(self.steps[:latest]):
            if not step.adopted or step.effect is None:
                continue
            kept = {name: p for name, p in self.added.items() if name not in step.parameters}
            without = self._without(step)
            smaller = self._fit(without, self.now.values, kept)
            if evidence(smaller, self.now, self.now.noise.memory, len(step.parameters), 1) < 0:
                self.model, self.now = without.with_values(smaller.model_values), smaller
                self.added = kept
                gone = {"adopted": False, "refusal": Refusal(kind="superfluous")}
                self.steps[index] = step.model_copy(update=gone)
                self.notes.append(Note(kind="taken-out-again", values={"effect": step.effect, "step": index + 1}))

    def _without(self, step: Step) -> Model:
        """The model without the effect of a step, but for joints of which the file states it."""
        stated = {
            j for name in step.parameters if name in self.begin.by_name for j in self.begin.parameter(name).joints
        }
        joints = tuple(j for j in step.joints if j not in stated)
        if step.effect is None or (step.joints and not joints):
            return self.model
        return self.model.without_effect(step.effect, joints or None)

    def _as_last_fitted(self) -> tuple[Step, ...]:
        """The steps with the parameters of the last fit: a step's own values are biased by effects that were found
        after it."""
        steps = []
        for step in self.steps:
            own = [self.model.parameter(name) for name in step.parameters] if step.adopted else []
            last = found_values(self.now, own)
            if not own:
                steps.append(step)
                continue
            steps.append(step.model_copy(update={"parameters": last}))
        return tuple(steps)

    def _shares(self) -> Note:
        """Residual as a share of the recorded torque, before and after: the figure that the literature usually
        gives."""
        held = self.case.held_out
        records = held or self.case.records
        before = holdout.relative_torque_error(self.begin, self.first.values, records)
        after = holdout.relative_torque_error(self.model, self.now.values, records)
        return Note(kind="torque-left", values={"held_out": bool(held), "before": before, "after": after})

    def _errors(self, records: tuple[RecordedMotion, ...]) -> tuple[SignalError, ...]:
        """Errors of every joint on these records, by the given model and by the one that comes out."""
        if not records:
            return ()
        before = holdout.held_out_squares(self.begin, {}, records)
        after = holdout.held_out_squares(self.model, self.now.values, records)
        return signal_errors(self.model, before, after, self.case.noise)

    def answer(self, traces: list[str], held_out: list[str], cutoff: float) -> Diagnosis:
        """The whole answer, except for the times that it took."""
        shapes = remaining_shapes(self.now, self.case)
        steps = self._as_last_fitted()
        adopted = [s for s in steps if s.adopted]
        missing = bool(shapes) or bool(self._left_over())
        own = [u for u in self.now.unknowns if not u.nuisance]
        stated = on_stated_numbers((u for u in own if u.name not in self.added), self.now.values)
        named = on_named_numbers((p for n, p in self.stated.items() if n in self.added), self.now.values)
        lineage = Lineage(
            parent=self.begin.identity,
            traces=tuple(traces),
            fit={"fitted": [u.name for u in own]},
            note="diagnosis",
        )
        proved = self.controller.steps(self.begin, self.case.noise)
        found = self.model.with_values(self.now.model_values)
        fit_errors, held_errors = self._errors(self.case.records), self._errors(self.case.held_out)
        return Diagnosis(
            verdict=verdict(
                (*proved, *steps), unexplained=missing and not adopted, suspected=self.suspicion is not None
            ),
            suspicion=None if adopted else self.suspicion,
            summary=UNWRITTEN,
            method="inverse-dynamics",
            steps=(*proved, *steps),
            rmse_fit=fit_errors,
            rmse_holdout=held_errors,
            gap=torque_gap(fit_errors, held_errors, steps),
            where=locate(self.now, self.case),
            candidates=self.tried,
            remaining=shapes,
            model_before=self.begin,
            model_after=self.controller.with_findings(found).with_lineage(lineage),
            traces=tuple(traces),
            holdout=tuple(held_out),
            seconds=0.0,
            robot_seconds=0.0,
            significant=self.case.options.least_evidence,
            notes_data=(
                *stated,
                *named,
                self._shares(),
                *_assumptions(cutoff, self.controller.not_looked_for),
                *self._at_limits(),
                *self._timing(),
                *self.notes,
            ),
        )


def _assumptions(cutoff: float, not_looked_for: Mapping[str, str]) -> tuple[Note, ...]:
    return (
        Note(kind="cutoff", values={"cutoff": cutoff}),
        Note(kind="resting-left-out"),
        Note(kind="not-looked-for", values={"effects": dict(not_looked_for)}),
        Note(kind="positions-of-links"),
    )
