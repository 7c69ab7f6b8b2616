"""What a ranking allows to be said."""

import pytest

from model.discrepancy.candidates.ranking import Ranking, decide
from model.discrepancy.thresholds import Thresholds
from tests.model.discrepancy.candidate_fits import candidate_fit
from tests.model.discrepancy.steps import step

LINES = Thresholds(significant=12.0, margin=4.0, echo=0.05, distant_echo=0.01)


def ranking(*fits: tuple[str, int, float]) -> Ranking:
    """Candidates by name, joint and evidence, in the given order."""
    return Ranking(tuple(candidate_fit(name, (joint,), evidence) for name, joint, evidence in fits), ())


def test_no_effect_is_named_where_none_is_significant() -> None:
    assert decide(Ranking((), ()), LINES).kind == "nothing"
    assert decide(ranking(("backlash", 2, 11.0)), LINES).kind == "nothing"


def test_an_effect_with_a_clear_lead_is_named_alone() -> None:
    said = decide(ranking(("backlash", 2, 90.0), ("joint_compliance", 2, 40.0), ("stiction", 2, 2.0)), LINES)
    assert said.kind == "named"
    assert said.margin == pytest.approx(50.0)
    assert said.group == ()


def test_effects_close_in_evidence_are_named_as_a_group() -> None:
    said = decide(ranking(("backlash", 2, 90.0), ("joint_compliance", 2, 87.0), ("stiction", 2, 2.0)), LINES)
    assert said.kind == "group"
    assert [f.hypothesis.name for f in said.group] == ["backlash", "joint_compliance"]


def test_the_margin_of_the_only_candidate_is_its_evidence() -> None:
    assert decide(ranking(("backlash", 2, 30.0)), LINES).margin == pytest.approx(30.0)


def test_a_small_remainder_of_an_added_effect_on_the_same_joint_is_no_effect() -> None:
    small = ranking(("dead_zone", 3, 30.0))
    assert decide(small, LINES).kind == "named"
    assert decide(small, LINES, [step("backlash", (3,), evidence=1000.0)]).kind == "nothing"
    assert decide(small, LINES, [step("base_tilt", (), evidence=1000.0)]).kind == "nothing"


def test_an_effect_on_another_joint_raises_the_threshold_less() -> None:
    small = ranking(("dead_zone", 3, 30.0))
    assert decide(small, LINES, [step("backlash", (2,), evidence=1000.0)]).kind == "named"
    assert decide(small, LINES, [step("backlash", (2,), evidence=3000.0)]).kind == "nothing"


def test_a_candidate_below_its_threshold_is_skipped_for_one_on_another_joint() -> None:
    said = decide(
        ranking(("dead_zone", 2, 100.0), ("backlash", 1, 60.0), ("stiction", 1, 20.0)),
        LINES,
        [step("coulomb_friction", (2,), evidence=2000.0)],
    )
    assert said.best is not None
    assert (said.kind, said.best.hypothesis.name, said.margin) == ("named", "backlash", pytest.approx(40.0))


def test_an_effect_found_on_one_joint_needs_less_evidence_on_another() -> None:
    small = ranking(("dead_zone", 3, 8.0))
    assert decide(small, LINES, [step("backlash", (2,), evidence=40.0)]).kind == "nothing"
    assert decide(small, LINES, [step("dead_zone", (2,), evidence=40.0)]).kind == "named"


def test_the_same_effect_on_fewer_joints_is_no_rival() -> None:
    both = candidate_fit("gear_loss", (1, 2), 90.0)
    one, other = ranking(("gear_loss", 2, 88.0), ("stiction", 2, 87.0)).fitted
    said = decide(Ranking((both, one, other), ()), LINES)
    assert [f.hypothesis.name for f in said.group] == ["gear_loss", "stiction"]
    said = decide(Ranking((both, one), ()), LINES)
    assert said.kind == "named"


def test_a_rival_that_explains_as_much_with_one_parameter_more_is_of_the_group() -> None:
    """Records say nothing about what a parameter costs; they do about a rival that explains less."""
    best = candidate_fit("coulomb_friction", (1,), 60.0, price=7.8)
    equal = candidate_fit("base_tilt", (), 52.2, price=15.6)
    less = candidate_fit("spring_torque", (1,), 46.0, price=15.6)
    said = decide(Ranking((best, equal, less), ()), LINES)
    assert [f.hypothesis.name for f in said.group] == ["coulomb_friction", "base_tilt"]


def test_a_rival_with_more_parameters_that_would_not_be_named_alone_is_of_no_group() -> None:
    best = candidate_fit("coulomb_friction", (1,), 18.0, price=7.8)
    weak = candidate_fit("base_tilt", (), 10.2, price=15.6)
    assert decide(Ranking((best, weak), ()), LINES).kind == "named"


def test_a_rival_with_fewer_parameters_counts_by_its_evidence() -> None:
    best = candidate_fit("base_tilt", (), 60.0, price=15.6)
    simpler = candidate_fit("coulomb_friction", (1,), 57.0, price=7.8)
    assert decide(Ranking((best, simpler), ()), LINES).kind == "group"
