"""Describes a parameter in words: its owner, its meaning, and both together."""

from __future__ import annotations

import math
from collections.abc import Iterable

from daq.contracts.frozen import like
from daq.contracts.service.jobs import EffectInModel, ModelParameter, ParameterWords
from model.effects.names import effect_name, placed
from model.machine_model.model import Model
from model.machine_model.parameter import Kind, Parameter


def words_of(parameter: Parameter) -> ParameterWords:
    """Returns the words for a parameter: of `joint2.motor.back_emf_constant`, J2 motor back-EMF constant."""
    joints, component = parameter.joints, parameter.component
    only = joints[0] if len(joints) == 1 else None
    if component == "link":
        group = whose = f"link {only}"
    elif joints:
        group = f"joint{'' if only else 's'} {'+'.join(map(str, joints))}"
        whose = f"J{only}" if only else group
    else:
        group = whose = effect_name(component)
    short = _short(parameter)
    return ParameterWords(joint=only, group=group, short=short, label=f"{whose} {short}")


def words_by_name(parameters: Iterable[Parameter]) -> dict[str, ParameterWords]:
    """Returns the words for each of the parameters, by its name."""
    return {parameter.name: words_of(parameter) for parameter in parameters}


def _short(parameter: Parameter) -> str:
    part = effect_name(parameter.part)
    if parameter.effect is not None:
        return f"{effect_name(parameter.effect)} {part}"
    if parameter.kind not in (Kind.GEOMETRY, Kind.INERTIA, Kind.DRIVE, Kind.CONTROLLER):
        return parameter.kind.value
    return f"{parameter.component} {part}" if parameter.component in ("motor", "drive") else part


# --- The effects and the parameters of a model for clients


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
