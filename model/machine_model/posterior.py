"""How well a model's numbers are known from the fits that it comes from."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from model.machine_model.model import Lineage, Model

LEAST_SHARE = 0.25
"""Least share of an expected deviation that an earlier fit leaves: other records are of another day, with warmer gears
and another mounting, and the model that was fitted is not exact. An assumption."""


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
    """
    if set(traces) & _learnt_from(model.lineage):
        return {}
    found = {}
    for name, estimate in ((model.lineage.fit or {}).get("posterior") or {}).items():
        p = model.by_name.get(name)
        if p is None or p.value != estimate["value"] or p.deviation is None:
            continue
        if estimate["deviation"] < p.deviation:
            found[name] = max(estimate["deviation"], LEAST_SHARE * p.deviation)
    return found


def _learnt_from(lineage: Lineage) -> set[str]:
    """Identities of the traces of all fits that a model comes from."""
    return {*lineage.traces, *((lineage.fit or {}).get("learnt_from") or ())}
