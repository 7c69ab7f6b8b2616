"""Validation by distortion in its transfer-function form (section 4.4): does Σλ² reach 1?"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from daq.contracts.progress import Cancel, Never, Progress, silent, stop_if
from daq.contracts.trace import Trace
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter
from model.simulation.prepared import Options
from model.validation.criterion import (
    DAMPING_RATIO,
    Curve,
    Fidelity,
    ParameterDistortion,
    contribution,
    required_deviation,
)
from model.validation.doubling import Doubling, doubling_changes
from model.validation.expected_deviation import Convention, expected_deviation
from model.validation.squared_error import SquaredError, squared_error

Floats = NDArray[np.float64]

SEARCH_DEVIATIONS = 50.0
"""Changes up to so many expected deviations are tried; what needs more would add less than 0.0003 to Σλ²."""
CURVE_REACH = 1.5
"""Curves reach from −1.5 to +1.5 doubling changes (expected deviations where none doubles)."""
MINIMUM_TOLERANCE = 0.98
"""An error below this share of the one at the given parameters shows that they are no minimum."""


def validate_by_distortion(
    model: Model, traces: Sequence[Trace], names: Sequence[str], *, outputs: Sequence[int] | None = None,
    convention: Convention = "source", damping_ratio: float = DAMPING_RATIO, curve_points: int = 0,
    options: Options | None = None, progress: Progress = silent, cancel: Cancel | None = None,
) -> Fidelity:  # fmt: skip
    """How far each of the named parameters alone would have to vary to explain what the model misses.

    Args:
        model: fitted to the traces: the method takes its error as the least. names: the parameters that were fitted.
        outputs: joints whose errors count; all modelled ones by default, one for the single-variable case (4.4.1).
        curve_points: points of each doubled-error curve (figures 4.4, 7.8); 0 for none.
        options: of the simulation.

    Raises:
        SpecError: for unknown parameters or joints, an exact fit, or a damping ratio that is not positive.
        CancelledError: when cancelled.
    """
    if not names:
        raise SpecError("no parameters: name at least one that was fitted")
    required_deviation(1.0, damping_ratio)
    error = squared_error(model, traces, names, outputs, options)
    parameters = [model.parameter(name) for name in names]
    best = np.array([p.value for p in parameters])
    expected = np.array([expected_deviation(p, convention)[0] for p in parameters])
    low, high = _search_bounds(parameters, expected)
    share = 0.8 if curve_points else 1.0
    least, doublings = doubling_changes(
        error.total, best, low, high, expected, lambda f, text: progress(share * f, text), cancel
    )
    distortions = [_distortion(p, d, convention, damping_ratio) for p, d in zip(parameters, doublings, strict=True)]
    curves = _curves(error, parameters, distortions, low, high, curve_points, progress, cancel) if curve_points else ()
    return Fidelity(
        model=model.identity, traces=tuple(t.record.trace_id for t in traces), outputs=error.outputs,
        convention=convention, damping_ratio=damping_ratio, error=least,
        error_by_joint=tuple(float(e) for e in error.by_joint(best[None])[0]), parameters=tuple(distortions),
        sum_of_contributions=math.fsum(d.contribution for d in distortions), curves=curves,
        notes=tuple(_notes(parameters, doublings)),
    )  # fmt: skip


def _search_bounds(parameters: Sequence[Parameter], expected: Floats) -> tuple[Floats, Floats]:
    value = np.array([p.value for p in parameters])
    reach = SEARCH_DEVIATIONS * expected
    low = np.maximum([p.low for p in parameters], value - reach)
    high = np.minimum([p.high for p in parameters], value + reach)
    # a length, a mass or a resistance of exactly zero is no machine
    positive = (low == 0) & (value > 0)
    return np.where(positive, 1e-6 * value, low), high


def _distortion(
    parameter: Parameter, doubling: Doubling, convention: Convention, damping_ratio: float
) -> ParameterDistortion:
    expected, basis = expected_deviation(parameter, convention)
    change = doubling.mean
    required = None if change is None else required_deviation(change, damping_ratio)
    return ParameterDistortion(
        name=parameter.name, unit=parameter.unit, value=parameter.value, change_down=doubling.down,
        change_up=doubling.up, required=required, expected=expected, basis=basis,
        contribution=contribution(required, expected),
    )  # fmt: skip


def _notes(parameters: Sequence[Parameter], doublings: Sequence[Doubling]) -> list[str]:
    notes = []
    for p, d in zip(parameters, doublings, strict=True):
        if d.lowest < MINIMUM_TOLERANCE:
            notes.append(f"{p.name}: the error falls to {d.lowest:.3g} of its value; the model is not at its minimum")
        if d.down is None and d.up is None:
            notes.append(f"{p.name}: insensitive: no change within its bounds doubles the error")
        elif d.down is None or d.up is None:
            side = "downwards" if d.down is None else "upwards"
            notes.append(f"{p.name}: no change {side} within its bounds doubles the error; the other one counts alone")
    return notes


def _curves(
    error: SquaredError, parameters: Sequence[Parameter], distortions: Sequence[ParameterDistortion], low: Floats,
    high: Floats, points: int, progress: Progress, cancel: Cancel | None,
) -> tuple[Curve, ...]:  # fmt: skip
    cancel = cancel or Never()
    best = np.array([p.value for p in parameters])
    curves = []
    for k, (parameter, distortion) in enumerate(zip(parameters, distortions, strict=True)):
        stop_if(cancel)
        progress(0.8 + 0.2 * k / len(parameters), f"error curve of {parameter.name}")
        down, up = distortion.change_down, distortion.change_up
        fallback = up or down or 5 * distortion.expected
        first = max(low[k], best[k] - CURVE_REACH * (down or fallback))
        last = min(high[k], best[k] + CURVE_REACH * (up or fallback))
        values = np.linspace(first, last, points)  # fmt: skip
        sets = np.tile(best, (points, 1))
        sets[:, k] = values
        errors = tuple(float(e) if np.isfinite(e) else None for e in error.total(sets))
        curves.append(Curve(name=parameter.name, unit=parameter.unit, values=tuple(map(float, values)), errors=errors))
    progress(1.0, "error curves: done")
    return tuple(curves)
