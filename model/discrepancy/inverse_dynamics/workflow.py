"""Steps of a diagnosis by inverse dynamics: find an effect that is missing, add it, check that it holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from daq.contracts.progress import Cancel, Progress, stop_if
from model.discrepancy.diagnosis import Candidate, Diagnosis, Step, Suspicion
from model.discrepancy.grounds import Note, Refusal
from model.discrepancy.inverse_dynamics.answer import Outcome, answer_of
from model.discrepancy.inverse_dynamics.case import TorqueCase
from model.discrepancy.inverse_dynamics.fitting import BalanceFit, fit
from model.discrepancy.inverse_dynamics.judged_controller import JudgedController
from model.discrepancy.inverse_dynamics.judging import CHANCES, judge
from model.discrepancy.inverse_dynamics.left_over import first_contradicted
from model.discrepancy.inverse_dynamics.resolution import is_resolved, sizes_at_bounds
from model.discrepancy.inverse_dynamics.search import Findings, Fitted, evidence, search
from model.discrepancy.inverse_dynamics.standing import Standing
from model.discrepancy.inverse_dynamics.step_record import list_tried, record_step
from model.discrepancy.inverse_dynamics.suspicion import suspect
from model.discrepancy.inverse_dynamics.tolerances import FITTED_SHARE, tolerances
from model.discrepancy.verdict import withdrawn
from model.inverse_dynamics.drive_timing import timing_unknowns
from model.inverse_dynamics.recorded_sizes import recorded_sizes
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter
from model.machine_model.posterior import load_posterior


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
    at_bounds: list[Note] = field(default_factory=list)
    """Effects that would have been named, had their sizes not ended where no machine is."""
    suspicion: Suspicion | None = None
    stated: dict[str, Parameter] = field(default_factory=dict)
    """Numbers that steps have named although the file states them, as it states them."""
    lowered: set[int] = field(default_factory=set)
    """Steps (indices) that lower what the file states. A law that is missing may do that as well."""

    def __post_init__(self) -> None:
        self.given = self.model
        self.now = self._fit(self.model, {}, self.added)
        self.first = self.now
        source = {"source": tolerances(self.model)[1], "share": FITTED_SHARE, "fitted": len(self._known_before)}
        self.notes.append(Note(kind="tolerance-source", values=source))

    @property
    def standing(self) -> Standing:
        """Where the diagnosis stands now."""
        return Standing(self.case, self.given, self.model, self.now, tuple(self.steps))

    def run(self) -> None:
        """Take steps until nothing more is significant or holds."""
        while len([s for s in self.steps if s.adopted]) < self.case.options.most_steps:
            done = len(self.steps)
            self._report(0.1, "what is missing")
            found = self._search()
            if not self._adopt(found):
                self.tried = list_tried(self.standing, found)
                self.suspicion = suspect(self.standing, found)
                self.at_bounds = self._on_sizes_at_bounds(found)
                break
            self._report(0.9, "what is not needed any more")
            self._prune(done)
        self._withdraw_wrong_laws()

    def answer(self, traces: Sequence[str], held_out: Sequence[str], cutoff: float) -> Diagnosis:
        """The whole answer, except for its sentences and the times that it took.

        Args:
            traces, held_out: identities of the traces that were fitted to, and that were not.
            cutoff: of the torques, Hz.
        """
        outcome = Outcome(
            standing=self.standing,
            controller=self.controller,
            first=self.first,
            added=self.added,
            stated=self.stated,
            tried=self.tried,
            suspicion=self.suspicion,
            notes=(*self.notes, *self.at_bounds),
        )
        return answer_of(outcome, traces, held_out, cutoff)

    def _report(self, fraction: float, text: str) -> None:
        stop_if(self.cancel)
        whole = self.case.options.most_steps
        self.progress(min(0.99, (len(self.steps) + fraction) / (whole + 1)), f"step {len(self.steps) + 1}: {text}")

    def _fit(self, model: Model, begin: Mapping[str, float], added: Mapping[str, Parameter]) -> BalanceFit:
        """The model fitted again, with the parameters that the diagnosis has `added` without priors."""
        records, names = self.case.records, frozenset(added)
        before = tolerances(self.given, sizes=recorded_sizes(self.given, records), fitted=self._known_before)[0]
        own = [u for u in before if u.name not in names]
        known = {u.name for u in own}
        sizes = {**recorded_sizes(model, records), **added}
        found = [u for u in tolerances(model, names, sizes)[0] if u.name not in known]
        unknowns = (*own, *found, *timing_unknowns(model))
        return fit(TorqueBalance(model, self.case.records), unknowns, begin, self.case.data)

    @cached_property
    def _known_before(self) -> Mapping[str, float]:
        """Deviations of the given model's numbers, by name, that earlier fits to other records know better."""
        return load_posterior(self.given, (r.name for r in (*self.case.records, *self.case.held_out)))

    def _search(self) -> Findings:
        """What a step found, without what the records do not resolve."""
        found = search(self.model, self.now, self.case, self._report, self.cancel)
        resolved = [is_resolved(f, self.now, self.case) for f in found.fitted]
        return replace(
            found,
            fitted=tuple(f for f, is_one in zip(found.fitted, resolved, strict=True) if is_one),
            unresolved=tuple(f for f, is_one in zip(found.fitted, resolved, strict=True) if not is_one),
        )

    def _on_sizes_at_bounds(self, found: Findings) -> list[Note]:
        """What would have been enough evidence to be named, had its size not ended where no machine is."""
        enough = [f for f in found.unresolved if f.evidence >= self.case.options.least_evidence]
        best = {(f.effect, f.joints): f for f in reversed(enough) if _own_bounds(f)}
        return [_size_at_bound(f) for f in best.values()]

    def _adopt(self, found: Findings) -> bool:
        """Adopt the best candidate that holds. False when there is none."""
        refused: list[Fitted] = []
        passed_over: list[Fitted] = []  # they explain noise, or other records speak against them: no rivals either
        for chosen in found.fitted[:CHANCES]:
            judgement = judge(self.standing, chosen, refused)
            if judgement is None:
                passed_over.append(chosen)
                continue
            self.steps.append(record_step(self.standing, found, judgement, [*refused, *passed_over]))
            if judgement.refusal is None:
                self._take(chosen)
                return True
            refused.append(chosen)
        return False

    def _take(self, chosen: Fitted) -> None:
        friction = bool(chosen.stated) and all(p.effect is not None for p in chosen.stated)
        if friction and all(chosen.fit.values[p.name] < p.value for p in chosen.stated):
            self.lowered.add(len(self.steps) - 1)
        self.stated |= {p.name: p for p in chosen.stated}
        self.added |= {p.name: p for p in chosen.parameters}
        self.model = chosen.model.with_values(chosen.fit.model_values)
        self.now = self._fit(self.model, chosen.fit.values, self.added)

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

    def _withdraw_wrong_laws(self) -> None:
        """Take back effects that the residual contradicts, and all effects after them: friction that was lowered far
        below what the file states where something is still missing, and viscous friction whose own residual bends
        with speed."""
        while (first := first_contradicted(self.standing, self.lowered)) is not None:
            wrong = self.steps[first].joints
            for index, step in enumerate(self.steps[first:], start=first):
                if not step.adopted:
                    continue
                self.model = self._without(step)
                self.added = {name: p for name, p in self.added.items() if name not in step.parameters}
                self.steps[index] = withdrawn(step, wrong)
            self.now = self._fit(self.model, {}, self.added)
            self.suspicion, self.tried, self.at_bounds = None, (), []  # they were of the model with these effects

    def _without(self, step: Step) -> Model:
        """The model without the effect of a step, but for joints of which the file states it."""
        stated = {
            j for name in step.parameters if name in self.given.by_name for j in self.given.parameter(name).joints
        }
        joints = tuple(j for j in step.joints if j not in stated)
        if step.effect is None or (step.joints and not joints):
            return self.model
        return self.model.without_effect(step.effect, joints or None)


def _own_bounds(found: Fitted) -> list[Parameter]:
    """Sizes of a candidate that ended where no machine is, and not merely where the records say nothing more."""
    known = found.model.by_name
    return [p for p in sizes_at_bounds(found) if (p.low, p.high) == (known[p.name].low, known[p.name].high)]


def _size_at_bound(found: Fitted) -> Note:
    """The first size of a candidate that ended at its bound."""
    p = _own_bounds(found)[0]
    values = {"effect": found.effect, "joints": list(found.joints), "evidence": found.evidence}
    return Note(
        kind="size-at-bound", values={**values, "name": p.part, "value": found.fit.values[p.name], "unit": p.unit}
    )
