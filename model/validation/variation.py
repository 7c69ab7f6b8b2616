"""Results of validation in the time domain, as data; code that only displays them need not load the compiler."""

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
        """Whether it exceeds three standard deviations of the correlation of independent signals."""
        return abs(self.value) > 3 * self.noise


class Variation(FrozenRecord):
    """α(t) of one parameter, when all parameters together vary as little as explains the motion.

    `values` and `noise` (standard deviation of α due to the noise floor) are in `unit` at the result's times; None
    where no joint that the parameter acts on moves. `deviation` is the rms of α (4.23), corrected for noise; `expected`
    is τ′; `mean` is the constant change. `significant` is the share of times at which α exceeds noise. `alone_constant`
    and `alone_varying` are the shares of the residual's energy (above noise) that this parameter explains alone, as a
    constant and as a function of time.
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
    """Measured − expected acceleration of a joint (rad/s²; None where it does not move) and its correlations.

    `noise` is its noise floor: the root mean square residual of records that the model itself makes.
    """

    joint: int
    values: tuple[float | None, ...]
    noise: float
    rms: float
    against: tuple[Correlation, ...]

    @property
    def in_floors(self) -> float:
        """Root mean square of the residual over the noise floor: about 1 for a right model."""
        return self.rms / self.noise


class TimeDomain(FrozenRecord):
    """Result of the time-domain form for one model and one trace. `smoothing` is the kernel's standard deviation in
    s."""

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
        """Returns the variation of a parameter. Raises KeyError."""
        return {p.name: p for p in self.parameters}[name]
