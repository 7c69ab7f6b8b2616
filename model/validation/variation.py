"""The results of validation in the time domain, as data; a module that only shows them need not load the compiler."""

from __future__ import annotations

from daq.contracts.frozen import FrozenRecord
from model.validation.expected_deviation import Convention

REGRESSORS = ("position", "speed", "magnitude of speed", "direction", "load", "acceleration", "drive", "time")
"""Names of the regressors; load is the gravity torque on the joint (N·m, or N)."""


class Correlation(FrozenRecord):
    """Pearson's correlation with one regressor of one joint. `noise` is that of independent signals (1σ)."""

    regressor: str
    joint: int
    value: float
    noise: float

    @property
    def significant(self) -> bool:
        """Whether it is beyond three standard deviations of the correlation of independent signals."""
        return abs(self.value) > 3 * self.noise


class Variation(FrozenRecord):
    """α(t) of one parameter, where all parameters together vary as little as explains the motion.

    `values` and `noise` (the standard deviation that the noise floor gives α) are in `unit` at the result's
    times; None where no joint that the parameter acts on moves. `deviation` is the rms of α (4.23), corrected for
    noise, `expected` is τ′, `mean` is what a constant change would be. `significant` is the share of times at which
    α lies beyond noise. `alone_constant` and `alone_varying` are the shares of the residual's energy (beyond noise)
    that this parameter explains by itself, as a constant and as a function of time.
    """

    name: str
    unit: str
    value: float
    values: tuple[float | None, ...]
    noise: tuple[float | None, ...]
    deviation: float
    expected: float
    mean: float
    significant: float
    alone_constant: float
    alone_varying: float
    against: tuple[Correlation, ...]

    @property
    def within_expectation(self) -> bool:
        """σ² ≤ τ′² (4.24)."""
        return self.deviation <= self.expected


class JointResidual(FrozenRecord):
    """Measured − expected acceleration of a joint (rad/s²; None where it does not move) and what it depends on.

    `noise` is its noise floor: the root mean square that is left of records which the model itself has made.
    """

    joint: int
    values: tuple[float | None, ...]
    noise: float
    rms: float
    against: tuple[Correlation, ...]

    @property
    def in_floors(self) -> float:
        """Root mean square of the residual over the noise floor: about 1 where the model is right."""
        return self.rms / self.noise


class TimeDomain(FrozenRecord):
    """The time-domain form for one model and one trace. `smoothing` is the kernel's standard deviation in s."""

    model: str
    trace: str
    convention: Convention
    smoothing: float
    time: tuple[float, ...]
    joints: tuple[JointResidual, ...]
    parameters: tuple[Variation, ...]
    regressors: tuple[str, ...] = REGRESSORS
    notes: tuple[str, ...] = ()

    def parameter(self, name: str) -> Variation:
        """The variation of a parameter. Raises KeyError."""
        return {p.name: p for p in self.parameters}[name]
