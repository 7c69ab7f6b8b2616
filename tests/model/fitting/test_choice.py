"""Which parameters a fit changes, how far, and the nuisances it allows for beside them."""

import math

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.quantity import Quantity
from model.fitting.choice import chosen_unknowns, friction_forms, start_postures, with_bends
from model.fitting.options import FitOptions, Prior
from model.fitting.records import records_of
from model.machine_model.model import base_model
from model.record_check.readings import sensor_deviation
from tests.model.fitting.imagined import arm, machine
from tests.model.fitting.test_records import record_of

MASS = FitOptions(parameters=("load.mass",))


def test_by_default_every_number_with_an_expected_deviation_is_found_but_what_fixes_the_scale_of_torque() -> None:
    model = arm()
    chosen = {u.name for u in chosen_unknowns(model, FitOptions())}
    assert chosen == {p.name for p in model.parameters if p.deviation and not p.sets_torque_scale}
    assert not any("torque_constant" in name or "resistance" in name for name in chosen)
    held = {u.name for u in chosen_unknowns(model, FitOptions(held=("joint2.*",)))}
    assert held == {name for name in chosen if not name.startswith("joint2.")}


def test_a_named_parameter_is_found_between_its_bounds_unless_it_is_held() -> None:
    # A parameter that is named is found between its own bounds about its expected value
    (mass,) = chosen_unknowns(arm(), MASS)
    own = arm().parameter("load.mass")
    assert (mass.start, mass.low, mass.high) == (own.value, own.low, own.high)
    assert (mass.expected, mass.deviation, mass.nuisance) == (own.value, own.deviation, False)
    # What is held is held even where it is named
    both = FitOptions(parameters=("load.mass", "joint2.motor.*"), held=("joint2.motor.resistance",))
    names = {u.name for u in chosen_unknowns(arm(), both)}
    assert "load.mass" in names
    assert "joint2.motor.resistance" not in names
    assert "joint2.motor.torque_constant" in names, "named, it is found though it fixes the scale of torque"
    # Its expected deviation is zero
    load = machine().load
    model = base_model(machine().model_copy(update={"load": load.model_copy(update={"deviation": 0.0})}))
    assert model.parameter("load.mass").deviation == 0.0
    assert "load.mass" in {u.name for u in chosen_unknowns(arm(), FitOptions())}
    assert "load.mass" not in {u.name for u in chosen_unknowns(model, FitOptions())}
    (mass,) = chosen_unknowns(model, MASS)
    assert mass.deviation is None, "nothing is expected of it"


def test_bounds_and_priors_may_be_left_out_or_be_all_that_is_possible() -> None:
    value = arm().parameter("load.mass").value
    bounded = MASS.model_copy(update={"bounds": {"load.mass": (value - 0.1, None)}})
    (mass,) = chosen_unknowns(arm(), bounded)
    assert (mass.low, mass.high) == (value - 0.1, math.inf)
    other = MASS.model_copy(update={"priors": {"load.mass": Prior(expected=0.7, deviation=0.02)}})
    (mass,) = chosen_unknowns(arm(), other)
    assert (mass.start, mass.expected, mass.deviation) == (value, 0.7, 0.02)
    (mass,) = chosen_unknowns(arm(), MASS.model_copy(update={"use_priors": False}))
    assert mass.deviation is None
    with pytest.raises(SpecError, match="nothing to fit"):
        chosen_unknowns(arm(), FitOptions(held=("*",)))
    (mass,) = chosen_unknowns(arm(), MASS.model_copy(update={"bounds": {"load.mass": (0.0, None)}}))
    assert (mass.low, mass.high) == (0.0, math.inf)


@pytest.mark.parametrize(
    ("bounds", "says"),
    [
        ((1.0, 1.0), "lower bound 1 kg is not below the upper bound 1 kg"),
        ((-0.001, 2.0), "bounds -0.001 to 2 kg exceed the physical limits, 0 to inf"),
        ((None, 2.0), "bounds -inf to 2 kg exceed the physical limits, 0 to inf"),
    ],
)
def test_bounds_are_in_order_and_within_what_is_possible(bounds: tuple[float | None, float], says: str) -> None:
    with pytest.raises(SpecError, match=says):
        chosen_unknowns(arm(), MASS.model_copy(update={"bounds": {"load.mass": bounds}}))


def test_a_prior_may_be_taken_away_and_expectations_are_the_machine_s_and_not_the_model_s() -> None:
    (mass,) = chosen_unknowns(arm(), MASS.model_copy(update={"priors": {"load.mass": None}}))
    assert mass.deviation is None
    heavier = arm().with_values({"load.mass": 2.0})
    (mass,) = chosen_unknowns(heavier, MASS)
    assert (mass.start, mass.expected) == (2.0, arm().parameter("load.mass").value)
    free = MASS.model_copy(update={"use_priors": False, "priors": {"load.mass": Prior(expected=1.0, deviation=0.1)}})
    (mass,) = chosen_unknowns(arm(), free)
    assert (mass.expected, mass.deviation) == (1.0, 0.1), "a prior that is given counts all the same"


