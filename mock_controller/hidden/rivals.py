"""Rivals of a hidden effect: other effects of the shared list, with all parameters of their laws that can be refitted.

A rival's parameters are changed in coordinates of about 1: a size in units of the largest drawn one, a phase in rad, a
positive constant by its logarithm.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from firmware_protocol.units import ADC_COUNTS
from mock_controller.hidden.sizes import LATER_SIZES, SHARED_SIZES, SizeRange
from mock_controller.modification import Modification
from mock_controller.modifications import build_modifications
from mock_controller.modifications.parameter import fields_of
from mock_controller.modifications.registry import known_modifications

Floats = NDArray[np.float64]

SEEN_IN_NUMBERS = ("wrong_gain", "lost_set_points")
"""Effects that a record shows without any model, in the controller's own set points, errors and power."""
_RANGES = {size.effect: size for size in (*SHARED_SIZES, *LATER_SIZES)}
_STRENGTHS = (0.0, 0.5, 1.0)
"""Initial sizes, as positions in the range from which arms are drawn."""
_KEPT = ("offset", "seed")
"""Parameters that only the mock's effect has; they stay at 0."""
_PHASES = (0.0, 0.5 * math.pi)
"""Initial phases (rad). The size of a tone may have either sign, so these cover all four quarters."""
_CYCLES = (1.5, 3.0, 6.0, 12.0, 20.0, 32.0, 48.0, 64.0)
"""Initial periods per turn of a ripple."""
_FREQUENCIES = (0.3, 0.6, 1.0, 1.6, 2.5, 3.5, 4.5, 5.5)
"""Initial frequencies (Hz) of a disturbance."""
_SCALES = {"phase": 1.0, "periods": 1.0, "frequency": 0.02, "neutral": 0.5, "slack": 0.5, "about_x": 0.05}
"""Units of the parameters that are not sizes; constants that are not listed are changed by their logarithm."""
_BENDS = 8
"""Number of terms of a bent potentiometer's sine series."""
_BEND = 4e-3 * ADC_COUNTS
"""Unit (counts) of a term."""
_JOINTS = 3
"""Joints that effects are tried at: 1 to this."""


class RivalError(ValueError):
    """A rival that does not exist."""


@dataclass(frozen=True)
class Number:
    """One parameter of a law. `of_size`: it grows with the effect, from `null` on, by `scale` per unit; others change
    from `null` by `scale` per unit, or by a factor of e where `scale` is 0. `low`, `high`: bounds, in its unit.
    """

    key: str
    null: float
    scale: float
    low: float
    high: float
    of_size: bool = False
    begins: tuple[float, ...] = (0.0,)
    """Initial coordinates."""

    def value(self, coordinate: float) -> float:
        """Returns the parameter at a coordinate, within its bounds."""
        found = self.null + self.scale * coordinate if self.scale else self.null * math.exp(coordinate)
        return min(max(found, self.low), self.high)

    @property
    def reach(self) -> tuple[float, float]:
        """Returns bounds of the coordinate."""
        if self.scale:
            return (self.low - self.null) / self.scale, (self.high - self.null) / self.scale
        return math.log(self.low / self.null), math.log(self.high / self.null)


@dataclass
class BentCurve:
    """A potentiometer's curve as a sine series over the converter's range; `terms` in counts."""

    name: ClassVar[str] = "bent_curve"
    joint: int
    terms: tuple[float, ...]

    def reading(self, counts: float) -> float:
        """Returns the converter's reading of `counts`."""
        place = math.pi * counts / ADC_COUNTS
        return counts + sum(term * math.sin(k * place) for k, term in enumerate(self.terms, start=1))


