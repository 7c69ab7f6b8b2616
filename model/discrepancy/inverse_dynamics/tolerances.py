"""Which numbers of a model may be slightly wrong although no effect is missing: unknowns with priors and bounds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from model.discrepancy.engine.priors import free_unknown, unknown_of
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model
from model.machine_model.parameter import Kind, Parameter

FITTED_SHARE = 0.05
"""Standard deviation, as a share, of numbers that were fitted before, on a machine that states none: an assumption."""
FREE_SHARE = 1.0
"""The same for numbers that were not fitted: they are nearly free."""
DeviationSource = Literal["stated", "fitted-before", "free"]
"""Where deviations come from: the machine file; an assumption after an earlier fit; nowhere (nearly free)."""


def tolerances(
    model: Model,
    added: frozenset[str] = frozenset(),
    sizes: Mapping[str, Parameter] | None = None,
    fitted: Mapping[str, float] | None = None,
) -> tuple[tuple[Unknown, ...], DeviationSource]:
    """Parameters that may be wrong, and where their deviations come from.

    Args:
        added: effects' parameters (full names) that the diagnosis itself put in; they have no prior.
        sizes: effects' parameters by name, with deviations that follow from the records.
        fitted: deviations of earlier fits by name, where they are smaller (`posterior.load_posterior`).
    """
    known, better = sizes or {}, fitted or {}
    every = [known.get(p.name, p) for p in model.parameters]
    own = [p for p in every if p.name not in added]
    of_machine = [p for p in model.parameters if p.deviation is not None and p.effect is None]
    stated = [p for p in of_machine if p.name not in added]
    bodies = [p for p in own if p.kind is Kind.INERTIA and p.value != 0.0]
    machine: list[tuple[Parameter, float | None]]
    source: DeviationSource
    if of_machine:
        machine = [(p, p.deviation) for p in stated]
        source = "stated"
    elif model.lineage.traces:
        machine = [(p, FITTED_SHARE * abs(p.value)) for p in bodies]
        source = "fitted-before"
    else:
        machine = [(p, FREE_SHARE * abs(p.value)) for p in bodies]
        source = "free"
    effects = [(p, p.deviation) for p in own if p.effect is not None]
    found = [free_unknown(p) for p in every if p.name in added]
    claimed = ((p, better.get(p.name, d)) for p, d in (*machine, *effects))
    return (*(unknown_of(p, d) for p, d in claimed), *found), source
