"""Whether an answer's intervals cover a world's truth."""

from typing import Any

import pytest

from model.effects.library import library
from trials.judge import SIZES, covered


def truth(name: str, law: int, case: str = "single", **sizes: float) -> dict[str, Any]:
    hidden = {"name": name, "known_as": name, "joint": 1, "law": law, "sizes": sizes}
    return {"case": case, "hidden": [hidden], "joints": [{"stiffness": 50.0}]}


def answer(name: str, part: str, low: float | None, high: float | None, joint: int = 1) -> dict[str, Any]:
    value = {"part": part, "low": low, "high": high}
    step = {"adopted": True, "effect": name, "joints": [joint], "parameters": {"one": value, "other": {"part": "x"}}}
    return {"steps": [step, {**step, "adopted": False}]}


@pytest.mark.parametrize(("low", "high", "found"), [(0.1, 0.3, [True]), (0.21, 0.3, [False]), (None, 0.3, [])])
def test_an_interval_covers_the_truth_or_not(low: float | None, high: float | None, found: list[bool]) -> None:
    assert covered(truth("gear_loss", 0, gear_loss=0.2), answer("gear_loss", "loss", low, high)) == found


def test_what_is_not_comparable_does_not_count() -> None:
    of = answer("gear_loss", "loss", 0.1, 0.3)
    assert covered(truth("gear_loss", 1, gear_loss=0.2), of) == [], "another law"
    assert covered(truth("gear_loss", 0, case="pair", gear_loss=0.2), of) == []
    assert covered(truth("gear_loss", 0, gear_loss=0.2), answer("gear_loss", "loss", 0.1, 0.3, joint=2)) == []
    assert covered(truth("backlash", 0, gap=0.2), of) == [], "another effect"
    assert covered(truth("gear_loss", 0, gear_loss=0.2), None) == []


def test_a_compliance_is_one_over_the_stiffness() -> None:
    of = answer("joint_compliance", "compliance", 0.019, 0.021)
    assert covered(truth("joint_compliance", 0, rate=100.0), of) == [True]


@pytest.mark.parametrize("effect", SIZES)
def test_sizes_are_of_effects_and_parts_that_exist(effect: str) -> None:
    parts = {p.name for p in library()[effect].parameters}
    assert {size.part for size in SIZES[effect]} <= parts
