"""Reasons say what a record shows: for every effect of the shared list, put into an arm and read off its record."""

from __future__ import annotations

import re

import numpy as np
import pytest

from daq.contracts.effects import effect_names
from model.discrepancy.diagnosis import AgainstWhat, Candidate, FoundValue, RemainingShape, SignalError, Step, Where
from model.discrepancy.explanation.numbers import plain
from model.discrepancy.explanation.reasons import nothing, reason, undecided, unexplained, with_size
from model.discrepancy.explanation.table import TELLING
from model.effects.library import effect
from model.fitting.records import records_of, resolution
from model.machine_model.model import Model
from tests.model.discrepancy.motions import trace_of
from tests.model.fitting import imagined

SIZES: dict[str, dict[str, float]] = {
    "viscous_friction": {"coefficient": 4e-4},
    "coulomb_friction": {"torque": 4.0},
    "load_dependent_friction": {"arm": 0.6},
    "stribeck_friction": {"torque": 4.0, "speed": 0.05},
    "stiction": {"breakaway": 4.0},
    "direction_dependent_friction": {"difference": 4.0},
    "back_emf_error": {"relative": 0.3},
    "resistance_drift": {"heating": 0.05, "time_constant": 60.0},
    "motor_inductance": {"inductance": 0.03},
    "dead_zone": {"width": 1.0},
    "supply_limit": {"voltage": 4.0},
    "torque_ripple": {"sine": 3.0, "cosine": 0.0, "cycles": 30.0},
    "gear_loss": {"loss": 0.3},
    "backlash": {"gap": 0.02},
    "joint_compliance": {"compliance": 0.004},
    "payload": {"mass": 1.5},
    "link_mass": {"added": 1.0},
    "centre_of_mass": {"shift": 0.14},
    "base_tilt": {"about_x": 0.2, "about_y": 0.2},
    "spring_torque": {"stiffness": 8.0, "rest": 0.0},
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
    joint=None, phase=None, summary="joint 2, after reversals: 2.1 ADC counts rms", cells=(), dependences=()
)


@pytest.fixture(scope="module")
def arm() -> Model:
    return imagined.arm()


def put_in(arm: Model, name: str, joint: int) -> tuple[Model, tuple[int, ...], dict[str, FoundValue]]:
    """The arm with an effect, and its parameters as an answer has them."""
    joints = () if effect(name).whole_machine else (joint,)
    present = any(use.name == name and (not joints or joint in use.joints) for use in arm.effects)
    if present:
        names = {p.name: p for p in arm.parameters if p.effect == name and joint in p.joints}
        strange = arm.with_values({n: SIZES[name][n.rpartition(".")[2]] for n in names})
    else:
        strange = arm.with_effect(name, joints, SIZES[name])
    own = [p for p in strange.parameters if p.effect == name and (not joints or joint in p.joints)]
    return strange, joints, {p.name: FoundValue(value=p.value, low=None, high=None, unit=p.unit) for p in own}


def test_every_effect_of_the_shared_list_has_its_entry() -> None:
    assert set(TELLING) == set(effect_names())
    assert set(SIZES) == set(effect_names())
    for name, entry in TELLING.items():
        assert entry.size is None or entry.size in {p.name for p in effect(name).parameters}


@pytest.mark.parametrize("name", SIZES)
def test_a_reason_says_what_the_record_shows(arm: Model, name: str) -> None:
    strange, joints, parameters = put_in(arm, name, 2)
    records = records_of([trace_of(strange)], arm.machine, "position")
    text = reason(name, joints, parameters, 900.0, 300.0, model=strange, before=arm, records=records)
    told = re.fullmatch(r"joint (\d) (.*): (.*), which takes its rms error from ([\d.]+) to ([\d.]+) ADC counts", text)
    assert told is not None, text
    assert float(told[4]) > float(told[5]), text
    assert TELLING[name].called in told[3]
    if joints:
        assert told[1] == "2"
    if name in SAYS:
        assert re.search(SAYS[name], told[2]), text


