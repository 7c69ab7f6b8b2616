"""How well a model's numbers are known from the fits that it comes from."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Any

from pydantic import Field, FiniteFloat, ValidationError

from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from model.machine_model.model import Lineage, Model

LEAST_SHARE = 0.25
"""Least share of an expected deviation that an earlier fit leaves: other records are of another day, with warmer gears
and another mounting, and the model that was fitted is not exact. An assumption."""


class Estimate(FrozenRecord):
    """A number after a fit, with its standard deviation, in the number's unit."""

    value: FiniteFloat
    deviation: Annotated[FiniteFloat, Field(gt=0)]


class Learnt(FrozenRecord):
    """What a model file keeps of the fits that it comes from, as a part of `Lineage.fit`.

    posterior: estimates by the number's name. learnt_from: identities of the traces of all fits.
    """

    posterior: dict[str, Estimate] = {}
    learnt_from: tuple[str, ...] = ()


def summarise_posterior(
    before: Lineage, traces: Iterable[str], estimates: Iterable[tuple[str, float, float | None]]
) -> dict[str, Any]:
    """What a fitted model keeps of its fit for the next diagnosis, as a part of `Lineage.fit`.

    Args:
        before: lineage of the model that was fitted. traces: identities of the traces that it was fitted to.
        estimates: name, value and standard deviation of each number; a deviation is None, or not finite, where the
            records do not determine the number.
    """
    posterior = {
        name: {"value": float(value), "deviation": float(deviation)}
        for name, value, deviation in estimates
        if deviation is not None and math.isfinite(deviation) and deviation > 0.0
    }
    return {"posterior": posterior, "learnt_from": sorted({*_learnt_from(before), *traces})}


def load_posterior(model: Model, traces: Iterable[str]) -> Mapping[str, float]:
    """Standard deviations of the model's numbers after the fits that it comes from, by name, where they are smaller
    than what is expected of the machine.

    A number that was changed since then has none. Nor has any, where one of the traces (identities; fitted or held out)
    is one that the model has learnt from: what a record says counts once.

    Raises:
        SpecError: for a model file whose lineage holds something else in their place.
    """
    if set(traces) & _learnt_from(model.lineage):
        return {}
    found = {}
    for name, estimate in _learnt(model.lineage).posterior.items():
        p = model.by_name.get(name)
        if p is None or p.value != estimate.value or p.deviation is None:
            continue
        if estimate.deviation < p.deviation:
            found[name] = max(estimate.deviation, LEAST_SHARE * p.deviation)
    return found


def _learnt_from(lineage: Lineage) -> set[str]:
    """Identities of the traces of all fits that a model comes from."""
    return {*lineage.traces, *_learnt(lineage).learnt_from}


def _learnt(lineage: Lineage) -> Learnt:
    """The part of `Lineage.fit`, in which a file may hold anything. Raises SpecError."""
    kept = {name: part for name, part in (lineage.fit or {}).items() if name in Learnt.model_fields}
    try:
        return Learnt.model_validate(kept)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, ("lineage", "fit", *first["loc"])))
        raise SpecError(f"model: {where}: {first['msg']}") from None