@dataclass(frozen=True)
class Rival:
    """An effect at `joints` (none: on the arm as a whole), and the parameters of its law at each of them."""

    effect: str
    joints: tuple[int, ...]
    numbers: tuple[tuple[Number, ...], ...] = field(repr=False)

    @property
    def every(self) -> tuple[Number, ...]:
        """Returns the parameters at all joints, in the order of the coordinates."""
        return tuple(number for numbers in self.numbers for number in numbers)

    @property
    def reach(self) -> tuple[Floats, Floats]:
        """Returns bounds of the coordinates."""
        low, high = zip(*(number.reach for number in self.every), strict=True)
        return np.array(low), np.array(high)

    @property
    def sizes(self) -> NDArray[np.bool_]:
        """Returns which coordinates grow with the effect."""
        return np.array([number.of_size for number in self.every])

    def starts(self) -> Iterator[Floats]:
        """Yields initial coordinates: the same at all joints."""
        for at_one in product(*(number.begins for number in self.numbers[0])):
            yield np.array(at_one * len(self.numbers))

    def modifications(self, coordinates: Floats) -> tuple[Modification, ...]:
        """Returns the effect at its coordinates."""
        found: list[Modification] = []
        left = iter(coordinates.tolist())
        places: Sequence[int | None] = self.joints or (None,)
        for joint, numbers in zip(places, self.numbers, strict=True):
            values = {number.key: number.value(next(left)) for number in numbers}
            if self.effect == "potentiometer_nonlinearity":
                found.append(BentCurve(joint or 1, tuple(values.values())))
                continue
            if "phase" in values:
                turned = values["phase"] + (math.pi if values["amplitude"] < 0 else 0.0)
                values |= {"amplitude": abs(values["amplitude"]), "phase": math.remainder(turned, 2 * math.pi)}
            at: dict[str, float] = {} if joint is None else {"joint": joint}
            found += build_modifications([(self.effect, {**at, **values})])
        return tuple(found)


def rival_at(effect: str, joints: tuple[int, ...]) -> Rival | None:
    """Returns the rival of a name at `joints`; None if the mock has no such effect there."""
    size = _RANGES.get(effect)
    if size is None or size.acts_on_joints != bool(joints) or any(joint > _JOINTS for joint in joints):
        return None
    least = fields_of(known_modifications()[effect]).get("joint")
    if least is not None and any(joint < least.metadata["low"] for joint in joints):
        return None
    places: Sequence[int | None] = joints or (None,)
    return Rival(effect, joints, tuple(_numbers(size, joint) for joint in places))


def places_of(effect: str, own: tuple[int, ...]) -> list[tuple[int, ...]]:
    """Returns joints at which a rival is tried: those of the hidden effect, or each joint if it has none."""
    size = _RANGES.get(effect)
    if size is None or not size.acts_on_joints:
        return [()]
    return [own] if own else [(joint,) for joint in size.joints]


def _numbers(size: SizeRange, joint: int | None) -> tuple[Number, ...]:
    if size.effect == "potentiometer_nonlinearity":
        far = 0.1 * ADC_COUNTS
        return tuple(Number(f"term_{k}", 0.0, _BEND, -far, far, of_size=True) for k in range(1, _BENDS + 1))
    others = dict.fromkeys(size.also, 0.0) | {key: choices[(joint or 1) - 1] for key, choices in size.per_joint.items()}
    for key, (low, high) in size.also.items():
        others[key] = math.sqrt(low * high) if low > 0.0 else 0.0
    kept = (_other(size.effect, key, value) for key, value in others.items() if key not in _KEPT)
    return (_main(size, joint, tone="phase" in size.also), *kept)


def _main(size: SizeRange, joint: int | None, *, tone: bool) -> Number:
    """Returns the size itself; with either sign if arms are drawn with either."""
    facts = fields_of(known_modifications()[size.effect])[size.parameter].metadata
    smallest, largest = size.ranges[0 if joint is None else joint - 1]
    strengths = _STRENGTHS[1:2] if tone else _STRENGTHS
    begins = [(smallest / largest) ** (1.0 - strength) for strength in strengths]
    if size.signed:
        begins += [-start for start in begins]
    low = -facts["high"] if tone else facts["low"]
    return Number(size.parameter, facts["null"], largest, low, facts["high"], of_size=True, begins=tuple(begins))


def _other(effect: str, key: str, start: float) -> Number:
    facts = fields_of(known_modifications()[effect])[key].metadata
    scale = _SCALES.get(key, 0.0)
    grid = {"phase": _PHASES, "periods": _CYCLES, "frequency": _FREQUENCIES}.get(key, (start,))
    begins = tuple((value - start) / scale for value in grid) if scale else (0.0,)
    low, high = (-math.inf, math.inf) if key == "phase" else (facts["low"], facts["high"])
    return Number(key, start, scale, max(low, 1e-9) if not scale else low, high, begins=begins)
