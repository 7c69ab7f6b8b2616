"""The fidelity criterion (4.63, 4.88 to 4.93): σ, λ² and their sum. Pure arithmetic and its typed result."""

from __future__ import annotations

import math
from typing import ClassVar

from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from model.machine_model.model import Model
from model.machine_model.record_verdict import JointLeft, RecordVerdict
from model.record_check.finding import RecordFinding
from model.validation.expected_deviation import Basis, Convention, expected_deviation

DAMPING_RATIO = 0.5
"""ζ of the associate system (section 7.2.2)."""


class ParameterDistortion(FrozenRecord):
    """Variation of one parameter alone that would explain the residual.

    `change_down` and `change_up` (magnitudes, in `unit`) double the total mean squared error; None if no change within
    the bounds does. `required` is σ, the standard deviation that would explain the residual; None for an insensitive
    parameter, whose σ is very large. `expected` is τ′, `contribution` is λ² = τ′²/σ².
    """

    name: str
    unit: str
    value: float
    change_down: float | None
    change_up: float | None
    required: float | None
    expected: float
    basis: Basis
    contribution: float

    @property
    def insensitive(self) -> bool:
        """Whether no change doubles the error."""
        return self.required is None


class Curve(FrozenRecord):
    """Mean squared error (rad², None where a run diverged) against one parameter's value; all others are held."""

    name: str
    unit: str
    values: tuple[float, ...]
    errors: tuple[float | None, ...]


class Fidelity(FrozenRecord):
    """Result of the transfer-function form of the distortion method, for one model and its traces.

    `outputs` are the joints whose errors count, `error_by_joint` their mean squared errors (rad²), `error` the sum. If
    `sum_of_contributions` (Σλ²) is at least 1, expected deviations of the parameters explain the error. `verdict`:
    whether the error exceeds noise; None in results of older versions.
    """

    shown: ClassVar[tuple[str, ...]] = ("model", "traces", "sum_of_contributions", "said")
    model: str
    traces: tuple[str, ...]
    outputs: tuple[int, ...]
    convention: Convention
    damping_ratio: float
    error: float
    error_by_joint: tuple[float, ...]
    left: tuple[JointLeft, ...] = ()
    """What the model leaves of the traces beside its nuisances, by output; empty in results of older versions."""
    parameters: tuple[ParameterDistortion, ...]
    sum_of_contributions: float
    curves: tuple[Curve, ...] = ()
    notes: tuple[str, ...] = ()
    verdict: RecordVerdict | None = None
    record: tuple[RecordFinding, ...] = ()
    """Findings of the check of the traces, before the computation."""

    @property
    def said(self) -> str:
        """Returns the verdict in words, and whether expected deviations of the parameters explain the error."""
        total = f"Σλ² = {self.sum_of_contributions:.3g}"
        if self.explains and self.verdict is not None and not self.verdict.explains:
            share = (
                f"{total}: parameters as far off as expected could alone cause this much; so could a missing effect."
            )
        elif self.explains:
            share = f"{total}: parameters as far off as expected explain this error (1 or more)."
        else:
            share = f"{total}: parameters as far off as expected do not explain this error (below 1)."
        return share if self.verdict is None else f"{self.verdict.text} {share}"

    @property
    def explains(self) -> bool:
        """Whether Σλ² ≥ 1 (4.93)."""
        return self.sum_of_contributions >= 1.0

    def parameter(self, name: str) -> ParameterDistortion:
        """Returns the parameter of that name. Raises KeyError."""
        return {p.name: p for p in self.parameters}[name]


def required_deviation(doubling_change: float, damping_ratio: float = DAMPING_RATIO) -> float:
    """Returns σ from α_d: σ² = 4ζ(ζ+1)/(2ζ+1) · α_d², that is 1.5 α_d² at ζ = 0.5 (4.63, 4.88).

    Raises SpecError for a damping ratio that is not positive.
    """
    if not (math.isfinite(damping_ratio) and damping_ratio > 0):
        raise SpecError(f"damping ratio {damping_ratio}: must be positive")
    return doubling_change * math.sqrt(4 * damping_ratio * (damping_ratio + 1) / (2 * damping_ratio + 1))


def contribution(required: float | None, expected: float) -> float:
    """Returns λ² = τ′²/σ² (4.92); zero for an insensitive parameter."""
    return 0.0 if required is None else (expected / required) ** 2


# --- Re-evaluates distortions with another convention of τ′. The changes that double the error do not depend on it


def in_convention(found: Fidelity, model: Model, convention: Convention) -> Fidelity:
    """Returns `found` with τ′, λ² and Σλ² of another convention, without simulating again."""
    parameters = []
    for one in found.parameters:
        expected, basis = expected_deviation(model.parameter(one.name), convention)
        judged = {"expected": expected, "basis": basis, "contribution": contribution(one.required, expected)}
        parameters.append(one.model_copy(update=judged))
    total = math.fsum(p.contribution for p in parameters)
    return found.model_copy(
        update={"parameters": tuple(parameters), "convention": convention, "sum_of_contributions": total}
    )
