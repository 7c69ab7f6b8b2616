"""What is answered when nothing more is found, and what is taken back."""

from __future__ import annotations

from model.discrepancy.diagnosis import Candidate, SignalError, Step, Where
from model.discrepancy.thresholds import Thresholds
from model.discrepancy.verdict import first_to_withdraw, unexplained, verdict, withdrawn

LINES = Thresholds(unexplained=0.3, unnamed=0.12, least_share=0.9)


def error(joint: int, before: float, after: float) -> SignalError:
    """Variances in floors."""
    return SignalError(joint=joint, unit="rad", before=before**0.5, after=after**0.5, floor=1.0)


def step(effect: str, joints: tuple[int, ...]) -> Step:
    """A step that was taken into the model."""
    nowhere = Where(joint=None, phase=None, summary="", cells=(), dependences=())
    return Step(
        effect=effect, joints=joints, parameters={}, evidence=50.0, margin=50.0, candidates=(), rmse_fit=(),
        where=nowhere, reason="", adopted=True,
    )  # fmt: skip


def test_noise_is_explained() -> None:
    assert unexplained([error(1, 1.05, 1.05)], [error(1, 1.2, 1.2)], LINES, named=False) == ()


def test_while_nothing_is_named_fitted_traces_tell_more_finely() -> None:
    assert unexplained([error(1, 1.2, 1.2)], [], LINES, named=False) == (1,)
    assert unexplained([error(1, 1.2, 1.2)], [], LINES, named=True) == ()


def test_a_law_that_is_nearly_right_may_leave_a_share_of_what_it_explained() -> None:
    assert unexplained([error(2, 11.0, 1.9)], [], LINES, named=True) == ()
    assert unexplained([error(2, 3.0, 1.9)], [], LINES, named=True) == (2,)


def test_held_out_traces_tell_too() -> None:
    assert unexplained([error(3, 2.0, 1.1)], [error(3, 4.8, 1.9)], LINES, named=True) == (3,)


def test_verdicts() -> None:
    taken = step("backlash", (2,))
    assert verdict([taken], unexplained=True) == "unknown-effect"
    assert verdict([taken], unexplained=False) == "named"
    assert verdict([], unexplained=False) == "nothing-significant"
    assert verdict([withdrawn(taken, (2,))], unexplained=False) == "nothing-significant"


def test_a_group_that_held_out_traces_refuse_is_no_answer() -> None:
    group = (Candidate(effect="backlash", joints=(2,), evidence=50.0),)
    close = step("backlash", (2,)).model_copy(update={"group": group})
    refused = close.model_copy(update={"adopted": False, "rejected_because": "the held-out error rises"})
    assert verdict([close], unexplained=False) == "ambiguous"
    assert verdict([refused], unexplained=False) == "nothing-significant"
    assert verdict([step("stiction", (3,)), refused], unexplained=False) == "named"


def test_steps_on_a_joint_that_stays_unexplained_are_taken_back() -> None:
    steps = [step("backlash", (2,)), step("supply_limit", (3,))]
    assert first_to_withdraw(steps, (3,)) == 1
    assert first_to_withdraw(steps, (1,)) is None
    taken_back = withdrawn(steps[1], (3,))
    assert not taken_back.adopted
    assert "joint 3 still disagrees" in str(taken_back.rejected_because)
