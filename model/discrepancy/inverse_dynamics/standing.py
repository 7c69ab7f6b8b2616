"""Where a diagnosis by inverse dynamics stands, and how that changes with an effect more or less."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from model.discrepancy.diagnosis import Step
from model.discrepancy.inverse_dynamics.fitting import BalanceFit, TorqueCase, fit
from model.discrepancy.inverse_dynamics.search import Fitted
from model.discrepancy.inverse_dynamics.tolerances import tolerances
from model.inverse_dynamics.drive_timing import timing_unknowns
from model.inverse_dynamics.recorded_sizes import recorded_sizes
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter
from model.machine_model.posterior import load_posterior


@dataclass(frozen=True)
class Standing:
    """The records of a diagnosis and what it has made of them so far.

    given: the model as the user gave it. known: deviations of its numbers, by name, that earlier fits to other records
    know better. model: the one with the effects found so far. now: the fit of that.
    added: parameters that the diagnosis has added, or whose priors it has lifted. stated: those of them that the file
    states, as it states them. steps: those that were tried so far, adopted or not.
    """

    case: TorqueCase
    given: Model
    known: Mapping[str, float]
    model: Model
    now: BalanceFit
    added: Mapping[str, Parameter]
    stated: Mapping[str, Parameter]
    steps: tuple[Step, ...] = ()

    @property
    def adopted(self) -> tuple[Step, ...]:
        """The steps that hold."""
        return tuple(step for step in self.steps if step.adopted)

    def take(self, chosen: Fitted) -> Standing:
        """Adds a candidate to the model and fits that; the step is the caller's to add."""
        added = {**self.added, **{p.name: p for p in chosen.parameters}}
        stated = {**self.stated, **{p.name: p for p in chosen.stated}}
        model = chosen.model.with_values(chosen.fit.model_values)
        now = _fit(self.case, self.given, self.known, model, chosen.fit, added)
        return replace(self, model=model, now=now, added=added, stated=stated)

    def remove(self, step: Step) -> Standing:
        """Takes the effect of a step out and fits the rest; numbers of the file that it had named are tolerances again.
        The step stays in the list."""
        added, stated = (
            {name: p for name, p in own.items() if name not in step.parameters} for own in (self.added, self.stated)
        )
        now = _fit(self.case, self.given, self.known, self.model_without(step), self.now, added)
        model = now.balance.model.with_values(now.model_values)
        return replace(self, model=model, now=now, added=added, stated=stated)

    def model_without(self, step: Step, model: Model | None = None) -> Model:
        """The model, or another one, without the effect of a step, but for joints of which the file states it."""
        model, known = model or self.model, self.given.by_name
        stated = {j for name in step.parameters if name in known for j in known[name].joints}
        joints = tuple(j for j in step.joints if j not in stated)
        if step.effect is None or (step.joints and not joints):
            return model
        return model.without_effect(step.effect, joints or None)


def begin(given: Model, case: TorqueCase) -> Standing:
    """The model as it was given, with its numbers fitted."""
    known = load_posterior(given, (r.name for r in (*case.records, *case.held_out)))
    return Standing(case, given, known, given, _fit(case, given, known, given, None, {}), {}, {})


def _fit(
    case: TorqueCase,
    given: Model,
    known: Mapping[str, float],
    model: Model,
    begun: BalanceFit | None,
    added: Mapping[str, Parameter],
) -> BalanceFit:
    """The model fitted, with the numbers that the file states free within their tolerances, and those that the
    diagnosis has `added` without priors."""
    names = frozenset(added)
    before = tolerances(given, sizes=recorded_sizes(given, case.records), fitted=known)[0]
    own = [u for u in before if u.name not in names]
    sizes = {**recorded_sizes(model, case.records), **added}
    found = [u for u in tolerances(model, names, sizes)[0] if u.name not in {o.name for o in own}]
    unknowns = [*own, *found, *timing_unknowns(model)]
    values, near = ({}, None) if begun is None else (begun.values, begun.derivatives)
    return fit(case.balance(model), unknowns, values, case.data, near=near)
