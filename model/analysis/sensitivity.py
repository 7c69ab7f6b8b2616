"""Computes sensitivity curves: how much each parameter changes the readings along a run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from daq.contracts.trace import Trace
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter
from model.simulation.prepared import Options
from model.simulation.simulate import sensitivities
from model.validation.expected_deviation import expected_deviation


class SensitivityCurve(FrozenRecord):
    """Change of each joint's reading (rad, m) along a run when one parameter changes by its expected deviation.

    `by_joint` has one series per modelled joint; `rms` is over all of them.
    """

    name: str
    unit: str
    expected: float
    by_joint: tuple[tuple[float, ...], ...]
    rms: float

    @property
    def peaks(self) -> tuple[int, ...]:
        """Index of each joint's largest magnitude in its series."""
        return tuple(max(range(len(series)), key=lambda k: abs(series[k])) for series in self.by_joint)

    @property
    def moves_most(self) -> int:
        """Index of the joint whose reading the parameter changes most."""
        largest = [abs(series[k]) for series, k in zip(self.by_joint, self.peaks, strict=True)]
        return largest.index(max(largest))


class SensitivityCurves(FrozenRecord):
    """Curves of several parameters, the strongest first."""

    model: str
    trace: str
    joints: tuple[int, ...]
    time: tuple[float, ...]
    curves: tuple[SensitivityCurve, ...]


def sensitivity_curves(
    model: Model, trace: Trace, names: Sequence[str], options: Options | None = None
) -> SensitivityCurves:
    """Returns the exact first-order effect of the named parameters on the readings of a run that repeats the trace.

    The loop is closed unless `options` say otherwise, so effects that the controller compensates do not appear. Raises
    SpecError for no or an unknown parameter, or one without an expected deviation; TraceError as `simulate`.
    """
    if not names:
        raise SpecError("no parameters: name at least one")
    found = sensitivities(model, trace, [model.parameter(name) for name in names], options)
    curves = [_curve(p, derivative) for p, derivative in zip(found.parameters, found.reading, strict=True)]
    return SensitivityCurves(
        model=model.identity,
        trace=trace.record.trace_id,
        joints=found.simulation.joints,
        time=tuple(map(float, found.simulation.time)),
        curves=tuple(sorted(curves, key=lambda c: -c.rms)),
    )


def _curve(parameter: Parameter, derivative: NDArray[np.float64]) -> SensitivityCurve:
    expected, _ = expected_deviation(parameter, "source")
    moved = expected * derivative
    by_joint = tuple(tuple(map(float, column)) for column in moved.T)
    rms = float(np.sqrt((moved**2).mean()))
    return SensitivityCurve(name=parameter.name, unit=parameter.unit, expected=expected, by_joint=by_joint, rms=rms)