def test_a_reason_names_the_rival_and_the_other_joints(arm: Model) -> None:
    strange = arm.with_effect("coulomb_friction", (1, 2), {"torque": 4.0})
    records = records_of([trace_of(strange)], arm.machine, "position")
    found = {f"joint{j}.coulomb_friction.torque": FoundValue(value=4.0, low=3.8, high=4.2, unit="N·m") for j in (1, 2)}
    rival = Candidate(effect="stiction", joints=(1, 2), evidence=600.0)
    text = reason(
        "coulomb_friction", (1, 2), found, 900.0, 300.0, model=strange, before=arm, records=records,
        runner_up=rival,
    )  # fmt: skip
    assert "(and likewise joint " in text
    assert "Coulomb friction, 4 N·m (3.8 to 4.2)" in text
    assert text.endswith("; the next best, stiction on joints 1 and 2, has 600 of evidence where this has 900")


def test_a_rival_that_has_come_to_more_is_said_as_such(arm: Model) -> None:
    """The fit that was ranked first came to less when it was taken to its end."""
    records = records_of([trace_of(arm, 8.0)], arm.machine, "position")
    strange = arm.with_effect("coulomb_friction", (2,), {"torque": 1.0})
    found = {"joint2.coulomb_friction.torque": FoundValue(value=1.0, low=0.9, high=1.1, unit="N·m")}
    rival = Candidate(effect="stiction", joints=(2,), evidence=728.0)
    text = reason(
        "coulomb_friction", (2,), found, 539.0, -189.0, model=strange, before=arm, records=records, runner_up=rival
    )
    assert text.endswith(
        "; taken to its end, its fit has 539 of evidence, less than the 728 of stiction on joint 2: these traces do "
        "not tell which of the two it is"
    )


@pytest.mark.parametrize(
    ("place", "joints", "said"), [(None, (2,), True), (1, (2,), True), (2, (2,), False), (2, (), False)]
)
def test_a_place_that_is_not_the_effect_s_is_spoken_of(
    arm: Model, place: int | None, joints: tuple[int, ...], said: bool
) -> None:
    records = records_of([trace_of(arm, 8.0)], arm.machine, "position")
    name = "coulomb_friction" if joints else "payload"
    strange = arm.with_effect(name, joints, SIZES[name])
    where = NOWHERE.model_copy(update={"joint": place})
    text = reason(name, joints, {}, 50.0, 20.0, model=strange, before=arm, records=records, where=where)
    assert text.endswith("; what shows it is the pattern over the whole record, not one place") == said


def test_a_reason_takes_the_size_of_the_last_fit() -> None:
    turn = {
        f"joint{j}.dead_zone.width": FoundValue(value=v, low=0.724, high=0.77, unit="V")
        for j, v in ((2, 0.747), (3, 0.8))
    }
    last = {
        f"joint{j}.dead_zone.width": FoundValue(value=v, low=0.6732, high=0.8217, unit="V")
        for j, v in ((2, 0.7475), (3, 0.9))
    }
    begin = "joint {} lags by 0.13° whenever it moves: a dead zone of the amplifier, "
    end = ", which takes its rms error from 3.2 to 0.62 ADC counts"
    told = begin.format(3) + "0.8 V (0.724 to 0.77)" + end
    assert with_size(told, "dead_zone", (2, 3), turn, last) == begin.format(3) + "0.9 V (0.673 to 0.822)" + end
    shapeless = "joint 1 swings by 0.037° at 0.123 Hz: a periodic torque from outside, which takes its rms error"
    assert with_size(shapeless, "periodic_disturbance", (1,), turn, last) == shapeless
    load = {"payload.mass": FoundValue(value=1.5, low=None, high=None, unit="kg")}
    heavier = {"payload.mass": FoundValue(value=1.6, low=1.5, high=1.7, unit="kg")}
    told = "joint 2 is off by +0.1° throughout: a load other than the model's, 1.5 kg, which takes"
    assert "other than the model's, 1.6 kg (1.5 to 1.7), which" in with_size(told, "payload", (), load, heavier)


