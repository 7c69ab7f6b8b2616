"""Which numbers count as changed: held against a published table of the normal distribution, and against chance."""

import numpy as np
import pytest

from daq.contracts.service.fleet import FittedNumber
from extras.lab.fleet.comparison import CHANCE, Pair, changes_of


def number(value: float, deviation: float = 0.01, unit: str = "N·m", name: str = "a") -> FittedNumber:
    half = 1.96 * deviation
    return FittedNumber(name=name, unit=unit, value=value, deviation=deviation, low=value - half, high=value + half)


def pair(before: float, after: float, robot: str = "left") -> Pair:
    return Pair(robot, {"a": number(before)}, {"a": number(after)})


def test_the_interval_of_a_difference_is_that_of_both_numbers() -> None:
    (found,) = changes_of((Pair("left", {"a": number(0.2, 0.03)}, {"a": number(0.3, 0.04)}),))["left"]
    assert found.difference == pytest.approx(0.1)
    assert (found.low, found.high) == pytest.approx((0.1 - 1.959964 * 0.05, 0.1 + 1.959964 * 0.05), abs=1e-6)
    assert found.changed  # 2.0 deviations, beyond the 1.960 of the table


@pytest.mark.parametrize(("deviations", "changed"), [(1.95, False), (1.97, True), (-1.97, True)])
def test_one_number_is_judged_by_its_95_percent_interval(deviations: float, changed: bool) -> None:
    difference = deviations * 0.01 * 2**0.5
    assert changes_of((pair(0.2, 0.2 + difference),))["left"][0].changed is changed


def test_many_numbers_are_judged_together() -> None:
    """Ten numbers share the chance: 2.807 deviations, the two-sided 0.5 % point of the table."""
    quiet = tuple(pair(0.2, 0.2, f"arm{n}") for n in range(9))
    for deviations, changed in ((2.79, False), (2.82, True)):
        loud = pair(0.2, 0.2 + deviations * 0.01 * 2**0.5)
        assert changes_of((*quiet, loud))["left"][0].changed is changed


def test_noise_alone_seldom_makes_any_arm_count_as_changed() -> None:
    random = np.random.default_rng(1)
    comparisons, arms = 2000, 16
    values = random.normal(0.2, 0.01, (comparisons, arms, 2))
    alarms = sum(
        any(
            one.changed
            for every in changes_of(tuple(pair(*both, f"arm{n}") for n, both in enumerate(row))).values()
            for one in every
        )
        for row in values.tolist()
    )
    assert alarms / comparisons == pytest.approx(CHANCE, abs=0.015)


def test_numbers_that_only_one_fit_determines_or_in_another_unit_are_not_compared() -> None:
    before = {"a": number(0.2), "b": number(1.0, name="b")}
    after = {"a": number(0.2, unit="mN·m"), "c": number(1.0, name="c")}
    assert changes_of((Pair("left", before, after),)) == {"left": ()}
    assert changes_of(()) == {}
