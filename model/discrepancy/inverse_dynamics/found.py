"""What a diagnosis by inverse dynamics has found so far, and how that changes with an effect more or less."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from model.discrepancy.diagnosis import Step
from model.discrepancy.inverse_dynamics.case import TorqueCase
from model.discrepancy.inverse_dynamics.fitting import BalanceFit, fit
from model.discrepancy.inverse_dynamics.search import Fitted
from model.discrepancy.inverse_dynamics.standing import Standing
from model.discrepancy.inverse_dynamics.tolerances import tolerances
from model.inverse_dynamics.drive_timing import timing_unknowns
from model.inverse_dynamics.recorded_sizes import recorded_sizes
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter
from model.machine_model.posterior import load_posterior


@dataclass(frozen=True)
class Found:
    """A model with the effects found so far, and its fit.

    added: parameters that the diagnosis has added, or whose priors it has lifted. stated: those of them that the file
    states, as it states them. steps: those that were tried, adopted or not.
    """

    model: Model
    now: BalanceFit
    added: Mapping[str, Parameter]
    stated: Mapping[str, Parameter]
    steps: tuple[Step, ...] = ()

    @property
    def adopted(self) -> tuple[Step, ...]:
        """The steps that hold."""
        return tuple(step for step in self.steps if step.adopted)


@dataclass(frozen=True)
class Refitter:
    """Fits a model again, with the numbers that the file states free within their tolerances.

    given: the model as the user gave it.
    """

    given: Model
    case: TorqueCase

    @cached_property
    def known_before(self) -> Mapping[str, float]:
        """Deviations of the given model's numbers, by name, that earlier fits to other records know better."""
        return load_posterior(self.given, (r.name for r in (*self.case.records, *self.case.held_out)))

    def begin(self) -> Found:
        """The model as it was given, with its numbers fitted."""
        return Found(self.given, self._fit(self.given, {}, {}), {}, {})

    def standing(self, found: Found) -> Standing:
        """What the next step is judged against."""
        return Standing(self.case, self.given, found.model, found.now, found.steps)

    def take(self, found: Found, chosen: Fitted) -> Found:
        """Adds a candidate to the model and fits that; the step is the caller's to add."""
        values = chosen.fit.values
        added = {**found.added, **{p.name: p for p in chosen.parameters}}
        model = chosen.model.with_values(chosen.fit.model_values)
        return replace(
            found,
            model=model,
            now=self._fit(model, values, added),
            added=added,
            stated={**found.stated, **{p.name: p for p in chosen.stated}},
        )

    def remove(self, found: Found, step: Step) -> Found:
        """Takes the effect of a step out and fits the rest; numbers of the file that it had named are tolerances again.
        The step stays in the list."""
        own = set(step.parameters)
        added = {name: p for name, p in found.added.items() if name not in own}
        model = self._without(found.model, step)
        now = self._fit(model, found.now.values, added)
        return replace(
            found,
            model=model.with_values(now.model_values),
            now=now,
            added=added,
            stated={name: p for name, p in found.stated.items() if name not in own},
        )

    def _without(self, model: Model, step: Step) -> Model:
        """The model without the effect of a step, but for joints of which the file states it."""
        known = self.given.by_name
        stated = {j for name in step.parameters if name in known for j in known[name].joints}
        joints = tuple(j for j in step.joints if j not in stated)
        if step.effect is None or (step.joints and not joints):
            return model
        return model.without_effect(step.effect, joints or None)

    def _fit(self, model: Model, begin: Mapping[str, float], added: Mapping[str, Parameter]) -> BalanceFit:
        """The model fitted, with the parameters that the diagnosis has `added` without priors."""
        records, names = self.case.records, frozenset(added)
        before = tolerances(self.given, sizes=recorded_sizes(self.given, records), fitted=self.known_before)[0]
        own = [u for u in before if u.name not in names]
        known = {u.name for u in own}
        sizes = {**recorded_sizes(model, records), **added}
        found = [u for u in tolerances(model, names, sizes)[0] if u.name not in known]
        unknowns = [*own, *found, *timing_unknowns(model)]
        return fit(TorqueBalance(model, records), unknowns, begin, self.case.data)
