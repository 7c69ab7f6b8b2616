"""What a ranking allows to be said."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from model.discrepancy.candidates.decision import Added, decide
from model.discrepancy.candidates.ranking import Ranking
from model.discrepancy.thresholds import Thresholds

LINES = Thresholds(significant=12.0, margin=4.0, echo=0.05, distant_echo=0.01)


def ranking(*fits: tuple[str, int, float]) -> Ranking:
    """Candidates by name, joint and evidence, in the given order."""
    made: list[Any] = [
        SimpleNamespace(candidate=SimpleNamespace(name=name, joints=(joint,)), evidence=evidence)
        for name, joint, evidence in fits
    ]
    return Ranking(cast(Any, tuple(made)), ())


def test_nothing_where_nothing_is_significant() -> None:
    assert decide(Ranking((), ()), LINES).kind == "nothing"
    assert decide(ranking(("backlash", 2, 11.0)), LINES).kind == "nothing"


def test_one_name_where_it_leads() -> None:
    said = decide(ranking(("backlash", 2, 90.0), ("joint_compliance", 2, 40.0), ("stiction", 2, 2.0)), LINES)
    assert said.kind == "named"
    assert said.margin == pytest.approx(50.0)
    assert said.group == ()


def test_a_group_where_the_lead_is_small() -> None:
    said = decide(ranking(("backlash", 2, 90.0), ("joint_compliance", 2, 87.0), ("stiction", 2, 2.0)), LINES)
    assert said.kind == "group"
    assert [f.hypothesis.name for f in said.group] == ["backlash", "joint_compliance"]


def test_the_margin_of_a_lone_candidate_is_its_evidence() -> None:
    assert decide(ranking(("backlash", 2, 30.0)), LINES).margin == pytest.approx(30.0)


def test_an_echo_of_what_was_found_is_no_effect() -> None:
    small = ranking(("dead_zone", 3, 30.0))
    assert decide(small, LINES).kind == "named"
    assert decide(small, LINES, [Added("backlash", (3,), 1000.0)]).kind == "nothing"
    assert decide(small, LINES, [Added("base_tilt", (), 1000.0)]).kind == "nothing"


def test_other_joints_echo_less() -> None:
    small = ranking(("dead_zone", 3, 30.0))
    assert decide(small, LINES, [Added("backlash", (2,), 1000.0)]).kind == "named"
    assert decide(small, LINES, [Added("backlash", (2,), 3000.0)]).kind == "nothing"


def test_an_echo_hides_no_effect_of_another_joint() -> None:
    said = decide(
        ranking(("dead_zone", 2, 100.0), ("backlash", 1, 60.0), ("stiction", 1, 20.0)), LINES,
        [Added("coulomb_friction", (2,), 2000.0)],
    )  # fmt: skip
    assert said.best is not None
    assert (said.kind, said.best.hypothesis.name, said.margin) == ("named", "backlash", pytest.approx(40.0))


def test_what_one_joint_has_another_is_likelier_to_have() -> None:
    small = ranking(("dead_zone", 3, 8.0))
    assert decide(small, LINES, [Added("backlash", (2,), 40.0)]).kind == "nothing"
    assert decide(small, LINES, [Added("dead_zone", (2,), 40.0)]).kind == "named"


def test_the_same_effect_on_fewer_joints_is_no_rival() -> None:
    both, one, other = ranking(("gear_loss", 1, 90.0), ("gear_loss", 2, 88.0), ("stiction", 2, 87.0)).fitted
    both.hypothesis.joints = (1, 2)  # type: ignore[misc]
    said = decide(Ranking((both, one, other), ()), LINES)
    assert [f.hypothesis.name for f in said.group] == ["gear_loss", "stiction"]
    said = decide(Ranking((both, one), ()), LINES)
    assert said.kind == "named"
