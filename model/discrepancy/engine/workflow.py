"""Steps of a diagnosis: find an effect that is missing, add it, check that it holds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from daq.contracts.progress import Cancel, Progress, stop_if
from model.discrepancy.diagnosis import Candidate, Step, Suspicion
from model.discrepancy.engine import holdout
from model.discrepancy.engine.candidate import Fitted, numbers_of
from model.discrepancy.engine.case import Case
from model.discrepancy.engine.exchange import challengers, in_place_of
from model.discrepancy.engine.fitting import Fit
from model.discrepancy.engine.judging import judge, needed_evidence, share_of_rest, suspect
from model.discrepancy.engine.probing import rise_without
from model.discrepancy.engine.search import (
    Findings,
    best_of_each,
    evidence,
    improved,
    order_by_odds,
    prefer_fewer_joints,
    prefer_shorter_laws,
    search,
    weigh,
)
from model.discrepancy.engine.standing import Standing, begin
from model.discrepancy.engine.step_record import list_tried, record_step, rivals_of
from model.discrepancy.grounds import Note, Refusal
from model.discrepancy.thresholds import CHANCES, LARGER_PART
from model.discrepancy.verdict import withdrawn
from model.effects.names import effect_on


@dataclass
class Workflow:
    """State of a diagnosis: what was found so far, and the ranking of a step that added nothing.

    recorded: s, time of all records. rivals: candidates close to the last effect that was added.
    """

    case: Case
    recorded: float
    progress: Progress
    cancel: Cancel
    first: Fit | None = None
    """The fit of the given model, where it is known."""
    tried: tuple[Candidate, ...] = ()
    notes: list[Note] = field(default_factory=list)
    suspicion: Suspicion | None = None
    rivals: tuple[Fitted, ...] = ()
    places: dict[int, tuple[Fitted, ...]] = field(default_factory=dict)
    """By number of a step, its effect and those that may stand in its place."""
    left: tuple[int, ...] = ()
    """Joints on which more is left than noise, and is no noise."""

    def __post_init__(self) -> None:
        self._report(0.0, "fitting the tolerance parameters")
        self.found = begin(self.case, self.first)

    def run(self) -> None:
        """Takes steps until nothing more is significant or holds."""
        self._take_steps()
        self._withdraw_lesser_ones()
        self._withdraw_wrong_laws()
        self.notes += [
            Note(kind="taken-out-again", values={"effect": step.effect, "step": number})
            for number, step in enumerate(self.found.steps, start=1)
            if step.refusal is not None and step.refusal.kind == "superfluous"
        ]

    def _take_steps(self) -> None:
        most = self.case.options.most_steps
        for _ in range(2 * most):  # two effects may make each other superfluous in turn
            if len(self.found.adopted) >= most:
                break
            self._report(0.1, "what is missing")
            before, findings = self._searched()
            self.found = self._adopt(before, findings)
            if len(self.found.adopted) == len(before.adopted):
                self.tried = list_tried(self.found, findings)
                self.suspicion = suspect(self.found, findings, self.recorded)
                break
            self._report(0.9, "what is not needed any more")
            self._prune(len(before.steps))
            self._exchange()

    def _report(self, fraction: float, text: str) -> None:
        stop_if(self.cancel)
        found = getattr(self, "found", None)
        steps, adopted = ((), ()) if found is None else (found.steps, found.adopted)
        named = ", ".join(effect_on(s.effect, s.joints) for s in adopted if s.effect)
        so_far = f"found so far: {named}; " if named else ""
        share = (len(steps) + fraction) / (self.case.options.most_steps + 1)
        self.progress(min(0.99, share), f"{so_far}step {len(steps) + 1}: {text}")

    def _searched(self) -> tuple[Standing, Findings]:
        """Where the diagnosis stands, and what a step finds there: from a better fit, if the best candidate leads to
        one without its effect. That fall of the cost is no merit of the candidate."""
        found = self.found
        findings = self._search(found)
        better = improved(found.now, findings.fitted[0].fit) if findings.fitted else None
        if better is None:
            return found, findings
        found = replace(found, now=better, first=found.first if found.adopted else better)
        return found, self._search(found)

    def _search(self, found: Standing) -> Findings:
        """What a step finds, without what the records do not resolve, the most probable by all records first."""
        findings = search(found.now, self.case, partial(needed_evidence, found), self._report, self.cancel)
        options = self.case.options
        ranked = sorted(self._with_held_out(found, findings.fitted), key=order_by_odds)
        fitted = prefer_fewer_joints(best_of_each(ranked), options.least_margin)
        fitted = prefer_shorter_laws(fitted, findings.now, options.least_margin)
        resolved = [self.case.is_resolved(f, findings.now) for f in fitted]
        return replace(
            findings,
            fitted=tuple(f for f, is_one in zip(fitted, resolved, strict=True) if is_one),
            unresolved=tuple(f for f, is_one in zip(fitted, resolved, strict=True) if not is_one),
        )

    def _with_held_out(self, found: Standing, candidates: Sequence[Fitted]) -> list[Fitted]:
        """Candidates with what held-out records say for them; those for which fitted records do not speak are left."""
        asked = [c for c in candidates if self.case.held_out is not None and c.evidence > 0]
        told = holdout.evidence(self.case, found.now, [c.fit for c in asked])
        others = [c for c in candidates if not any(c is one for one in asked)]
        return [
            *(replace(c, told=one.alone, told_compared=one.compared) for c, one in zip(asked, told, strict=True)),
            *others,
        ]

    def _adopt(self, found: Standing, findings: Findings) -> Standing:
        """Adds the best candidate that holds, if there is one, and the steps that were refused before it."""
        refused: list[Fitted] = []
        passed_over: list[Fitted] = []  # they lack evidence, or explain noise
        steps = list(found.steps)
        for chosen in findings.fitted:
            if len(refused) == CHANCES:
                break
            compared = judge(found, chosen, refused)
            if compared is None:
                passed_over.append(chosen)
                continue
            steps.append(record_step(found, findings, compared, [*refused, *passed_over]))
            if compared.refusal is None:
                self.rivals = (chosen, *rivals_of(found, findings, chosen, [*refused, *passed_over]))
                self.places[len(steps) - 1] = challengers(chosen, findings.fitted)
                return replace(found.take(chosen), steps=tuple(steps))
            refused.append(chosen)
        return replace(found, steps=tuple(steps))

    def _prune(self, latest: int) -> None:
        """Takes out effects of earlier steps, and single joints of theirs, that the latest one has made superfluous."""
        for number, step in enumerate(self.found.steps[:latest]):
            if not step.adopted or step.effect is None:
                continue
            if (without := self._if_superfluous(step, 0.0)) is not None:
                gone = step.model_copy(update={"adopted": False, "refusal": Refusal(kind="superfluous")})
                self.found = replace(without, steps=_with(self.found.steps, number, gone))
                continue
            for joint in step.joints if len(step.joints) > 1 else ():
                left = self.found.steps[number]
                own = {name: value for name, value in left.parameters.items() if value.joints == (joint,)}
                part = left.model_copy(update={"joints": (joint,), "parameters": own})
                without = self._if_superfluous(part, self.case.options.least_margin) if own else None
                if without is not None:
                    others = {name: value for name, value in left.parameters.items() if name not in own}
                    joints = tuple(j for j in left.joints if j != joint)
                    fewer = left.model_copy(update={"joints": joints, "parameters": others})
                    self.found = replace(without, steps=_with(self.found.steps, number, fewer))

    def _exchange(self) -> None:
        """Puts a rival in the place of an earlier step on the joints of the latest one where it explains more beside
        that."""
        *earlier, latest = self.found.steps
        for number, step in enumerate(earlier):
            rivals = self.places.get(number, ())
            apart = step.joints and latest.joints and not set(step.joints) & set(latest.joints)
            if not step.adopted or apart or len(rivals) < 2 or rivals[0].joints != step.joints:
                continue
            without, fits = in_place_of(step, self.found, rivals)
            ranked = sorted(self._with_held_out(without, weigh(without.now, fits)), key=order_by_odds)
            ranked = prefer_shorter_laws(ranked, without.now, self.case.options.least_margin)
            ranked = [f for f in ranked if self.case.is_resolved(f, without.now)]
            if not ranked or ranked[0].effect == step.effect:
                continue
            compared = judge(without, ranked[0], ())
            if compared is None or compared.refusal is not None:
                continue
            other = record_step(without, Findings(without.now, tuple(ranked), ()), compared, ())
            self.found = replace(without.take(ranked[0]), steps=_with(self.found.steps, number, other))
            self.places[number] = tuple(ranked)

    def _if_superfluous(self, part: Step, needed: float) -> Standing | None:
        """The standing without an effect, if all the others explain as much but for evidence that is less than
        `needed`; else None. It is only fitted where derivatives leave that open."""
        now = self.found.now
        independent = float((now.compared.samples.told / now.memory).min())
        rise = independent * math.log1p(rise_without(now, part.parameters) / independent)
        size = numbers_of(now, [now.model.by_name[name] for name in part.parameters])
        if LARGER_PART * rise > needed + size * math.log(now.compared.samples.told.sum()):
            return None
        without = self.found.remove(part)
        return without if evidence(without.now, self.found.now, size, 1) < needed else None

    def _withdraw_lesser_ones(self) -> None:
        """Takes back, the least first, effects that explain less than half of what stays unexplained beside them.

        A law that is not in the library is as large as what is left. It resembles one or another law of the library to
        a part of its size, on every record, so that evidence does not tell: what it looks like is no name.
        """
        while self.found.adopted:
            shares = [(share_of_rest(self.found, step), step) for step in self.found.adopted]
            share, least = min(shares, key=lambda one: one[0])
            if share >= LARGER_PART:
                return
            why = Refusal(kind="less-than-rest", numbers={"share": share})
            gone = least.model_copy(update={"adopted": False, "refusal": why})
            without = self.found.remove(least)
            self.found = replace(without, steps=tuple(gone if s is least else s for s in without.steps))
            self.suspicion, self.tried = None, ()  # they were of the model with this effect

    def _withdraw_wrong_laws(self) -> None:
        """Takes back the first effect whose law is of another form than what is there, and all effects after it."""
        steps = self.found.steps
        self.left = self._joints_left()
        forms = ((k, self.case.wrong_on(s, self.left)) for k, s in enumerate(steps) if s.adopted)
        first, wrong = next((found for found in forms if found[1]), (len(steps), ()))
        if not wrong:
            return
        for step in steps[first:]:
            if step.adopted:
                now = tuple(withdrawn(s, wrong) if s is step else s for s in self.found.steps)
                self.found = replace(self.found.remove(step), steps=now)
        self.suspicion, self.tried = None, ()  # they were of the model with these effects
        self.left = self._joints_left() or wrong

    def _joints_left(self) -> tuple[int, ...]:
        return self.case.joints_left(self.found.now, self.found.first, named=bool(self.found.adopted))


def _with(steps: Sequence[Step], number: int, step: Step) -> tuple[Step, ...]:
    """The steps, of which one is another."""
    return (*steps[:number], step, *steps[number + 1 :])