def test_a_potentiometer_that_is_bent_already_is_bent_no_second_time() -> None:
    bent = arm().with_effect("potentiometer_nonlinearity", (2,), {"bend_1": 0.01})
    model, bends = with_bends(bent, FitOptions(sensor_bend=True, bend_terms=3), "position")
    assert [u.joints for u in bends] == [(1,)] * 3 + [(3,)] * 3
    assert model.parameter("joint2.potentiometer_nonlinearity.bend_1").value == 0.01
    assert [u.parameter.part for u in bends[:3]] == ["bend_1", "bend_2", "bend_3"]


def test_by_itself_a_fit_bends_the_potentiometers_whose_machine_states_a_linearity() -> None:
    own = machine()

    def bent(*joints: int) -> set[int]:
        sensors = {j: own.joint(j).sensor for j in (1, 2, 3)}
        made = [
            joint.model_copy(
                update={
                    "sensor": sensors[number].model_copy(  # type: ignore[union-attr]
                        update={"linearity": Quantity(value=0.01, unit="1", source="t") if number in joints else None}
                    )
                }
            )
            if number in sensors
            else joint
            for number, joint in enumerate(own.joints, start=1)
        ]
        model = base_model(own.model_copy(update={"joints": tuple(made)}))
        return {joint for u in with_bends(model, FitOptions(), "position")[1] for joint in u.joints}

    assert bent() == set()
    assert bent(2) == {2}
    assert bent(1, 3) == {1, 3}


def test_potentiometers_bend_as_far_as_their_stated_linearity_lets_expect() -> None:
    model, bends = with_bends(arm(), FitOptions(sensor_bend=True, bend_terms=2), "position")
    assert len(bends) == 6
    assert {u.joints for u in bends} == {(1,), (2,), (3,)}
    for joint in (1, 2, 3):
        sensor = machine().joint(joint).sensor
        size = 0.0025 if sensor.linearity is None else sensor.linearity.value
        first, second = [u for u in bends if u.joints == (joint,)]
        assert first.deviation == pytest.approx(0.5 * size * sensor.range.value)
        assert second.deviation == pytest.approx(first.deviation / 2)
    assert all((u.start, u.expected, u.nuisance, u.trace) == (0.0, 0.0, True, None) for u in bends)
    assert model != arm()


@pytest.mark.parametrize(("bend", "signal"), [(False, "position"), (True, "velocity"), (None, "velocity")])
def test_no_potentiometer_bends_where_none_is_asked_for_or_none_is_read(bend: bool | None, signal: str) -> None:
    assert with_bends(arm(), FitOptions(sensor_bend=bend), signal) == (arm(), ())  # type: ignore[arg-type]


def test_the_arm_may_start_off_the_posture_that_was_read_by_the_sensor_s_error() -> None:
    records = records_of([record_of(list(range(100)))], machine(), "position") * 2
    found = start_postures(machine(), records, bends=False)
    assert [(u.trace, u.joints) for u in found] == [(t, (j,)) for t in (0, 1) for j in (1, 2, 3)]
    sensor = machine().joint(1).sensor
    assert found[0].deviation == pytest.approx(max(sensor_deviation(sensor), sensor.count))
    assert (found[0].low, found[0].high) == pytest.approx((-20 * found[0].deviation, 20 * found[0].deviation))
    assert all((u.start, u.expected, u.nuisance) == (0.0, 0.0, True) for u in found)
    bent = start_postures(machine(), records, bends=True)[0].deviation
    linearity = 0.0 if sensor.linearity is None else sensor.linearity.value
    assert bent == pytest.approx(np.hypot(found[0].deviation, linearity * sensor.range.value))


def test_friction_may_build_up_otherwise_in_each_joint_that_has_some() -> None:
    found = friction_forms(arm())
    assert [u.joints for u in found] == [(j,) for j in (1, 2, 3) for _ in range(2)]
    for distance, shape in zip(found[::2], found[1::2], strict=True):
        assert distance.deviation == pytest.approx(0.5 * distance.start)
        assert (distance.low, distance.high) == pytest.approx((0.05 * distance.start, 10 * distance.start))
        assert distance.expected == distance.start > 0
        assert (shape.start, shape.low, shape.high, shape.expected, shape.deviation) == (0.5, 0.0, 1.0, 0.5, 0.5)
        assert distance.nuisance
        assert shape.nuisance
    plain = arm()
    frictionless = type(plain)(machine=plain.machine, effects=())
    assert friction_forms(frictionless) == ()
