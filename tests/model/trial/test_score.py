"""What an answer is worth, question by question."""

import pytest

from model.discrepancy.diagnosis import Diagnosis
from model.trial.score import Score, score, score_of_failure
from model.trial.truth import Truth
from tests.model.discrepancy.steps import shape
from tests.model.trial.answers import MACHINE, answer, candidate, found, seen, step, truth

BACKLASH = truth("single", ("backlash", (2,)), parameters={"play": 0.01, "stiffness": 1.0, "damping": 1.0})
STICTION = truth("single", ("stiction", (1,)))


def judged(of: Truth, given: Diagnosis, d_prime: float = 20.0) -> Score:
    return score(of, seen(of, d_prime), given, MACHINE)


def test_a_right_name_at_the_right_joint_counts_where_it_is_detectable() -> None:
    result = judged(BACKLASH, answer("named", step("backlash", 2, ranked=("backlash", "input_delay"))))
    assert (result.named_right, result.merged_right, result.in_first, result.joint_right) == (True,) * 4
    assert result.place == "named"
    assert result.detectable
    assert not judged(BACKLASH, answer("nothing-significant"), d_prime=4.99).detectable


def test_a_second_wrong_name_is_wrong_and_a_rejected_step_names_nothing() -> None:
    given = answer("named", step("backlash", 2, ranked=("backlash",)), step("payload", ranked=("payload",)))
    result = judged(BACKLASH, given)
    assert result.named_right is False
    assert result.in_first
    assert result.at_least_one
    given = answer("named", step("backlash", 2, ranked=("backlash",)), step("payload", adopted=False))
    assert judged(BACKLASH, given).named_right
    assert judged(BACKLASH, answer("nothing-significant", step("backlash", 2, adopted=False))).named_right is False


def test_a_group_is_no_name_but_the_effect_may_be_in_its_final_answer() -> None:
    # A group is no name but the effect may be in it
    given = answer("ambiguous", step("input_delay", 2, ranked=("input_delay",), group=("input_delay", "backlash")))
    result = judged(BACKLASH, given)
    assert result.named_right is False
    assert result.in_answer
    assert result.place == "group"
    assert result.joint_right
    # A group that is not the final answer gives nothing
    taken = step("input_delay", 2, ranked=("input_delay",), group=("input_delay", "backlash"))
    withdrawn = taken.model_copy(update={"adopted": False, "rejected_because": "it only resembles what is missing"})
    for given in (
        answer("unknown-effect", withdrawn),
        answer("unknown-effect", taken),
        answer("ambiguous", withdrawn),
        answer("nothing-significant", withdrawn),
    ):
        result = judged(BACKLASH, given)
        assert result.answered == ()
        assert (result.in_answer, result.merged_right, result.named_right) == (False, False, False)
    assert judged(BACKLASH, answer("unknown-effect", withdrawn)).place == "unknown-effect"
    assert judged(BACKLASH, answer("ambiguous", withdrawn)).place == "group"


def test_another_kind_of_friction_is_right_once_they_are_merged() -> None:
    for given in (
        answer("named", step("coulomb_friction", 1)),
        answer("ambiguous", step("stiction", 1, group=("stiction", "coulomb_friction"))),
    ):
        result = judged(STICTION, given)
        assert result.merged_right
        assert result.named_right is False
    mixed = answer("ambiguous", step("stiction", 1, group=("stiction", "gear_loss")))
    assert judged(STICTION, mixed).merged_right is False
    assert judged(BACKLASH, answer("named", step("joint_compliance", 2))).merged_right is False


@pytest.mark.parametrize(("place", "right"), [(2, True), (3, False)])
def test_among_the_first_three_of_the_ranking_the_answer_s_own_name_first(place: int, right: bool) -> None:
    ranked = ["dead_zone", "payload", "wrong_gain", "supply_limit"]
    ranked.insert(place, "backlash")
    given = answer("named", step("dead_zone", 2, ranked=ranked))
    assert judged(BACKLASH, given).in_first is right


def test_a_name_and_its_joint_are_two_questions() -> None:
    result = judged(BACKLASH, answer("named", step("backlash", 3)))
    assert result.named_right
    assert result.joint_right is False
    torn = step("backlash", 2).model_copy(update={"group": (candidate("backlash", 2), candidate("backlash", 3))})
    result = judged(BACKLASH, answer("ambiguous", torn))
    assert result.named_right
    assert result.joint_right is False
    ranked = ("dead_zone", "dead_zone", "dead_zone", "payload", "backlash")
    assert judged(BACKLASH, answer("named", step("dead_zone", 2, ranked=ranked))).in_first


def test_unknown_effect_may_say_at_which_joint_or_that_something_remains() -> None:
    at_two = answer("unknown-effect", step(None, seen_at=2, adopted=False))
    assert judged(BACKLASH, at_two).joint_right
    assert judged(STICTION, at_two).joint_right is False
    silent = answer("unknown-effect")
    assert judged(BACKLASH, silent).joint_right is False
    shapes = tuple(shape(joint, explained=explained) for joint, explained in ((2, 0.8), (1, 0.2)))
    telling = silent.model_copy(update={"remaining": shapes})
    assert judged(BACKLASH, telling).joint_right
    assert judged(STICTION, telling).joint_right is False
    assert judged(BACKLASH, answer("nothing-significant")).joint_right is None
    tilt = truth("single", ("base_tilt", ()), parameters={"about_x": 0.0, "about_y": 0.1})
    assert judged(tilt, answer("named", step("base_tilt"))).joint_right is None


