"""Reasons say what an effect does, how large it is, and what it takes off the error."""

import pytest

from daq.contracts.effects import effect_names
from model.discrepancy.diagnosis import (
    UNWRITTEN,
    AgainstWhat,
    Candidate,
    Diagnosis,
    FoundValue,
    PhaseCell,
    RemainingShape,
    SignalError,
    Step,
    Where,
    WorstPlace,
)
from model.discrepancy.explanation.answer_words import what_is_left, with_sentences
from model.discrepancy.explanation.step_words import reason_text, step_with_sentences, where_with_summary
from model.discrepancy.grounds import ControllerProof, Reason, Refusal
from model.discrepancy.verdict import worse_held_out
from model.effects.library import effect
from model.machine_model.model import Model
from tests.model.discrepancy import steps
from tests.model.fitting import imagined

NOWHERE = Where(
    joint=None, phase=None, summary="Joint 2, after reversals: 2.1 ADC counts rms.", cells=(), dependences=()
)
JOINT_2 = NOWHERE.model_copy(update={"joint": 2})


def step_with(
    effect: str,
    joints: tuple[int, ...],
    parameters: dict[str, FoundValue],
    speaks: Reason | None = None,
    where: Where = JOINT_2,
    evidence: float = 900.0,
    margin: float = 300.0,
) -> Step:
    """A step with an evidence, where the arm disagreed with the model."""
    return steps.step(
        effect, joints, parameters=parameters, reason_data=speaks, where=where, evidence=evidence, margin=margin
    )


@pytest.fixture(scope="module")
def arm() -> Model:
    return imagined.arm()


def test_every_effect_of_the_shared_list_has_its_entry() -> None:
    for name, entry in effect_names().items():
        assert entry.called
        assert entry.size is None or entry.size in {p.name for p in effect(name).parameters}


TORQUE = {
    f"joint{j}.coulomb_friction.torque": FoundValue(
        value=4.0, low=3.8, high=4.2, unit="N·m", part="torque", joints=(j,)
    )
    for j in (1, 2)
}


def test_a_reason_says_what_the_effect_does_and_its_sizes(arm: Model) -> None:
    assert reason_text(step_with("coulomb_friction", (1, 2), TORQUE, Reason()), arm.machine) == (
        "Joints 1 and 2: a constant torque opposes motion and changes sign with its direction, at any speed (torque of "
        "joint 1 4 N·m, torque of joint 2 4 N·m)."
    )


@pytest.mark.parametrize(
    ("effect", "said"),
    [
        ("wrong_gain", "the recorded power is 1.200 times the gain times the recorded error (40 of 50 samples)"),
        ("lost_set_points", "the recorded error is not set point − position in 40 samples, so set points were lost"),
    ],
)
def test_what_the_controllers_numbers_prove_is_said_without_a_model(arm: Model, effect: str, said: str) -> None:
    value = {f"joint2.{effect}.x": FoundValue(value=0.2, low=0.19, high=0.21, unit="1")}
    where = Where(joint=2, phase=None, summary=UNWRITTEN, cells=(), dependences=())
    step = step_with(effect, (2,), value, where=where).model_copy(update={"proof": ControllerProof(samples=40, of=50)})
    written = step_with_sentences(step, arm.machine)
    assert written.reason == f"Joint 2: {said}; this needs no model of the arm."
    assert written.where.summary == f"Joint 2: {said}."


def answer(arm: Model, **fields: object) -> Diagnosis:
    """An answer with these fields, and its sentences."""
    bare = steps.answer_of(arm, verdict="unknown-effect", summary=UNWRITTEN, where=NOWHERE)
    return with_sentences(bare.model_copy(update=fields))


def test_an_undecided_answer_lists_the_group_with_its_evidence(arm: Model) -> None:
    group = tuple(
        Candidate(effect=e, joints=(2,), evidence=v) for e, v in (("stiction", 120.0), ("coulomb_friction", 118.0))
    )
    step = step_with("stiction", (2,), {}).model_copy(update={"group": group})
    assert answer(arm, verdict="ambiguous", steps=(step,)).summary == (
        "Joint 2, after reversals: 2.1 ADC counts rms. These explain it, with evidence that differs by no more than 2: "
        "stiction on joint 2 (120), Coulomb friction on joint 2 (118)."
    )


def test_an_answer_with_nothing_significant_says_what_was_refused(arm: Model) -> None:
    assert answer(arm, verdict="nothing-significant").summary.startswith("Nothing significant")
    refusal = Refusal(kind="falls-too-little", numbers={"share": -0.15})
    step = step_with("stiction", (2,), {}, evidence=120.0).model_copy(update={"refusal": refusal, "adopted": False})
    found = answer(arm, verdict="nothing-significant", steps=(step,))
    assert found.steps[0].rejected_because == ("on records not fitted to, the mean square grows by 15.0%")
    assert "stiction on joint 2 explains more of the fitted ones, with evidence of 120, but on records" in found.summary


