"""Problems of a fit whose answers are known: some formula through points, in place of a simulation of an arm."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from model.arrays import Floats
from model.fitting.problem import Evaluation
from model.fitting.unknowns import Unknown
from model.machine_model.parameter import Kind, Parameter


def free(name: str, start: float = 1.0, low: float = -np.inf, high: float = np.inf, **fields: float) -> Unknown:
    """A number of a formula. fields: expected, deviation, size."""
    parameter = Parameter(name=name, kind=Kind.EFFECT, part=name, unit="1", value=start)
    return Unknown(parameter, start, low, high, **fields)


@dataclass
class Formula:
    """A formula of some unknowns less what was measured (k,), one signal of one record; keeps what was computed.

    formula, slopes: the values (k,) and their derivatives (n, k) at some numbers (n,). tried, differentiated: the
    numbers that were evaluated without derivatives and with them.
    """

    measured: Floats
    formula: Callable[[Floats], Floats]
    slopes: Callable[[Floats], Floats]
    unknowns: tuple[Unknown, ...]
    floor: Floats = field(default_factory=lambda: np.ones(1))
    tried: list[Floats] = field(default_factory=list)
    differentiated: list[Floats] = field(default_factory=list)

    @property
    def runs(self) -> Sequence[Sequence[slice]]:
        return [[slice(0, len(self.measured))]]

    def evaluate(self, values: Floats, derivatives: bool) -> list[Evaluation]:
        (self.differentiated if derivatives else self.tried).append(np.array(values))
        residual = np.asarray(self.formula(values) - self.measured)[:, None]
        return [Evaluation(residual, np.array(self.slopes(values), float)[:, :, None] if derivatives else None)]
