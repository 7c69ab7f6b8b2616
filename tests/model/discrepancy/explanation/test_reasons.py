"""Reasons say what a record shows: for every effect of the shared list, put into an arm and read off its record."""

import re

import numpy as np
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
from model.discrepancy.explanation.answer_words import what_is_left
from model.discrepancy.explanation.effect_words import called
from model.discrepancy.explanation.patterns import PATTERNS
from model.discrepancy.explanation.reasons import reason
from model.discrepancy.explanation.renderer import with_sentences
from model.discrepancy.explanation.step_words import reason_text, step_with_sentences, where_with_summary
from model.discrepancy.grounds import ControllerProof, Reason, Refusal
from model.discrepancy.numbers import plain
from model.discrepancy.verdict import worse_held_out
from model.effects.library import effect
from model.fitting.records import records_of, resolution
from model.machine_model.model import Model
from tests.model.discrepancy import steps
from tests.model.discrepancy.motions import trace_of
from tests.model.fitting import imagined

SIZES: dict[str, dict[str, float]] = {
    "viscous_friction": {"coefficient": 4e-4},
    "coulomb_friction": {"torque": 4.0},
    "load_dependent_friction": {"arm": 0.6},
    "gravity_torque_friction": {"share": 0.3},
    "stribeck_friction": {"torque": 4.0, "speed": 0.05},
    "stiction": {"breakaway": 4.0},
    "direction_dependent_friction": {"difference": 4.0},
    "direction_dependent_viscous_friction": {"difference": 4e-4},
    "weakened_magnet": {"loss": 0.3},
    "resistance_drift": {"heating": 0.05, "time_constant": 60.0},
    "resistance_rise": {"rise": 0.6, "time_constant": 10.0},
    "motor_inductance": {"inductance": 0.03},
    "dead_zone": {"width": 1.0},
    "amplifier_threshold": {"width": 2.0},
    "supply_limit": {"voltage": 4.0},
    "torque_ripple": {"sine": 3.0, "cosine": 0.0, "cycles": 30.0},
    "gear_loss": {"loss": 0.3},
    "direction_dependent_gear_loss": {"difference": 0.3},
    "backlash": {"gap": 0.02},
    "joint_compliance": {"compliance": 0.004},
    "payload": {"mass": 1.5},
    "link_mass": {"added": 1.0},
    "centre_of_mass": {"shift": 0.14},
    "base_tilt": {"about_x": 0.2, "about_y": 0.2},
    "spring_torque": {"stiffness": 8.0, "rest": 0.0},
    "one_sided_spring": {"stiffness": 8.0, "rest": 0.0},
    "periodic_disturbance": {"sine": 3.0, "cosine": 0.0, "frequency": 1.5},
    "potentiometer_gain": {"relative": 0.05},
    "potentiometer_offset": {"offset": 0.1},
    "potentiometer_nonlinearity": {"bend_2": 0.03},
    "input_delay": {"time": 0.03},
    "wrong_gain": {"relative": 0.25},
    "lost_set_points": {"share": 0.3},
}
"""Strong, so that a reason must find them."""

SAYS = {
    "viscous_friction": r"a lag that grows with speed",
    "coulomb_friction": r"lags by [\d.]+° in slow motion and by [\d.]+° in fast, always against the motion",
    "backlash": r"lags by [\d.]+° 0\.\d+ s after each of \d+ reversals and (leads )?by (less than )?[\d.]+° before",
    "direction_dependent_friction": r"(lags|leads) by [\d.]+° moving forwards and (lags|leads) by [\d.]+° backwards",
    "supply_limit": r"where more than 4 V are asked for",
    "torque_ripple": r"30 times a turn",
    "periodic_disturbance": r"at 1\.5 Hz",
    "wrong_gain": r"gets 1\.2\d* times the V that its controller's gain gives for the same error",
    "spring_torque": r"below -?[\d.]+° and by [+−]",
    "input_delay": r"within 0\.1 s of changes of speed",
}
"""What must be in the sentence, where an effect has one sign of its own."""

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


