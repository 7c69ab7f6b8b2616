"""Results of a fit for one parameter and for one joint."""

from __future__ import annotations

from typing import Literal

from daq.contracts.frozen import FrozenRecord
from model.fitting.identifiability import Verdict


class FittedParameter(FrozenRecord):
    """One parameter after a fit.

    `value`, `deviation` and the 95 % interval `low` to `high` are None unless the data determine the parameter.
    `model_value` is the value in the fitted model, which needs one in any case.
    """

    name: str
    unit: str
    verdict: Verdict
    reason: str
    value: float | None
    deviation: float | None
    low: float | None
    high: float | None
    model_value: float
    before: float
    expected: float | None
    expected_deviation: float | None
    at_bound: Literal["low", "high"] | None


class JointError(FrozenRecord):
    """Root mean square of simulated − measured on one joint over all traces, and the noise of the measurement.

    `noise`: the error of a right model, with noise in its control loop; None in older results.
    """

    joint: int
    unit: str
    before: float
    after: float
    floor: float
    noise: float | None = None
