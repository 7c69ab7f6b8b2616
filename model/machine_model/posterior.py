"""How well a model's numbers are known from the fit that it comes from."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from model.machine_model.model import Model

LEAST_KEPT = 0.25
"""Least share of an expected deviation that an earlier fit leaves: other records are of another day, with warmer gears
and another mounting, and the model that was fitted is not exact. An assumption."""


def determined(deviations: Iterable[tuple[str, float | None]]) -> dict[str, float]:
    """What a lineage keeps of a fit's standard deviations, by name: those of numbers that the records determine."""
    return {name: float(d) for name, d in deviations if d is not None and math.isfinite(d) and d > 0.0}


def known_from_fit(model: Model, traces: Iterable[str]) -> Mapping[str, float]:
    """Standard deviations of the model's numbers after the fit that it comes from, by name, where they are smaller than
    what is expected of the machine. The model has the values beside them.

    Empty for a model that was fitted to one of these traces (identities): what a record says counts once.
    """
    if set(traces) & set(model.lineage.traces):
        return {}
    found = {}
    for name, deviation in ((model.lineage.fit or {}).get("deviations") or {}).items():
        expected = model.by_name[name].deviation if name in model.by_name else None
        if expected is not None and deviation < expected:
            found[name] = max(deviation, LEAST_KEPT * expected)
    return found