def test_a_rival_without_evidence_and_a_faint_mark_are_said_as_such(arm: Model) -> None:
    records = records_of([trace_of(arm, 8.0)], arm.machine, "position")
    strange = arm.with_effect("coulomb_friction", (2,), {"torque": 1e-3})
    found = {"joint2.coulomb_friction.torque": FoundValue(value=1e-3, low=0.0, high=0.01, unit="N·m")}
    rival = Candidate(effect="stiction", joints=(2,), evidence=-3.0)
    text = reason(
        "coulomb_friction", (2,), found, 30.0, 33.0, model=strange, before=arm, records=records, runner_up=rival
    )
    assert "whose mark is faint" in text
    assert text.endswith("; no other candidate that was fitted has a twentieth of its evidence, 30")


def test_a_caller_that_simulates_better_is_believed(arm: Model) -> None:
    records = records_of([trace_of(arm, 8.0)], arm.machine, "position")
    strange = arm.with_effect("coulomb_friction", (2,), {"torque": 1.0})
    found = {"joint2.coulomb_friction.torque": FoundValue(value=1.0, low=0.9, high=1.1, unit="N·m")}

    def left(model: Model) -> list[np.ndarray]:
        return [np.full_like(records[0].measured, 0.1 if model is strange else 0.2)]

    text = reason("coulomb_friction", (2,), found, 30.0, 3.0, model=strange, before=arm, records=records, left=left)
    factor = 0.2 / resolution(arm.machine.joint(2).sensor)  # type: ignore[arg-type]
    assert f"takes its rms error from {plain(factor)} to {plain(factor / 2)} ADC counts" in text


def test_other_answers_have_their_reasons() -> None:
    group = [
        Candidate(effect=e, joints=(2,), evidence=v) for e, v in (("stiction", 120.0), ("coulomb_friction", 118.0))
    ]
    assert "2 of evidence is all that lies between them" in undecided(group, NOWHERE)
    assert nothing().startswith("nothing significant")
    step = Step(
        effect="stiction", joints=(2,), parameters={}, evidence=120.0, margin=40.0, candidates=(), rmse_fit=(),
        where=NOWHERE, reason="it sticks", adopted=False, rejected_because="the error on the held-out traces rises",
    )  # fmt: skip
    assert "stiction on joint 2 explains more of the fitted ones, with 120 of evidence, but the error" in nothing(step)


def remaining(against: AgainstWhat, explained: float, *torques: float | None) -> RemainingShape:
    return RemainingShape(
        joint=3, against=against, unit="1", torque_unit="N·m", centres=tuple(map(float, range(len(torques)))),
        torque=torques, deviation=torques, explained=explained,
    )  # fmt: skip


def test_what_is_left_is_told_as_a_shape_only_where_it_is_one() -> None:
    assert unexplained(NOWHERE, [], (2, 3)).startswith("joints 2, 3: more than noise is left")
    assert unexplained(NOWHERE, []).endswith(
        "; what is left has no shape against time, position, speed, direction or drive"
    )
    shape = remaining("speed", 0.7, None, -0.5, 0.1, 0.4, 1.0, 2.5)
    few, faint = remaining("time", 0.8, -0.22, 0.03), remaining("drive", 0.08, *shape.torque)
    assert unexplained(NOWHERE, [few, shape, faint]).endswith(
        "; a torque at joint 3 of −0.5 to 2.5 N·m that goes with speed explains 70 % of what is left"
    )
    assert unexplained(NOWHERE, [faint]).endswith(
        "; no clear shape: the best, a torque at joint 3 of −0.5 to 2.5 N·m that goes with drive, explains only 8 % of "
        "what is left"
    )
    assert unexplained(NOWHERE, [few, faint]).endswith(
        "goes with time, explains 80 % of what is left, but rests on 2 of the 5 bins that a shape needs"
    )


def test_a_tolerance_fit_that_held_out_traces_refute_is_warned_of() -> None:
    def told(*after: float) -> str:
        held = [SignalError(joint=j + 1, unit="rad", before=2e-3, after=a, floor=1e-3) for j, a in enumerate(after)]
        return unexplained(NOWHERE, [], held=held)

    warning = (
        "; the fit of the tolerance parameters does not hold on held-out traces, where the error of joint{} grows: "
    )
    assert told(1e-3, 4e-3).endswith(warning.format(" 2") + "the model after is not to be used")
    assert warning.format("s 1 and 2") in told(3e-3, 4e-3)
    assert told(2e-3, 2.1e-3) == unexplained(NOWHERE, []), "not by a tenth, nor by more than noise may do"
