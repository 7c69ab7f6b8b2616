"""Selects the parameters that a validation varies."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

from daq.contracts.errors import SpecError
from model.machine_model.model import Model


def names_to_validate(model: Model, patterns: Sequence[str] | None = None) -> tuple[str, ...]:
    """Returns names that match the patterns; without patterns fitted parameters, or else all with an expected
    deviation.

    Raises SpecError for a pattern that matches nothing, or an empty selection.
    """
    names = [p.name for p in model.parameters]
    if patterns is not None:
        for pattern in patterns:
            if not any(fnmatchcase(n, pattern) for n in names):
                model.parameter(pattern)
        return tuple(n for n in names if any(fnmatchcase(n, p) for p in patterns))
    fitted = (model.lineage.fit or {}).get("fitted", [])
    if chosen := tuple(n for n in names if n in fitted):
        return chosen
    chosen = tuple(p.name for p in model.parameters if p.deviation and not p.sets_torque_scale)
    if not chosen:
        raise SpecError("no parameter has an expected deviation: name those to vary with --parameters")
    return chosen
