"""How much each parameter moves the readings along a run: sensitivity curves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydantic import BaseModel, ConfigDict

from daq.contracts.errors import SpecError
from daq.contracts.trace import Trace
from model.machine_model.model import Model
from model.simulation.simulate import sensitivities
from model.validation.expected_deviation import Convention, expected_deviation


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class SensitivityCurve(_Part):
    """Change of each joint's reading (rad) along a run when one parameter changes by its expected deviation.

    `by_joint` has one series a modelled joint; `rms` is over all of them.
    """

    name: str
    unit: str
    expected: float
    by_joint: tuple[tuple[float, ...], ...]
    rms: float


class SensitivityCurves(_Part):
    """Curves of several parameters, the strongest first."""

    model: str
    trace: str
    joints: tuple[int, ...]
    time: tuple[float, ...]
    curves: tuple[SensitivityCurve, ...]


def sensitivity_curves(
    model: Model, trace: Trace, names: Sequence[str], convention: Convention = "source"
) -> SensitivityCurves:
    """Exact first-order effect of the named parameters on the readings of a run that repeats the trace.

    Raises SpecError for no or an unknown parameter.
    """
    if not names:
        raise SpecError("no parameters: name at least one")
    found = sensitivities(model, trace, names)
    curves = []
    for name, derivative in zip(names, found.reading, strict=True):
        parameter = model.parameter(name)
        expected, _ = expected_deviation(parameter, convention)
        moved = expected * derivative
        curves.append(
            SensitivityCurve(
                name=name, unit=parameter.unit, expected=expected,
                by_joint=tuple(tuple(map(float, column)) for column in moved.T), rms=float(np.sqrt((moved**2).mean())),
            )
        )  # fmt: skip
    return SensitivityCurves(
        model=model.identity, trace=trace.record.trace_id, joints=found.simulation.joints,
        time=tuple(map(float, found.simulation.time)), curves=tuple(sorted(curves, key=lambda c: -c.rms)),
    )  # fmt: skip
