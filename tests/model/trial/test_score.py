"""What an answer is worth, question by question."""

import pytest

from model.discrepancy.diagnosis import Diagnosis
from model.trial.score import Score, score, score_of_failure
from model.trial.truth import Truth
from tests.model.trial.answers import MACHINE, answer, candidate, found, remaining, seen, step, truth

BACKLASH = truth("single", ("backlash", (2,)), parameters={"play": 0.01, "stiffness": 1.0, "damping": 1.0})
STICTION = truth("single", ("stiction", (1,)))


def judged(of: Truth, given: Diagnosis, d_prime: float = 20.0) -> Score:
    return score(of, seen(of, d_prime), given, MACHINE)


def test_a_right_name_at_the_right_joint() -> None:
    result = judged(BACKLASH, answer("named", step("backlash", 2, ranked=("backlash", "input_delay"))))
    assert (result.named_right, result.merged_right, result.in_first, result.joint_right) == (True,) * 4
    assert result.place == "named"
    assert result.detectable


def test_an_effect_below_the_limit_of_d_prime_is_not_detectable() -> None:
    assert not judged(BACKLASH, answer("nothing-significant"), d_prime=4.99).detectable


def test_a_second_name_that_is_not_there_makes_it_wrong() -> None:
    given = answer("named", step("backlash", 2, ranked=("backlash",)), step("payload", ranked=("payload",)))
    result = judged(BACKLASH, given)
    assert result.named_right is False
    assert result.in_first
    assert result.at_least_one


def test_a_step_that_was_rejected_names_nothing() -> None:
    given = answer("named", step("backlash", 2, ranked=("backlash",)), step("payload", adopted=False))
    assert judged(BACKLASH, given).named_right
    assert judged(BACKLASH, answer("nothing-significant", step("backlash", 2, adopted=False))).named_right is False


def test_a_group_is_no_name_but_the_effect_may_be_in_it() -> None:
    given = answer("ambiguous", step("input_delay", 2, ranked=("input_delay",), group=("input_delay", "backlash")))
    result = judged(BACKLASH, given)
    assert result.named_right is False
    assert result.in_answer
    assert result.place == "group"
    assert result.joint_right


def test_a_group_that_is_not_the_final_answer_gives_nothing() -> None:
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


def test_the_same_effect_at_several_joints_takes_one_place_of_the_ranking() -> None:
    ranked = ("dead_zone", "dead_zone", "dead_zone", "payload", "backlash")
    assert judged(BACKLASH, answer("named", step("dead_zone", 2, ranked=ranked))).in_first


def test_the_right_effect_at_a_wrong_joint_is_named_right_but_not_placed_right() -> None:
    result = judged(BACKLASH, answer("named", step("backlash", 3)))
    assert result.named_right
    assert result.joint_right is False


def test_one_effect_at_one_of_several_joints_is_a_name_without_a_joint() -> None:
    torn = step("backlash", 2).model_copy(update={"group": (candidate("backlash", 2), candidate("backlash", 3))})
    result = judged(BACKLASH, answer("ambiguous", torn))
    assert result.named_right
    assert result.joint_right is False


def test_unknown_effect_may_still_say_at_which_joint() -> None:
    at_two = answer("unknown-effect", step(None, seen_at=2, adopted=False))
    assert judged(BACKLASH, at_two).joint_right
    assert judged(STICTION, at_two).joint_right is False


def test_unknown_effect_without_a_step_is_right_where_what_remains_is() -> None:
    silent = answer("unknown-effect")
    assert judged(BACKLASH, silent).joint_right is False
    shapes = tuple(remaining(joint, explained) for joint, explained in ((2, 0.8), (1, 0.2)))
    telling = silent.model_copy(update={"remaining": shapes})
    assert judged(BACKLASH, telling).joint_right
    assert judged(STICTION, telling).joint_right is False


def test_joints_are_no_question_where_nothing_was_found_or_none_is_right() -> None:
    assert judged(BACKLASH, answer("nothing-significant")).joint_right is None
    tilt = truth("single", ("base_tilt", ()), parameters={"about_x": 0.0, "about_y": 0.1})
    assert judged(tilt, answer("named", step("base_tilt"))).joint_right is None