def test_an_answer_with_nothing_significant_says_what_was_taken_back(arm: Model) -> None:
    """It had held on held-out traces, so it is not said that none does."""
    grows = Refusal(kind="falls-too-little", numbers={"share": -0.15})
    refused = step_with("stiction", (2,), {}, evidence=120.0).model_copy(update={"refusal": grows, "adopted": False})
    resembles = Refusal(kind="only-resembles", joints=(2,))
    back = step_with("backlash", (2,), {}, evidence=90.0).model_copy(update={"refusal": resembles, "adopted": False})
    found = answer(arm, verdict="nothing-significant", steps=(refused, back))
    assert found.summary == (
        "Nothing is named: backlash on joint 2 was added, with evidence of 90, and taken back, because it only "
        "resembles what is missing: with all that was found, joint 2 still disagrees beyond noise. What is left "
        "without it has no shape of an effect."
    )


def remaining(against: AgainstWhat, explained: float, *torques: float | None) -> RemainingShape:
    return steps.shape(3, against, explained, torques)


def test_what_is_left_is_called_a_shape_only_where_it_is_one() -> None:
    assert what_is_left([]) == "what is left has no shape against time, position, speed, direction or drive"
    shape = remaining("speed", 0.7, None, -0.5, 0.1, 0.4, 1.0, 2.5)
    few, faint = remaining("time", 0.8, -0.22, 0.03), remaining("drive", 0.08, *shape.torque)
    assert what_is_left([few, shape, faint]) == (
        "a torque at joint 3 of −0.5 to 2.5 N·m that goes with speed explains 70 % of what is left"
    )
    assert what_is_left([faint]) == (
        "no clear shape: the best, a torque at joint 3 of −0.5 to 2.5 N·m that goes with drive, explains only 8 % of "
        "what is left"
    )
    assert what_is_left([few, faint]).endswith(
        "goes with time, explains 80 % of what is left, but rests on 2 of the 5 bins that a shape needs"
    )


def test_joints_on_which_more_than_noise_is_left_are_named_where_the_map_names_none(arm: Model) -> None:
    assert answer(arm).summary.startswith("Joint 2, after reversals: 2.1 ADC counts rms. No known effect explains it.")
    assert answer(arm, unexplained_joints=(2, 3)).summary.startswith(
        "Joints 2 and 3: more than noise is left. No known"
    )
    cell = PhaseCell(joint=3, start=1.2, end=1.5, phase="hold", mean_square=3.0, significance=5.25)
    place = NOWHERE.model_copy(update={"cells": (cell,)})
    assert (
        "; the clearest place is joint 3 at 1.2 s, by 5.2 standard"
        in answer(arm, unexplained_joints=(2, 3), where=place).summary
    )


def test_a_tolerance_fit_that_held_out_traces_refute_is_warned_of(arm: Model) -> None:
    def worse(*after: float) -> tuple[int, ...]:
        return worse_held_out(
            [SignalError(joint=j + 1, unit="rad", before=2e-3, after=a, floor=1e-3) for j, a in enumerate(after)]
        )

    assert worse(1e-3, 4e-3) == (2,)
    assert worse(3e-3, 4e-3) == (1, 2)
    assert worse(2e-3, 2.1e-3) == (), "not by a tenth, nor by more than noise may do"
    assert answer(arm, worse_held_out=(1, 2)).summary.endswith(
        " The fit of the tolerance parameters does not hold on held-out traces, where the error of joints 1 and 2 "
        "grows: do not use the model after."
    )


def test_the_joint_with_the_largest_torque_left_is_told_beside_the_one_furthest_above_its_noise() -> None:
    worst = WorstPlace(joint=6, phase="creep", ratio=40.0, rms=8.0, unit="N·m", whole_record=True)
    largest = WorstPlace(joint=2, phase="hold", ratio=12.0, rms=2000.0, unit="N·m", whole_record=True)
    where = Where(joint=6, phase="creep", summary="", cells=(), dependences=(), worst=worst)
    assert where_with_summary(where).summary == "Joint 6, mostly in slow motion: 8 N·m rms, 40 times its noise."
    both = where_with_summary(where.model_copy(update={"largest": largest}))
    assert both.summary.endswith("40 times its noise; more is left of joint 2, 2000 N·m rms.")
    exact = where.model_copy(update={"worst": worst.model_copy(update={"ratio": 3.8e8})})
    said = where_with_summary(exact).summary
    assert said.endswith("8 N·m rms, and the machine file states no noise of the sensors to compare it with.")
