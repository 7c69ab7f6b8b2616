"""Where a diagnosis stands, and how that changes with an effect more or less."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from model.discrepancy.diagnosis import Step
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.case import Case
from model.discrepancy.engine.fitting import Fit, fit
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter


@dataclass(frozen=True)
class Standing:
    """The records of a diagnosis and what it has made of them so far.

    now: the fit of the model with the effects found so far. first: the fit of the given one.
    added: parameters that the diagnosis has added, or whose priors it has lifted. stated: those of them that the file
    states, as it states them. steps: those that were tried so far, adopted or not.
    """

    case: Case
    now: Fit
    first: Fit
    added: Mapping[str, Parameter]
    stated: Mapping[str, Parameter]
    steps: tuple[Step, ...] = ()

    @property
    def model(self) -> Model:
        """The model with the effects found so far, with its fitted numbers."""
        return self.now.fitted_model

    @property
    def adopted(self) -> tuple[Step, ...]:
        """The steps that hold."""
        return tuple(step for step in self.steps if step.adopted)

    def take(self, chosen: Fitted) -> Standing:
        """Adds a candidate to the model and fits that; the step is the caller's to add."""
        added = {**self.added, **{p.name: p for p in chosen.parameters}}
        stated = {**self.stated, **{p.name: p for p in chosen.stated}}
        now = self._fit(chosen.fit.fitted_model, chosen.fit, added)
        return replace(self, now=now, added=added, stated=stated)

    def remove(self, step: Step) -> Standing:
        """Takes the effect of a step out and fits the rest; numbers of the file that it had named are tolerances again.
        The step stays in the list."""
        added, stated = (
            {name: p for name, p in own.items() if name not in step.parameters} for own in (self.added, self.stated)
        )
        now = self._fit(self.model_without(step, self.model), self.now, added) if added else self.first
        return replace(self, now=now, added=added, stated=stated)

    def model_without(self, step: Step, model: Model) -> Model:
        """A model without the effect of a step, but for joints of which the file states it, or that have tolerances of
        it."""
        known = self.case.compared.model.by_name
        stated = {j for name in step.parameters if name in known for j in known[name].joints}
        joints = tuple(j for j in step.joints if j not in stated)
        if step.effect is None or (step.joints and not joints):
            return model
        laws = {p.effect for name in step.parameters if (p := model.by_name.get(name)) is not None and p.effect}
        for law in sorted(laws or {step.effect}):
            model = model.without_effect(law, joints or None)
        return model

    def _fit(self, model: Model, begun: Fit, added: Mapping[str, Parameter]) -> Fit:
        unknowns = self.case.unknowns(model, added)
        fitted = fit(begun.compared.of_model(model), unknowns, begun.values, known=begun.known or None)
        return self.case.or_from_expected(fitted)


def begin(case: Case, first: Fit | None = None) -> Standing:
    """The model as it was given, with its numbers fitted, as `first` if that is known."""
    first = first or case.first(case.unknowns(case.given, {}))
    return Standing(case, first, first, {}, {})
