"""A model with unknowns and a value for each of them: what is simulated, compared with records and fitted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np

from model.arrays import Floats
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model

Found = TypeVar("Found")


@dataclass(frozen=True)
class Calibration:
    """values: (p,) of the unknowns. An initial posture is an unknown too, although it is no parameter of the model."""

    model: Model
    unknowns: tuple[Unknown, ...]
    values: Floats

    @property
    def precision(self) -> Floats:
        """(p,) one over the prior variance; 0 where nothing is claimed."""
        return np.array([0.0 if u.deviation is None else u.deviation**-2 for u in self.unknowns])

    @property
    def expected(self) -> Floats:
        """(p,) means of the priors."""
        return np.array([u.expected for u in self.unknowns])

    @property
    def prior(self) -> float:
        """−2 ln prior, up to a constant."""
        return float(np.sum(self.precision * (self.values - self.expected) ** 2))

    @property
    def by_name(self) -> dict[str, float]:
        """Values by the unknowns' names."""
        return {u.name: float(v) for u, v in zip(self.unknowns, self.values, strict=True)}

    @property
    def fitted_model(self) -> Model:
        """The model with the values of those unknowns that are parameters of it."""
        return self.model.with_values({n: v for n, v in self.by_name.items() if n in self.model.by_name})

    def value(self, name: str) -> float:
        """Value of one unknown."""
        return float(self.values[[u.name for u in self.unknowns].index(name)])

    def at(self, values: Floats) -> Calibration:
        """The same with other values."""
        return Calibration(self.model, self.unknowns, values)

    def of(self, model: Model) -> Calibration:
        """The same unknowns and values in another model, such as one with a further effect."""
        return Calibration(model, self.unknowns, self.values)

    def only(self, kept: Sequence[int]) -> Calibration:
        """The same with the unknowns of these indices alone; all others are as the model has them."""
        return Calibration(self.model, tuple(self.unknowns[k] for k in kept), self.values[list(kept)])


@dataclass
class Remembered(Generic[Found]):
    """What was computed of calibrations, so that none is simulated twice."""

    _known: dict[tuple[int, bytes, tuple[str, ...]], tuple[Model, Found]] = field(default_factory=dict)

    def of(self, tried: Calibration, compute: Callable[[], Found]) -> Found:
        """The result of a calibration with this model and these values, computed where it is not known."""
        key = id(tried.model), tried.values.tobytes(), tuple(u.name for u in tried.unknowns)
        if key not in self._known:
            self._known[key] = tried.model, compute()  # the model is kept, so that its identity stays its own
        return self._known[key][1]
