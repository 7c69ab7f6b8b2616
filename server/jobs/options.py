"""Options and effects of a study, as its request gives them, for the functions that compute it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeVar

from daq.contracts.service.jobs import DiagnoseStudy, EffectChoice, FitStudy

if TYPE_CHECKING:
    from model.discrepancy.options import DiagnosisOptions
    from model.fitting.options import FitOptions
    from model.machine_model.model import Model

Chosen = TypeVar("Chosen", "FitOptions", "DiagnosisOptions")


def options_of(study: FitStudy | DiagnoseStudy, kind: type[Chosen]) -> Chosen:
    """Returns the options of a study. Options that are not given get the method's defaults."""
    given = {name: getattr(study, name, None) for name in kind.model_fields}
    return kind(**{name: value for name, value in given.items() if value is not None})


def with_effects(model: Model, effects: Sequence[EffectChoice]) -> Model:
    """Adds effects to a model; an effect without joints acts on all possible ones. Raises SpecError."""
    from model.effects.library import effect

    for choice in effects:
        found = effect(choice.name)
        if found.whole_machine:
            model = model.with_effect(choice.name)
        else:
            every = tuple(j for j in model.machine.modelled_joints if not found.joints or j in found.joints)
            model = model.with_effect(choice.name, choice.joints or every)
    return model
