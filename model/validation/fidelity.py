"""Validates by distortion in its transfer-function form (section 4.4): does Σλ² reach 1?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.progress import Cancel, Never, Progress, silent, stop_if
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.fitting.judged import left_beside_nuisances
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter
from model.machine_model.record_verdict import RecordVerdict
from model.record_check.check import as_used, check_records, require_computable
from model.record_check.finding import doubts_headline
from model.simulation.prepared import Options
from model.validation.criterion import (
    DAMPING_RATIO,
    Curve,
    Fidelity,
    ParameterDistortion,
    contribution,
    required_deviation,
)
from model.validation.doubling import Doubling, SquaredError, doubling_changes, squared_error
from model.validation.expected_deviation import expected_deviation

SEARCH_DEVIATIONS = 50.0
"""Largest change that is tried, in expected deviations; a parameter that needs more adds less than 0.0003 to Σλ²."""
CURVE_REACH = 1.5
"""Extent of an error curve to either side, in doubling changes (in expected deviations where no change doubles)."""
MINIMUM_TOLERANCE = 0.98
"""Share of the error at the given parameters. A smaller error elsewhere shows that they are not the minimum."""


@dataclass(frozen=True)
class _Varied:
    """Parameters to vary one at a time: values, expected deviations and bounds of the search, (p,) each."""

    parameters: tuple[Parameter, ...]
    best: Floats
    expected: Floats
    low: Floats
    high: Floats


def validate_by_distortion(
    model: Model,
    traces: Sequence[Trace],
    names: Sequence[str],
    *,
    outputs: Sequence[int] | None = None,
    damping_ratio: float = DAMPING_RATIO,
    curve_points: int = 0,
    options: Options | None = None,
    progress: Progress = silent,
    cancel: Cancel | None = None,
) -> Fidelity:
    """Computes how far each named parameter alone would have to vary to explain the model's error.

    Args:
        model: fitted to the traces; the method assumes that its error is the least.
        names: the parameters that were fitted.
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
    record = check_records(model, traces, torques=False)
    require_computable(record)
    traces = as_used(traces, model.machine, "closed" if options is None else options.loop)
    error = squared_error(model, traces, names, outputs, options)
    varied = _varied(tuple(model.parameter(name) for name in names))
    share = 0.8 if curve_points else 1.0
    least, doublings = doubling_changes(
        error.total,
        varied.best,
        varied.low,
        varied.high,
        varied.expected,
        lambda f, text: progress(share * f, text),
        cancel,
    )
    errors = error.by_joint(varied.best[None])[0]
    distortions = [_distortion(p, d, damping_ratio) for p, d in zip(varied.parameters, doublings, strict=True)]
    left = [one for one in left_beside_nuisances(model, traces, cancel) if one.joint in error.outputs]
    verdict = RecordVerdict.of(model, left, sum(map(len, error.traces)))
    return Fidelity(
        model=model.identity,
        traces=tuple(t.record.trace_id for t in traces),
        outputs=error.outputs,
        convention="source",
        damping_ratio=damping_ratio,
        error=least,
        error_by_joint=tuple(map(float, errors)),
        left=tuple(left),
        verdict=verdict.doubted(doubts_headline(record)),
        parameters=tuple(distortions),
        sum_of_contributions=math.fsum(d.contribution for d in distortions),
        curves=_curves(error, varied, distortions, curve_points, progress, cancel) if curve_points else (),
        notes=tuple(_notes(varied.parameters, doublings)),
        record=record,
    )


def _varied(parameters: tuple[Parameter, ...]) -> _Varied:
    value = np.array([p.value for p in parameters])
    expected = np.array([expected_deviation(p, "source")[0] for p in parameters])
    reach = SEARCH_DEVIATIONS * expected
    low = np.maximum([p.low for p in parameters], value - reach)
    high = np.minimum([p.high for p in parameters], value + reach)
    # a length, a mass or a resistance of exactly zero is impossible
    positive = (low == 0) & (value > 0)
    return _Varied(parameters, value, expected, np.where(positive, 1e-6 * value, low), high)


def _distortion(parameter: Parameter, doubling: Doubling, damping_ratio: float) -> ParameterDistortion:
    expected, basis = expected_deviation(parameter, "source")
    change = doubling.mean
    required = None if change is None else required_deviation(change, damping_ratio)
    return ParameterDistortion(
        name=parameter.name,
        unit=parameter.unit,
        value=parameter.value,
        change_down=doubling.down,
        change_up=doubling.up,
        required=required,
        expected=expected,
        basis=basis,
        contribution=contribution(required, expected),
    )


def _notes(parameters: Sequence[Parameter], doublings: Sequence[Doubling]) -> list[str]:
    notes = []
    for p, d in zip(parameters, doublings, strict=True):
        if d.lowest < MINIMUM_TOLERANCE:
            notes.append(
                f"{p.name}: the error falls to {d.lowest:.3g} of its value, so the model is not at its minimum"
            )
        if d.down is None and d.up is None:
            notes.append(f"{p.name}: insensitive: no change within its bounds doubles the error")
        elif d.down is None or d.up is None:
            side = "downwards" if d.down is None else "upwards"
            notes.append(
                f"{p.name}: no change {side} within its bounds doubles the error; only the other direction counts"
            )
    return notes


def _curves(
    error: SquaredError,
    varied: _Varied,
    distortions: Sequence[ParameterDistortion],
    points: int,
    progress: Progress,
    cancel: Cancel | None,
) -> tuple[Curve, ...]:
    curves = []
    for k, distortion in enumerate(distortions):
        stop_if(cancel or Never())
        progress(0.8 + 0.2 * k / len(distortions), f"error curve of {distortion.name}")
        curves.append(_curve(error, varied, k, distortion, points))
    progress(1.0, "error curves: done")
    return tuple(curves)


def _curve(error: SquaredError, varied: _Varied, k: int, distortion: ParameterDistortion, points: int) -> Curve:
    down, up = distortion.change_down, distortion.change_up
    fallback = up or down or 5 * distortion.expected
    first = max(varied.low[k], varied.best[k] - CURVE_REACH * (down or fallback))
    last = min(varied.high[k], varied.best[k] + CURVE_REACH * (up or fallback))
    values = np.linspace(first, last, points)
    sets = np.tile(varied.best, (points, 1))
    sets[:, k] = values
    errors = tuple(float(e) if np.isfinite(e) else None for e in error.total(sets))
    return Curve(name=distortion.name, unit=distortion.unit, values=tuple(map(float, values)), errors=errors)
