"""The effects and the parameters of a model for clients."""

from __future__ import annotations

import math

from daq.contracts.frozen import like
from daq.contracts.service.jobs import EffectInModel, ModelParameter
from model.effects.names import placed
from model.machine_model.model import Model
from model.machine_model.parameter_words import words_of


def effects_of(model: Model) -> tuple[EffectInModel, ...]:
    """Returns the effects with their names for people."""
    return tuple(like(EffectInModel, use, called=placed(use.name, use.joints)) for use in model.effects)


def parameters_of(model: Model) -> tuple[ModelParameter, ...]:
    """Returns the parameters; a bound that is infinite is None."""
    return tuple(
        like(ModelParameter, one, words=words_of(one), low=_finite(one.low), high=_finite(one.high))
        for one in model.parameters
    )


def _finite(value: float | None) -> float | None:
    return None if value is None or math.isinf(value) else value
