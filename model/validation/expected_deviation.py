"""Expected deviations of parameters from their values (τ′ of section 7.2.2)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import Literal

from daq.contracts.errors import SpecError
from model.machine_model.model import Model
from model.machine_model.parameter import Kind, Parameter

LENGTH_SHARE = 0.03
"""Expected standard deviation of a length or radius, as a share of its value."""
MASS_SHARE = 0.10
"""Expected standard deviation of a mass, as a share of its value."""

Convention = Literal["source", "three_sigma"]
"""For Gaussian parameters: `source` is τ′ = â/(3√2), which reproduces the published sums; `three_sigma` is â/3."""

Basis = Literal["length", "mass", "gaussian", "stated"]
"""Basis of τ′; `stated` is the deviation written in the machine file or the effect."""


def gaussian_share(convention: Convention) -> float:
    """Returns τ′/â of a parameter that must be positive: zero lies three standard deviations away.

    The source uses the three as the argument of erf, not as a deviate of the normal density, hence the √2.
    """
    return 1 / (3 * math.sqrt(2)) if convention == "source" else 1 / 3


def deviation_share(basis: Basis, convention: Convention) -> float:
    """Returns τ′/â of a length, a mass or a Gaussian parameter."""
    return {"length": LENGTH_SHARE, "mass": MASS_SHARE}.get(basis, gaussian_share(convention))


def basis_of(parameter: Parameter) -> Basis:
    """Returns the rule for a model parameter's expected deviation."""
    if parameter.effect is None and parameter.unit == "kg":
        return "mass"
    if parameter.kind is Kind.GEOMETRY:
        return "length"
    if parameter.value > 0 and parameter.low >= 0:
        return "gaussian"
    return "stated"


def expected_deviation(parameter: Parameter, convention: Convention) -> tuple[float, Basis]:
    """Returns τ′ of a model parameter and its rule.

    Raises:
        SpecError: for a parameter that may be zero or negative and has no stated deviation.
    """
    basis = basis_of(parameter)
    if basis != "stated":
        return abs(parameter.value) * deviation_share(basis, convention), basis
    if parameter.deviation is None or not parameter.deviation > 0:
        raise SpecError(
            f"{parameter.name}: no expected deviation is stated, none follows from {parameter.value} {parameter.unit}"
        )
    return parameter.deviation, basis


# --- Selects the parameters that a validation varies


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
