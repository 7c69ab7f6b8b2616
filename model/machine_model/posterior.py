"""Standard deviations of a model's parameters after the fits in its lineage."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Any

from pydantic import Field, FiniteFloat, ValidationError

from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from model.machine_model.model import Lineage, Model

LEAST_SHARE = 0.25
"""Least share of an expected deviation that remains after an earlier fit: other records are of another day, with warmer
gears and another mounting, and the fitted model is not exact. An assumption."""


class Estimate(FrozenRecord):
    """A parameter's value after a fit, with its standard deviation, in its unit."""

    value: FiniteFloat
    deviation: Annotated[FiniteFloat, Field(gt=0)]


class Learnt(FrozenRecord):
    """Results of the fits in a model's lineage, stored in `Lineage.fit`.

    posterior: estimates by the parameter's name. learnt_from: identities of the traces of all fits.
    """

    posterior: dict[str, Estimate] = {}
    learnt_from: tuple[str, ...] = ()


def summarise_posterior(
    before: Lineage, traces: Iterable[str], estimates: Iterable[tuple[str, float, float | None]]
) -> dict[str, Any]:
    """Returns results of a fit for the next diagnosis, to be stored in `Lineage.fit`.

    Args:
        before: lineage of the model that was fitted. traces: identities of the traces that it was fitted to.
        estimates: name, value and standard deviation of each parameter; a deviation is None, or not finite, if the
            records do not determine it.
    """
    posterior = {
        name: {"value": float(value), "deviation": float(deviation)}
        for name, value, deviation in estimates
        if deviation is not None and math.isfinite(deviation) and deviation > 0.0
    }
    return {"posterior": posterior, "learnt_from": sorted({*_learnt_from(before), *traces})}


def load_posterior(model: Model, traces: Iterable[str]) -> Mapping[str, float]:
    """Returns standard deviations of the model's parameters after its fits, by name, if smaller than the machine's
    expected ones.

    A parameter that was changed since then has none. Empty if one of the traces (identities; fitted or held out) was
    used in those fits: a record must not count twice.

    Raises:
        SpecError: for a model file with invalid data in its lineage.
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
    """Returns identities of the traces of all fits in a model's lineage."""
    return {*lineage.traces, *_learnt(lineage).learnt_from}


def _learnt(lineage: Lineage) -> Learnt:
    """Returns the part of `Lineage.fit`, in which a file may hold anything. Raises SpecError."""
    kept = {name: part for name, part in (lineage.fit or {}).items() if name in Learnt.model_fields}
    try:
        return Learnt.model_validate(kept)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, ("lineage", "fit", *first["loc"])))
        raise SpecError(f"model: {where}: {first['msg']}") from None