def put_in(arm: Model, name: str, joint: int) -> tuple[Model, tuple[int, ...], dict[str, FoundValue]]:
    """The arm with an effect, and its parameters as an answer has them."""
    joints = () if effect(name).whole_machine else (joint,)
    present = any(use.name == name and (not joints or joint in use.joints) for use in arm.effects)
    if present:
        stated = [p for p in arm.parameters if p.effect == name and joint in p.joints]
        strange = arm.with_values({p.name: SIZES[name][p.part] for p in stated})
    else:
        strange = arm.with_effect(name, joints, SIZES[name])
    own = [p for p in strange.parameters if p.effect == name and (not joints or joint in p.joints)]
    return strange, joints, {p.name: FoundValue.of(p, p.value) for p in own}


def test_every_effect_of_the_shared_list_has_its_entry() -> None:
    assert set(SIZES) == set(effect_names())
    for name, entry in effect_names().items():
        assert entry.called
        assert entry.shows
        assert set(entry.shows) <= set(PATTERNS)
        assert entry.size is None or entry.size in {p.name for p in effect(name).parameters}


@pytest.mark.parametrize("name", SIZES)
def test_a_reason_says_what_the_record_shows(arm: Model, name: str) -> None:
    strange, joints, parameters = put_in(arm, name, 2)
    records = records_of([trace_of(strange)], arm.machine, "position")
    found = reason(name, joints, parameters, model=strange, before=arm, records=records)
    assert found.rms is not None
    assert found.rms.before > found.rms.after
    text = reason_text(step_with(name, joints, parameters, found))
    said = re.fullmatch(
        r"Joint (\d) (.*): (.*), which takes its rms error from [\d.]+ to [\d.]+ ADC counts\.( What shows it is .*)?",
        text,
    )
    assert said is not None, text
    assert int(said[1]) == found.joint
    assert called(name) in said[3]
    if joints:
        assert found.joint == 2
    if name in SAYS:
        assert re.search(SAYS[name], said[2]), text


def test_a_reason_names_the_rival_and_the_other_joints(arm: Model) -> None:
    strange = arm.with_effect("coulomb_friction", (1, 2), {"torque": 4.0})
    records = records_of([trace_of(strange)], arm.machine, "position")
    found = {}
    for p in (p for p in strange.parameters if p.effect == "coulomb_friction"):
        found[p.name] = FoundValue.of(p, 4.0, 3.8, 4.2)
    rival = Candidate(effect="stiction", joints=(1, 2), evidence=600.0)
    speaks = reason("coulomb_friction", (1, 2), found, model=strange, before=arm, records=records, rival=rival)
    text = reason_text(step_with("coulomb_friction", (1, 2), found, speaks))
    assert "(and likewise joint " in text
    assert "Coulomb friction, 4 N·m (3.8 to 4.2)" in text
    assert text.endswith("The next best, stiction on joints 1 and 2, has evidence of 600, and this has 900.")


@pytest.fixture(scope="module")
def friction(arm: Model) -> tuple[dict[str, FoundValue], Reason]:
    """Parameters and reason of Coulomb friction on joint 2, with stiction as its rival."""
    records = records_of([trace_of(arm, 8.0)], arm.machine, "position")
    strange = arm.with_effect("coulomb_friction", (2,), {"torque": 1.0})
    torque = strange.parameter("joint2.coulomb_friction.torque")
    found = {torque.name: FoundValue.of(torque, 1.0, 0.9, 1.1)}
    rival = Candidate(effect="stiction", joints=(2,), evidence=728.0)
    return found, reason("coulomb_friction", (2,), found, model=strange, before=arm, records=records, rival=rival)


def test_a_rival_that_has_come_to_more_is_said_as_such(friction: tuple[dict[str, FoundValue], Reason]) -> None:
    """The fit that was ranked first came to less when it was completed."""
    text = reason_text(step_with("coulomb_friction", (2,), *friction, evidence=539.0, margin=-189.0))
    assert text.endswith(
        "Its completed fit has evidence of 539, less than the 728 of stiction on joint 2: these traces do not tell "
        "which of the two it is."
    )


