"""What is answered when nothing more is found, and what is taken back."""

from model.discrepancy.diagnosis import Candidate, SignalError
from model.discrepancy.grounds import Refusal
from model.discrepancy.thresholds import Thresholds
from model.discrepancy.verdict import unexplained, verdict, withdrawn
from tests.model.discrepancy.steps import step

LINES = Thresholds(unexplained=0.3, unnamed=0.12, least_share=0.9)


def error(joint: int, before: float, after: float) -> SignalError:
    """Variances in floors."""
    return SignalError(joint=joint, unit="rad", before=before**0.5, after=after**0.5, floor=1.0)


def test_errors_at_the_noise_floor_are_explained() -> None:
    assert unexplained([error(1, 1.05, 1.05)], [error(1, 1.2, 1.2)], LINES, named=False) == ()


def test_the_line_for_fitted_traces_is_lower_while_nothing_is_named() -> None:
    assert unexplained([error(1, 1.2, 1.2)], [], LINES, named=False) == (1,)
    assert unexplained([error(1, 1.2, 1.2)], [], LINES, named=True) == ()


def test_a_nearly_right_law_may_leave_a_share_of_what_it_explained() -> None:
    assert unexplained([error(2, 11.0, 1.9)], [], LINES, named=True) == ()
    assert unexplained([error(2, 3.0, 1.9)], [], LINES, named=True) == (2,)


def test_a_joint_is_unexplained_on_held_out_traces_alone() -> None:
    assert unexplained([error(3, 2.0, 1.1)], [error(3, 4.8, 1.9)], LINES, named=True) == (3,)


def test_an_unexplained_joint_decides_the_verdict_before_any_step() -> None:
    taken = step("backlash", (2,))
    assert verdict([taken], unexplained=True) == "unknown-effect"
    assert verdict([taken], unexplained=False) == "named"
    assert verdict([], unexplained=False) == "nothing-significant"
    assert verdict([withdrawn(taken, (2,))], unexplained=False) == "nothing-significant"


def test_a_name_beside_which_far_more_than_noise_is_left_is_a_part_of_the_answer() -> None:
    taken = step("backlash", (2,))
    assert verdict([taken], unexplained=False, partly=True) == "partly"
    assert verdict([withdrawn(taken, (2,))], unexplained=False, partly=True) == "nothing-significant"


def test_a_group_that_held_out_traces_refuse_is_no_answer() -> None:
    group = (Candidate(effect="backlash", joints=(2,), evidence=50.0),)
    close = step("backlash", (2,)).model_copy(update={"group": group})
    grows = Refusal(kind="falls-too-little", numbers={"share": -0.15})
    refused = close.model_copy(update={"adopted": False, "refusal": grows})
    assert verdict([close], unexplained=False) == "ambiguous"
    assert verdict([refused], unexplained=False) == "nothing-significant"
    assert verdict([step("stiction", (3,)), refused], unexplained=False) == "named"


def test_a_step_that_is_withdrawn_only_resembles_what_is_missing() -> None:
    taken_back = withdrawn(step("supply_limit", (3,)), (3,))
    assert not taken_back.adopted
    assert taken_back.refusal == Refusal(kind="only-resembles", joints=(3,))
