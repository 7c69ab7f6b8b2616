"""Steps of a diagnosis by inverse dynamics: find an effect that is missing, add it, check that it holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from daq.contracts.progress import Cancel, Progress, stop_if
from model.discrepancy.diagnosis import Candidate, Suspicion
from model.discrepancy.grounds import Note, Refusal
from model.discrepancy.inverse_dynamics import holdout
from model.discrepancy.inverse_dynamics.fitting import TorqueCase
from model.discrepancy.inverse_dynamics.judging import has_another_form, judge, share_of_rest, suspect
from model.discrepancy.inverse_dynamics.resolution import is_resolved
from model.discrepancy.inverse_dynamics.search import (
    Findings,
    Fitted,
    evidence,
    order_by_odds,
    prefer_fewer_joints,
    prefer_shorter_laws,
    search,
)
from model.discrepancy.inverse_dynamics.standing import Standing, begin
from model.discrepancy.inverse_dynamics.step_record import list_tried, record_step
from model.discrepancy.inverse_dynamics.tolerances import FITTED_SHARE, tolerances
from model.discrepancy.thresholds import CHANCES, LARGER_PART
from model.discrepancy.verdict import withdrawn
from model.effects.names import effect_on
from model.machine_model.model import Model


@dataclass
class TorqueWorkflow:
    """State of a diagnosis: what was found so far, and the ranking of a step that added nothing."""

    model: Model
    case: TorqueCase
    progress: Progress
    cancel: Cancel
    tried: tuple[Candidate, ...] = ()
    notes: list[Note] = field(default_factory=list)
    suspicion: Suspicion | None = None

    def __post_init__(self) -> None:
        self.found = begin(self.model, self.case)
        self.first = self.found.now
        fitted = len(self.found.known)
        source = {"source": tolerances(self.model)[1], "share": FITTED_SHARE, "fitted": fitted}
        self.notes.append(Note(kind="tolerance-source", values=source))

    def run(self) -> None:
        """Take steps until nothing more is significant or holds."""
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
            before = self.found
            self._report(0.1, "what is missing")
            findings = self._search(before)
            self.found = self._adopt(before, findings)
            if len(self.found.adopted) == len(before.adopted):
                self.tried = list_tried(self.found, findings)
                self.suspicion = suspect(self.found, findings)
                break
            self._report(0.9, "what is not needed any more")
            self._prune(len(before.steps))

    def _report(self, fraction: float, text: str) -> None:
        stop_if(self.cancel)
        whole, done = self.case.options.most_steps, len(self.found.steps)
        named = ", ".join(effect_on(s.effect, s.joints) for s in self.found.adopted if s.effect)
        so_far = f"found so far: {named}; " if named else ""
        self.progress(min(0.99, (done + fraction) / (whole + 1)), f"{so_far}step {done + 1}: {text}")

    def _search(self, found: Standing) -> Findings:
        """What a step finds, without what the records do not resolve, the most probable by all records first."""
        findings = search(found.model, found.now, self.case, self._report, self.cancel)
        fitted = prefer_fewer_joints(sorted(self._with_held_out(found, findings.fitted), key=order_by_odds))
        fitted = prefer_shorter_laws(fitted, found.now, self.case.options.least_margin)
        resolved = [is_resolved(f, found.now, self.case) for f in fitted]
        return replace(
            findings,
            fitted=tuple(f for f, is_one in zip(fitted, resolved, strict=True) if is_one),
            unresolved=tuple(f for f, is_one in zip(fitted, resolved, strict=True) if not is_one),
        )

    def _with_held_out(self, found: Standing, candidates: Sequence[Fitted]) -> list[Fitted]:
        """Candidates with what held-out records say for them; those for which fitted records do not speak are left."""
        held = self.case.held_out
        asked = [c for c in candidates if held and c.evidence > 0]
        told = holdout.evidence(found.now, [c.fit for c in asked], held, self.case.noise)
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
                return replace(found.take(chosen), steps=tuple(steps))
            refused.append(chosen)
        return replace(found, steps=tuple(steps))

    def _prune(self, latest: int) -> None:
        """Take out effects of earlier steps that the latest one has made superfluous."""
        for step in self.found.steps[:latest]:
            if not step.adopted or step.effect is None:
                continue
            now, without = self.found.now, self.found.remove(step)
            if evidence(without.now, now, now.noise.memory, len(step.parameters), 1) < 0:
                gone = step.model_copy(update={"adopted": False, "refusal": Refusal(kind="superfluous")})
                self.found = replace(without, steps=tuple(gone if s is step else s for s in self.found.steps))

    def _withdraw_lesser_ones(self) -> None:
        """Take back, the least first, effects that explain less than half of what stays unexplained beside them.

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
        """Take back the first effect whose law is of another form than what is there, and all effects after it."""
        steps = self.found.steps
        forms = ((k, has_another_form(self.found, step)) for k, step in enumerate(steps) if step.adopted)
        first, wrong = next((found for found in forms if found[1]), (len(steps), ()))
        if not wrong:
            return
        for step in steps[first:]:
            if step.adopted:
                now = tuple(withdrawn(s, wrong) if s is step else s for s in self.found.steps)
                self.found = replace(self.found.remove(step), steps=now)
        self.suspicion, self.tried = None, ()  # they were of the model with these effects
