"""Finds parameters that differ between models, and by how much."""

from __future__ import annotations

from collections.abc import Sequence

from daq.contracts.frozen import FrozenRecord
from model.machine_model.model import Model

SAME = 1e-12
"""Relative difference below which two values are the same number."""


class ParameterDifference(FrozenRecord):
    """One parameter with its value in each model, None if a model does not have it.

    `deviations` is the range of the values in expected deviations; None if a model lacks the parameter or no deviation
    is expected.
    """

    name: str
    unit: str
    values: tuple[float | None, ...]
    deviations: float | None


def differences(models: Sequence[Model]) -> tuple[ParameterDifference, ...]:
    """Returns parameters whose values differ between models, in the order of the first model that has them."""
    names: dict[str, None] = {}
    for model in models:
        names |= dict.fromkeys(p.name for p in model.parameters)
    found = []
    for name in names:
        own = [m.by_name.get(name) for m in models]
        values = tuple(None if p is None else p.value for p in own)
        numbers = [v for v in values if v is not None]
        widest = max(numbers) - min(numbers)
        if len(numbers) == len(models) and widest <= SAME * max(abs(v) for v in numbers):
            continue
        first = next(p for p in own if p is not None)
        deviations = widest / first.deviation if first.deviation and len(numbers) == len(models) else None
        found.append(ParameterDifference(name=name, unit=first.unit, values=values, deviations=deviations))
    return tuple(found)