def test_shared_by_several_joints_needs_them_all_in_one_step_or_several() -> None:
    shared = truth("shared_by_joints", ("dead_zone", (1, 3)), parameters={"width": 0.5})
    assert judged(shared, answer("named", step("dead_zone", 1, 3))).joint_right
    assert judged(shared, answer("named", step("dead_zone", 3), step("dead_zone", 1))).joint_right
    assert judged(shared, answer("named", step("dead_zone", 1))).joint_right is False
    assert judged(shared, answer("named", step("dead_zone", 1))).named_right


def test_anything_said_about_a_clean_arm_is_a_false_alarm() -> None:
    clean = truth("clean")
    assert judged(clean, answer("nothing-significant")).alarm is False
    assert judged(clean, answer("nothing-significant", step("payload", adopted=False))).alarm is False
    for verdict in ("named", "ambiguous", "unknown-effect"):
        assert judged(clean, answer(verdict, step("payload"))).alarm
    assert judged(clean, answer("nothing-significant")).named_right is None


def test_outside_the_library_a_name_is_dishonest_and_nothing_is_no_answer() -> None:
    strange = truth("open_set", ("quadratic_drag", (1,)), known=False)
    assert judged(strange, answer("unknown-effect")).honest
    assert judged(strange, answer("ambiguous", step("stiction", 1, group=("stiction", "viscous_friction")))).honest
    assert judged(strange, answer("named", step("viscous_friction", 1))).honest is False
    assert judged(strange, answer("unknown-effect", step("viscous_friction", 1))).honest is False
    assert judged(strange, answer("nothing-significant")).honest is False


def test_of_a_pair_both_names_or_at_least_one_can_be_right() -> None:
    pair = truth("pair", ("dead_zone", (1,)), ("wrong_gain", (2,)), parameters={"width": 0.5, "factor": 1.2})
    both = judged(pair, answer("named", step("wrong_gain", 2), step("dead_zone", 1)))
    one = judged(pair, answer("named", step("wrong_gain", 2), step("payload")))
    none = judged(pair, answer("named", step("payload")))
    assert [r.named_right for r in (both, one, none)] == [True, False, False]
    assert [r.at_least_one for r in (both, one, none)] == [True, True, False]
    assert both.joint_right is None


def test_excess_removed_is_from_the_first_step_to_the_last_in_variance_above_the_floor() -> None:
    given = answer("named", step("backlash", 2, holdout=(3.0, 2.0)), step("backlash", 1, holdout=(2.0, 1.5)))
    assert judged(BACKLASH, given).excess_removed == pytest.approx(1.0 - (1.5**2 - 1) / (3.0**2 - 1))
    assert judged(BACKLASH, answer("named", step("backlash", 2, holdout=(1.01, 1.0)))).excess_removed is None
    assert judged(BACKLASH, answer("named", step("backlash", 2))).excess_removed is None


def test_excess_removed_in_all_is_that_of_the_whole_answer() -> None:
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


def test_no_interval_counts_for_a_wrong_name_or_joint_or_where_none_was_stated() -> None:
    gap = {"joint2.backlash.gap": found(0.01, None, None)}
    assert judged(BACKLASH, answer("named", step("backlash", 2, parameters=gap))).covered == ()
    elsewhere = {"joint3.backlash.gap": found(0.01, 0.0, 0.1)}
    assert judged(BACKLASH, answer("named", step("backlash", 3, parameters=elsewhere))).covered == ()


def test_viscous_friction_is_all_that_the_joint_has_on_the_motor_s_side() -> None:
    viscous = truth("single", ("viscous_friction", (2,)), parameters={"coefficient": 40.0})
    stated = {"joint2.viscous_friction.coefficient": found(3.7e-4, 3.6e-4, 3.9e-4)}
    (covered,) = judged(viscous, answer("named", step("viscous_friction", 2, parameters=stated))).covered
    assert covered.truth == pytest.approx(1.1 * 2.53e-4 + 40.0 / 635.5**2)
    assert covered.inside


def test_a_diagnosis_that_failed_is_wrong_in_everything() -> None:
    known, clean = BACKLASH, truth("clean")
    failed = score_of_failure(known, seen(known), 600.0)
    assert (failed.named_right, failed.in_first, failed.joint_right, failed.place) == (False, False, False, "failed")
    assert score_of_failure(clean, seen(clean), 600.0).alarm
    strange = truth("open_set", ("quadratic_drag", (1,)), known=False)
    assert score_of_failure(strange, seen(strange), 1.0).honest is False