@pytest.mark.parametrize(
    ("place", "joints", "said"), [(None, (2,), True), (1, (2,), True), (2, (2,), False), (2, (), False)]
)
def test_a_place_that_is_not_the_effect_s_is_mentioned(
    friction: tuple[dict[str, FoundValue], Reason], place: int | None, joints: tuple[int, ...], said: bool
) -> None:
    where = NOWHERE.model_copy(update={"joint": place})
    text = reason_text(step_with("coulomb_friction", joints, *friction, where=where))
    assert text.endswith("What shows it is the pattern over the whole record, not one place.") == said


def test_a_reason_gives_the_size_of_the_last_fit(friction: tuple[dict[str, FoundValue], Reason]) -> None:
    speaks = friction[1].model_copy(update={"joint": 3, "rival": None})
    first = {
        f"joint{j}.dead_zone.width": FoundValue(value=v, low=0.724, high=0.77, unit="V", part="width", joints=(j,))
        for j, v in ((2, 0.747), (3, 0.8))
    }
    last = {
        name: v.model_copy(update={"value": v.value + 0.1, "low": 0.6732, "high": 0.8217}) for name, v in first.items()
    }
    step = step_with("dead_zone", (2, 3), first, speaks)
    assert "a dead zone of the amplifier, 0.8 V (0.724 to 0.77), which" in reason_text(step)
    fitted = step.model_copy(update={"parameters": last})
    assert "a dead zone of the amplifier, 0.9 V (0.673 to 0.822), which" in reason_text(fitted)
    shapeless = step_with("periodic_disturbance", (3,), {}, speaks)
    assert ": a periodic torque from outside, which" in reason_text(shapeless)
    load = {"payload.mass": FoundValue(value=1.6, low=1.5, high=1.7, unit="kg", part="mass")}
    assert "a load other than the model's, 1.6 kg (1.5 to 1.7), which" in reason_text(
        step_with("payload", (), load, speaks)
    )


def test_a_rival_without_evidence_and_an_error_that_hardly_falls_are_said_as_such(arm: Model) -> None:
    records = records_of([trace_of(arm, 8.0)], arm.machine, "position")
    strange = arm.with_effect("coulomb_friction", (2,), {"torque": 1e-3})
    torque = strange.parameter("joint2.coulomb_friction.torque")
    found = {torque.name: FoundValue.of(torque, 1e-3, 0.0, 0.01)}
    rival = Candidate(effect="stiction", joints=(2,), evidence=-3.0)
    speaks = reason("coulomb_friction", (2,), found, model=strange, before=arm, records=records, rival=rival)
    text = reason_text(step_with("coulomb_friction", (2,), found, speaks, evidence=30.0, margin=33.0))
    assert "which hardly changes its rms error" in text
    assert text.endswith("No other fitted candidate has a twentieth of its evidence of 30.")


def test_a_caller_that_simulates_better_is_believed(arm: Model) -> None:
    records = records_of([trace_of(arm, 8.0)], arm.machine, "position")
    strange = arm.with_effect("coulomb_friction", (2,), {"torque": 1.0})
    torque = strange.parameter("joint2.coulomb_friction.torque")
    found = {torque.name: FoundValue.of(torque, 1.0, 0.9, 1.1)}

    def left(model: Model) -> list[np.ndarray]:
        return [np.full_like(records[0].measured, 0.1 if model is strange else 0.2)]

    speaks = reason("coulomb_friction", (2,), found, model=strange, before=arm, records=records, left=left)
    text = reason_text(step_with("coulomb_friction", (2,), found, speaks))
    factor = 0.2 / resolution(arm.machine.joint(2).sensor)  # type: ignore[arg-type]
    assert f"takes its rms error from {plain(factor)} to {plain(factor / 2)} ADC counts" in text


@pytest.mark.parametrize(
    ("effect", "said"),
    [
        ("wrong_gain", "the recorded power is 1.200 times the gain times the recorded error (40 of 50 samples)"),
        ("lost_set_points", "the recorded error is not set point − position in 40 samples, so set points were lost"),
    ],
)
def test_what_the_controllers_numbers_prove_is_said_without_a_model(effect: str, said: str) -> None:
    value = {f"joint2.{effect}.x": FoundValue(value=0.2, low=0.19, high=0.21, unit="1")}
    where = Where(joint=2, phase=None, summary=UNWRITTEN, cells=(), dependences=())
    step = step_with(effect, (2,), value, where=where).model_copy(update={"proof": ControllerProof(samples=40, of=50)})
    written = step_with_sentences(step)
    assert written.reason == f"Joint 2: {said}; this needs no model of the arm."
    assert written.where.summary == f"Joint 2: {said}."


