"""Errors of simulated against measured motion, by model, trace and joint; and parameters in which models differ."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

from daq.contracts.frozen import FrozenRecord
from model.machine_model.model import Model

ALONE = (
    "These errors are of the model alone. A verdict on it first fits start posture, bends and the form of friction "
    "near rest."
)
"""Stands with errors of a comparison where a verdict on the same records is shown, whose errors may be smaller."""


class JointAgreement(FrozenRecord):
    """One joint over one or more traces.

    `rmse` and `largest` are of measured − simulated. `floor` is its noise: the error of records that the model itself
    makes, sensor noise included (for speeds: only that). `count`: one count of the sensor, None without one. All are in
    `unit`. `share` is `rmse` divided by the root mean square of the measured motion about its mean: 0 for a perfect
    model, 1 for one that predicts no motion at all.
    """

    joint: int
    unit: str
    rmse: float
    largest: float
    floor: float
    count: float | None
    share: float | None

    @property
    def counts(self) -> float | None:
        """Root mean square error in counts of the sensor."""
        return None if self.count is None else self.rmse / self.count

    @property
    def floor_counts(self) -> float | None:
        """The noise in counts of the sensor."""
        return None if self.count is None else self.floor / self.count


class TraceAgreement(FrozenRecord):
    """One trace; `held_out` states whether the model was fitted to it, None if nothing was fitted."""

    trace: str
    held_out: bool | None
    samples: int
    joints: tuple[JointAgreement, ...]

    @property
    def mean_squared_error(self) -> float:
        """MSQE of the source: mean squared error summed over the joints, rad² (4.70)."""
        return sum(j.rmse**2 for j in self.joints)


class ModelAgreement(FrozenRecord):
    """One model on all traces: `held_out` pools those marked so, `in_sample` the others; None for none."""

    label: str
    model: str
    effects: tuple[str, ...]
    traces: tuple[TraceAgreement, ...]
    in_sample: tuple[JointAgreement, ...] | None
    held_out: tuple[JointAgreement, ...] | None

    def mean_squared_error(self, kind: Literal["in_sample", "held_out"]) -> float | None:
        """Returns the MSQE pooled over traces of one kind, rad²; None if there are none."""
        joints = self.in_sample if kind == "in_sample" else self.held_out
        return None if joints is None else sum(j.rmse**2 for j in joints)


def pooled(traces: Sequence[TraceAgreement]) -> tuple[JointAgreement, ...] | None:
    """Returns the agreement over all samples of all traces, with equal weights; None for no traces."""
    if not traces:
        return None
    total = sum(t.samples for t in traces)
    found = []
    for column, first in enumerate(traces[0].joints):
        own = [t.joints[column] for t in traces]
        square = sum(j.rmse**2 * t.samples for j, t in zip(own, traces, strict=True)) / total
        motion = sum((j.rmse / j.share) ** 2 * t.samples for j, t in zip(own, traces, strict=True) if j.share)
        found.append(
            first.model_copy(
                update={
                    "rmse": math.sqrt(square),
                    "floor": math.sqrt(sum(j.floor**2 * t.samples for j, t in zip(own, traces, strict=True)) / total),
                    "largest": max(j.largest for j in own),
                    "share": math.sqrt(square * total / motion) if motion > 0 else None,
                }
            )
        )
    return tuple(found)


# --- Finds parameters that differ between models, and by how much


SAME = 1e-12
"""Relative difference below which two values are the same number."""


class ParameterDifference(FrozenRecord):
    """One parameter with its value in each model, None if a model does not have it.

    `deviations` is the range of the values in expected deviations; None if a model lacks the parameter or no deviation
    is expected.
    """

    name: str
    unit: str
    values: tuple[float | None, ...]
    deviations: float | None


def differences(models: Sequence[Model]) -> tuple[ParameterDifference, ...]:
    """Returns parameters whose values differ between models, in the order of the first model that has them."""
    names: dict[str, None] = {}
    for model in models:
        names |= dict.fromkeys(p.name for p in model.parameters)
    found = []
    for name in names:
        own = [m.by_name.get(name) for m in models]
        values = tuple(None if p is None else p.value for p in own)
        numbers = [v for v in values if v is not None]
        widest = max(numbers) - min(numbers)
        if len(numbers) == len(models) and widest <= SAME * max(abs(v) for v in numbers):
            continue
        first = next(p for p in own if p is not None)
        deviations = widest / first.deviation if first.deviation and len(numbers) == len(models) else None
        found.append(ParameterDifference(name=name, unit=first.unit, values=values, deviations=deviations))
    return tuple(found)
