"""Whether fitted numbers have changed by more than their intervals allow. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot
from statistics import NormalDist

from daq.contracts.service.fleet import FittedNumber, NumberChange

NORMAL_95 = NormalDist().inv_cdf(0.975)
"""Half the width of a normal distribution's 95 % interval, in standard deviations."""
CHANCE = 0.05
"""Probability that noise alone makes any of the numbers that are compared together count as changed."""
Numbers = Mapping[str, FittedNumber]


@dataclass(frozen=True)
class Pair:
    """An earlier and a later fit of one robot, by the names of their parameters."""

    robot: str
    earlier: Numbers
    later: Numbers

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that both fits determine, in the same unit."""
        return tuple(
            name
            for name, after in self.later.items()
            if (before := self.earlier.get(name)) is not None and before.unit == after.unit
        )


def changes_of(pairs: tuple[Pair, ...]) -> dict[str, tuple[NumberChange, ...]]:
    """Returns the changes of all robots' numbers, by robot.

    All of them are judged together (Bonferroni): of a hundred numbers that did not change, five would leave their 95 %
    interval otherwise.
    """
    count = sum(len(pair.names) for pair in pairs)
    limit = NormalDist().inv_cdf(1 - CHANCE / (2 * max(1, count)))
    return {pair.robot: tuple(_change(pair, name, limit) for name in pair.names) for pair in pairs}


def _change(pair: Pair, name: str, limit: float) -> NumberChange:
    before, after = pair.earlier[name], pair.later[name]
    difference, deviation = after.value - before.value, hypot(before.deviation, after.deviation)
    return NumberChange(
        name=name,
        unit=after.unit,
        before=before.value,
        after=after.value,
        difference=difference,
        low=difference - NORMAL_95 * deviation,
        high=difference + NORMAL_95 * deviation,
        changed=abs(difference) > limit * deviation,
    )