def answer(arm: Model, **fields: object) -> Diagnosis:
    """An answer with these fields, and its sentences."""
    bare = Diagnosis(
        verdict="unknown-effect",
        summary=UNWRITTEN,
        steps=(),
        where=NOWHERE,
        model_before=arm,
        model_after=arm,
        traces=(),
        seconds=1.0,
        robot_seconds=1.0,
    )
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
    refusal = Refusal(kind="error-rises", numbers={"rise": 15.0, "deviation": 7.0})
    step = step_with("stiction", (2,), {}, evidence=120.0).model_copy(update={"refusal": refusal, "adopted": False})
    found = answer(arm, verdict="nothing-significant", steps=(step,))
    assert found.steps[0].rejected_because == (
        "the error on the held-out traces rises: its sum of squares by 15 ± 7 variances of a reading"
    )
    assert "stiction on joint 2 explains more of the fitted ones, with evidence of 120, but the error" in found.summary


def test_an_answer_with_nothing_significant_says_what_was_taken_back(arm: Model) -> None:
    """It had held on held-out traces, so it is not said that none does."""
    rises = Refusal(kind="error-rises", numbers={"rise": 15.0, "deviation": 7.0})
    refused = step_with("stiction", (2,), {}, evidence=120.0).model_copy(update={"refusal": rises, "adopted": False})
    resembles = Refusal(kind="only-resembles", joints=(2,))
    back = step_with("backlash", (2,), {}, evidence=90.0).model_copy(update={"refusal": resembles, "adopted": False})
    found = answer(arm, verdict="nothing-significant", steps=(refused, back))
    assert found.summary == (
        "Nothing is named: backlash on joint 2 was added, with evidence of 90, and taken back, because it only "
        "resembles what is missing: with all that was found, joint 2 still disagrees beyond noise. What is left "
        "without it has no shape of an effect."
    )


def test_several_reasons_and_what_is_left_are_sentences_one_after_the_other(
    arm: Model, friction: tuple[dict[str, FoundValue], Reason]
) -> None:
    step = step_with("coulomb_friction", (2,), *friction)
    shape = remaining("speed", 0.7, -0.5, 0.1, 0.4, 1.0, 2.5)
    found = answer(arm, verdict="named", steps=(step, step), remaining=(shape,))
    told = reason_text(step)
    assert found.summary == f"{told} {told} Something is left that none of the known effects explains."


def test_an_older_answer_keeps_its_text(arm: Model) -> None:
    step = step_with("stiction", (2,), {}).model_copy(update={"reason": "it sticks"})
    found = answer(arm, verdict="named", steps=(step,), notes=("one note",))
    assert (found.steps[0].reason, found.notes, found.where) == ("it sticks", ("one note",), NOWHERE)


def remaining(against: AgainstWhat, explained: float, *torques: float | None) -> RemainingShape:
    return RemainingShape(
        joint=3,
        against=against,
        unit="1",
        torque_unit="N·m",
        centres=tuple(map(float, range(len(torques)))),
        torque=torques,
        deviation=torques,
        explained=explained,
    )


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


def test_friction_at_a_place_is_told_with_the_place() -> None:
    tight = remaining("position", 0.8, 0.01, 0.12, None, -0.06, -0.05).model_copy(
        update={"unit": "rad", "against_motion": True}
    )
    assert what_is_left([tight]) == (
        "no clear shape: the best, friction at joint 3 of −0.06 to 0.12 N·m that goes with position, most at 57.3°, "
        "explains 80 % of what is left, but rests on 4 of the 5 bins that a shape needs"
    )


def test_joints_on_which_more_than_noise_is_left_are_named_where_the_map_names_none(arm: Model) -> None:
    assert answer(arm).summary.startswith("Joint 2, after reversals: 2.1 ADC counts rms. No known effect explains it; ")
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
