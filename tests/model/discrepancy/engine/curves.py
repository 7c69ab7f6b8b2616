"""A comparison with known answers: a curve of any formula with its exact derivatives, in place of records of an arm."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from model.arrays import Floats
from model.discrepancy.engine.case import Case
from model.discrepancy.engine.residual import Residual, Samples
from model.discrepancy.options import TorqueOptions
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model
from model.machine_model.parameter import Kind, Parameter

Formula = Callable[[Floats, Mapping[str, float]], Floats]


@dataclass(frozen=True)
class Curve:
    """Measured values of one joint less a formula's, with noise of deviation 1.

    asked: names of the derivatives that were computed, one entry a call. kept: which samples are compared.
    """

    time: Floats
    measured: Floats
    formula: Formula
    slope: Mapping[str, Formula]
    asked: list[list[str]] = field(default_factory=list)
    kept: tuple[slice, ...] = (slice(None),)
    model: Any = field(default_factory=lambda: SimpleNamespace(by_name={}))

    @property
    def floor(self) -> Floats:
        return np.ones(1)

    @property
    def samples(self) -> Samples:
        runs = [slice(*own.indices(len(self.time))[:2]) for own in self.kept]
        return Samples((tuple((0, own) for own in runs),), np.array([float(sum(r.stop - r.start for r in runs))]))

    def of_model(self, _model: Any) -> Curve:
        return self

    def within(self, fold: int, folds: int) -> tuple[Curve, Curve]:
        a, b = (round(k * len(self.time) / folds) for k in (fold, fold + 1))
        outside = tuple(s for s in (slice(0, a), slice(b, len(self.time))) if s.start < s.stop)
        return replace(self, kept=outside), replace(self, kept=(slice(a, b),))

    def at(self, values: Mapping[str, float]) -> tuple[Floats]:
        return ((self.measured - self.formula(self.time, values))[:, None],)

    def told_slopes(self, values: Mapping[str, float], unknowns: Sequence[Unknown]) -> Floats:
        return self.slopes(values, unknowns)

    def slopes(self, values: Mapping[str, float], unknowns: Sequence[Unknown]) -> Floats:
        self.asked.append([u.name for u in unknowns])
        return np.stack([self.samples.flat((-self.slope[u.name](self.time, values)[:, None],)) for u in unknowns])

    def deviations(self, _row: Floats) -> Floats:
        return np.ones(1)

    memory = deviations

    def weighted(self, rows: Floats, deviations: Floats, memory: Floats, _joint: int | None = None) -> Floats:
        return np.asarray(rows / (deviations * np.sqrt(memory)))

    def costs(self, row: Floats, memory: Floats) -> Floats:
        return np.array([float(row @ row) / float(memory[0])])

    def descriptions(self, rows: Sequence[Floats]) -> tuple[list[Floats], Floats]:
        return [self.costs(row, np.ones(1)) for row in rows], np.ones(1)


def compared(curve: Curve) -> Residual:
    """The curve as what a fit compares."""
    return cast(Residual, curve)


def unknown(name: str, low: float = -np.inf, high: float = np.inf, **prior: float) -> Unknown:
    """A number of a formula. prior: expected, deviation, size."""
    parameter = Parameter(name=name, kind=Kind.EFFECT, component="curve", part=name, unit="1", value=1.0, low=low)
    own: dict[str, Any] = dict(prior)
    return Unknown(parameter, float(np.clip(1.0, low, high)), low, high, **own)


def curve_case(curve: Curve, held_out: Curve | None = None, **own: Any) -> Any:
    """A case of curves, without what only real records have. own: methods in place of those."""
    kind = type("CurveCase", (Case,), {**dict.fromkeys(Case.__abstractmethods__), **own})
    one = np.ones(1)
    return kind(cast(Model, curve.model), curve, held_out, one, one, TorqueOptions())