def test_of_several_effects_or_joints_all_or_at_least_one_can_be_right() -> None:
    shared = truth("shared_by_joints", ("dead_zone", (1, 3)), parameters={"width": 0.5})
    assert judged(shared, answer("named", step("dead_zone", 1, 3))).joint_right
    assert judged(shared, answer("named", step("dead_zone", 3), step("dead_zone", 1))).joint_right
    assert judged(shared, answer("named", step("dead_zone", 1))).joint_right is False
    assert judged(shared, answer("named", step("dead_zone", 1))).named_right
    pair = truth("pair", ("dead_zone", (1,)), ("wrong_gain", (2,)), parameters={"width": 0.5, "factor": 1.2})
    both = judged(pair, answer("named", step("wrong_gain", 2), step("dead_zone", 1)))
    one = judged(pair, answer("named", step("wrong_gain", 2), step("payload")))
    none = judged(pair, answer("named", step("payload")))
    assert [r.named_right for r in (both, one, none)] == [True, False, False]
    assert [r.at_least_one for r in (both, one, none)] == [True, True, False]
    assert both.joint_right is None


def test_clean_arms_and_effects_outside_the_library_have_their_own_right_answers() -> None:
    clean = truth("clean")
    assert judged(clean, answer("nothing-significant")).alarm is False
    assert judged(clean, answer("nothing-significant", step("payload", adopted=False))).alarm is False
    for verdict in ("named", "ambiguous", "unknown-effect"):
        assert judged(clean, answer(verdict, step("payload"))).alarm
    assert judged(clean, answer("nothing-significant")).named_right is None
    strange = truth("open_set", ("tight_spot", (1,)), known=False)
    assert judged(strange, answer("unknown-effect")).honest
    assert judged(strange, answer("ambiguous", step("stiction", 1, group=("stiction", "viscous_friction")))).honest
    assert judged(strange, answer("named", step("viscous_friction", 1))).honest is False
    assert judged(strange, answer("unknown-effect", step("viscous_friction", 1))).honest is False
    assert judged(strange, answer("nothing-significant")).honest is False


def test_excess_removed_is_of_the_step_and_of_the_whole_answer() -> None:
    given = answer("named", step("backlash", 2, holdout=(3.0, 2.0)), step("backlash", 1, holdout=(2.0, 1.5)))
    assert judged(BACKLASH, given).excess_removed == pytest.approx(1.0 - (1.5**2 - 1) / (3.0**2 - 1))
    assert judged(BACKLASH, answer("named", step("backlash", 2, holdout=(1.01, 1.0)))).excess_removed is None
    assert judged(BACKLASH, answer("named", step("backlash", 2))).excess_removed is None
    given = answer("named", step("backlash", 2, holdout=(3.0, 1.0)))
    whole = given.model_copy(update={"rmse_holdout": step(None, holdout=(11.0, 3.0)).rmse_holdout})
    assert judged(BACKLASH, given).excess_removed_whole is None
    assert judged(BACKLASH, whole).excess_removed_whole == pytest.approx(1.0 - 8.0 / 120.0)


@pytest.mark.parametrize(("low", "high", "inside"), [(0.009, 0.011, True), (0.0101, 0.02, False)])
def test_intervals_are_held_against_the_truth_in_the_model_s_convention(low: float, high: float, inside: bool) -> None:
    parameters = {
        "joint2.backlash.gap": found(0.0105, low, high),
        "joint2.backlash.damping": found(1.0, 0.5, 2.0),
        "joint2.motor.resistance": found(4.5, 4.0, 5.0),
    }
    result = judged(BACKLASH, answer("named", step("backlash", 2, parameters=parameters)))
    assert [(c.parameter, c.truth, c.inside) for c in result.covered] == [("joint2.backlash.gap", 0.01, inside)]


def test_no_interval_counts_for_a_wrong_name_and_viscous_friction_is_all_of_the_joint_s() -> None:
    gap = {"joint2.backlash.gap": found(0.01, None, None)}
    assert judged(BACKLASH, answer("named", step("backlash", 2, parameters=gap))).covered == ()
    elsewhere = {"joint3.backlash.gap": found(0.01, 0.0, 0.1)}
    assert judged(BACKLASH, answer("named", step("backlash", 3, parameters=elsewhere))).covered == ()
    viscous = truth("single", ("viscous_friction", (2,)), parameters={"coefficient": 40.0})
    stated = {"joint2.viscous_friction.coefficient": found(3.7e-4, 3.6e-4, 3.9e-4)}
    (covered,) = judged(viscous, answer("named", step("viscous_friction", 2, parameters=stated))).covered
    assert covered.truth == pytest.approx(1.1 * 2.53e-4 + 40.0 / 635.5**2)
    assert covered.inside
    known, clean = BACKLASH, truth("clean")
    failed = score_of_failure(known, seen(known), 600.0)
    assert (failed.named_right, failed.in_first, failed.joint_right, failed.place) == (False, False, False, "failed")
    assert score_of_failure(clean, seen(clean), 600.0).alarm
    strange = truth("open_set", ("tight_spot", (1,)), known=False)
    assert score_of_failure(strange, seen(strange), 1.0).honest is False
