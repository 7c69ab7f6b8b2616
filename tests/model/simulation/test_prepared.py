"""A record in the units of compiled code, and exact derivatives against wide finite differences."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import Machine, load_machine, parse_machine
from daq.contracts.trace import Trace
from model import layout as at
from model.arrays import Floats
from model.drives import controller as pid
from model.dynamics.wide_numbers import WIDTH
from model.machine_model.model import base_model
from model.machine_model.parameter import initial_position
from model.simulation.inputs import inputs_of
from model.simulation.prepared import Options, Prepared, prepare
from model.simulation.simulate import sensitivities, simulate
from tests.model.simulation.machines import SLIDE, pendulum, slide
from tests.model.simulation.records import ramp_inputs, trace_of

MA2000 = load_machine("ma2000")
START = np.array([3.1, 0.7, 0.0])


def still(count: int = 60, **signals: Floats) -> Trace:
    """Set points at a posture of the MA2000, or the signals given."""
    return trace_of(np.tile(START, (count, 1)), **signals)


def prepared(machine: Machine, trace: Trace, **options: object) -> Prepared:
    return prepare(base_model(machine), inputs_of(trace, machine), Options(**options))  # type: ignore[arg-type]


# ---- set points and settings


def test_set_points_are_whole_posture_units_or_counts_of_the_sensor() -> None:
    # The board takes set points in whole posture units and those in whole counts
    unit = 1.5 * np.pi / 1000
    low = MA2000.calibration(1).posture_to_rad(0)
    wanted = np.tile(START, (4, 1))
    wanted[:, 0] = low + unit * np.array([500.0, 500.49, 500.51, 501.0])
    found = prepared(MA2000, trace_of(wanted))
    assert found.set_points[:, 0].tolist() == [2048.0, 2048.0, 2052.0, 2052.0]  # 2048 and 2052.096
    assert found.settings[at.CONTROLLER] == at.BOARD_PID
    assert found.settings[at.PUBLISHED_LOADS] == 1
    assert found.settings[at.DRIVE_RECORDED] == 0
    assert found.period == 0.02
    # A board with a finer sensor counts in its own counts
    first = MA2000.joints[0]
    finer = first.model_copy(update={"sensor": first.sensor.model_copy(update={"bits": 14})})
    machine = MA2000.model_copy(update={"joints": (finer, *MA2000.joints[1:])})
    wanted = np.tile(START, (4, 1))
    wanted[:, 0] = machine.calibration(1).posture_to_rad(501)
    found = prepare(base_model(machine), inputs_of(trace_of(wanted), machine), Options())
    assert found.set_points[0, 0] == round(501 * 2**14 / 1000)


def test_set_points_that_are_whole_counts_are_what_a_board_has_worked_with() -> None:
    own = MA2000.calibration(1)
    wanted = np.tile(START, (40, 1))
    for k, joint in enumerate(MA2000.modelled_joints):
        calibration = MA2000.calibration(joint)
        wanted[:, k] = calibration.counts_to_rad(round(calibration.rad_to_counts(wanted[0, k])))
    counts = 2048.0 + np.arange(40.0)
    wanted[:, 0] = [own.counts_to_rad(c) for c in counts]
    assert prepared(MA2000, trace_of(wanted)).set_points[:, 0].tolist() == counts.tolist()
    between = wanted.copy()
    between[7, 0] += 0.3 * own.rad_per_count
    assert prepared(MA2000, trace_of(between)).set_points[:, 0].tolist() != counts.tolist(), "as planned, not as taken"


def test_a_sampled_controller_rounds_set_points_to_its_own_step_half_up() -> None:
    text = SLIDE.replace(
        "gains = [[4.0", 'set_point_resolution = { value = 0.01, unit = "m", source = "t" }\ngains = [[4.0'
    )
    wanted = np.array([[0.004], [0.006], [0.016], [-0.004]])
    found = prepared(parse_machine(text), trace_of(wanted, 0.01))
    np.testing.assert_allclose(found.set_points[:, 0], [0.0, 0.01, 0.02, 0.0], atol=1e-12)
    assert found.settings[at.CONTROLLER] == at.CASCADE
    assert found.settings[at.PUBLISHED_LOADS] == 0
    plain = prepared(slide(), trace_of(wanted, 0.01))
    np.testing.assert_array_equal(plain.set_points, wanted)
    single = parse_machine(SLIDE.replace("velocity_gains = [[40.0, 0.0, 0.0]]\n", ""))
    assert prepared(single, trace_of(wanted, 0.01)).settings[at.CONTROLLER] == at.SAMPLED_PID


def test_without_a_controller_and_in_open_loop_nothing_controls() -> None:
    numbers = np.ones((60, 3))
    assert prepared(MA2000, still(drive=numbers), loop="open").settings[at.CONTROLLER] == at.NO_CONTROLLER
    np.testing.assert_array_equal(prepared(MA2000, still(drive=numbers), loop="open").set_points[0], START)
    swing = trace_of(np.zeros((60, 1)), 0.01, drive=np.ones((60, 1)))
    assert prepared(pendulum(), swing, recorded_drive=True).settings[at.DRIVE_RECORDED] == 0
    driven = prepared(MA2000, still(drive=numbers), recorded_drive=True)
    assert driven.settings[at.DRIVE_RECORDED] == 1
    assert driven.with_setting(at.DRIVE_RECORDED, 0).settings[at.DRIVE_RECORDED] == 0
    assert driven.settings[at.DRIVE_RECORDED] == 1, "the first is left as it was"


# ---- gains


def test_gains_and_period_are_the_record_s_else_the_machine_s() -> None:
    # Gains are the record's own else the machine s
    controller = MA2000.controller
    record = still().record.model_copy(update={"gains": {2: (7, 3, 1)}})
    found = inputs_of(replace(still(), record=record), MA2000).gains
    assert found.shape == (3, pid.GAINS)
    assert found[1, [pid.P, pid.I, pid.D]].tolist() == [7, 3, 1]
    for row in (0, 2):
        assert found[row, [pid.P, pid.I, pid.D]].tolist() == list(controller.gains[row])  # type: ignore[union-attr]
    assert (found[:, pid.SCALE] == controller.dac_counts_per_adc_count.value).all()  # type: ignore[union-attr]
    assert not found[:, [pid.INNER_P, pid.INNER_I, pid.INNER_D, pid.RESOLUTION]].any()

    # The period is the record's else the controller's else that of the samples
    def period(machine: Machine, joints: int, **signals: Floats) -> float:
        made = trace_of(np.zeros((60, joints)), 0.03, **signals)
        record = made.record.model_copy(update={"period": None})
        return inputs_of(replace(made, record=record, tick=None), machine).period

    assert inputs_of(trace_of(np.zeros((60, 1)), 0.03), slide()).period == 0.03
    assert period(slide(), 1) == 0.01
    assert period(pendulum(), 1, drive=np.ones((60, 1))) == pytest.approx(0.03)


def test_a_cascade_has_gains_of_its_inner_loop_and_a_step_of_its_drive() -> None:
    text = SLIDE.replace("gains = [[4.0, 0.0", "gains = [[4.0, 0.5").replace("[[40.0, 0.0, 0.0]]", "[[40.0, 2.0, 1.0]]")
    own = text.replace(
        "gains = [[4.0", 'drive_resolution = { value = 0.125, unit = "V", source = "t" }\ngains = [[4.0', 1
    )
    trace = trace_of(np.zeros((60, 1)), 0.01)
    (found,) = inputs_of(trace, parse_machine(own)).gains
    assert found[[pid.P, pid.I, pid.D]].tolist() == [4.0, 0.5, 0.0]
    assert found[[pid.INNER_P, pid.INNER_I, pid.INNER_D]].tolist() == [40.0, 2.0, 1.0]
    assert found[pid.RESOLUTION] == 0.125
    assert inputs_of(trace, parse_machine(text)).gains[0, pid.RESOLUTION] == 0.0
    swing = trace_of(np.zeros((60, 1)), 0.01, drive=np.ones((60, 1)))
    assert not inputs_of(swing, pendulum()).gains.any()


# ---- the grid of periods, and the start


@pytest.mark.parametrize(("angle", "allowed"), [(20.0, True), (20.001, False), (-20.001, False)])
def test_angles_of_more_than_20_rad_are_taken_for_degrees(angle: float, allowed: bool) -> None:
    position = np.tile(START, (60, 1))
    position[30, 1] = angle
    if allowed:
        assert len(inputs_of(still(position=position), MA2000)) == 60
    else:
        with pytest.raises(
            TraceError, match=r"joint 2 reaches 20 rad; are these degrees\? angles must be in rad, up to 20"
        ):
            inputs_of(still(position=position), MA2000)


def test_a_carriage_and_a_shaft_may_go_further_and_nothing_moves_without_drive() -> None:
    far = np.full((60, 1), 25.0)
    assert len(inputs_of(trace_of(np.zeros((60, 1)), 0.01, position=far), slide())) == 60
    assert len(inputs_of(trace_of(np.zeros((60, 1)), 0.01, position=far, drive=far), pendulum())) == 60
    with pytest.raises(TraceError, match="has no drive, and pendulum has no controller that could compute it"):
        inputs_of(trace_of(np.zeros((60, 1)), 0.01), pendulum())
    inputs = replace(inputs_of(still(), MA2000), joints=(1, 2))
    with pytest.raises(SpecError, match=r"inputs are for joints \(1, 2\), but the model moves joints \(1, 2, 3\)"):
        prepare(base_model(MA2000), inputs, Options())


COUNT = 1.5 * np.pi / 4096


@pytest.mark.parametrize(
    ("readings", "moves_at", "start"),
    [
        ([1.0, 0.0, 1.0, 0.0], 4, 0.5),
        ([1.0, 0.0, 1.0, 0.0], 3, 2 / 3),
        ([0.0, 1.9, 1.9, 9.0], 50, 3.8 / 3),
        ([0.0, 2.1, 0.0, 0.0], 50, 0.0),
        ([0.0, -2.1, 0.0, 0.0], 50, 0.0),
        ([1.0] * 24 + [0.0] * 26, 50, 24 / 25),
    ],
    ids=["rest", "until it moves", "until it is led away", "two counts", "two counts below", "25 readings"],
)
def test_the_arm_begins_at_the_mean_of_what_it_read_at_rest(readings: list[float], moves_at: int, start: float) -> None:
    position = np.tile(START, (60, 1))
    position[: len(readings), 0] += COUNT * np.array(readings)
    points = np.tile(START, (60, 1))
    points[moves_at:] += 0.1
    found = inputs_of(trace_of(points, position=position), MA2000)
    assert (found.initial[0, 0] - START[0]) / COUNT == pytest.approx(start)
    assert found.initial[:, 1].tolist() == [0.0, 0.0, 0.0]


# ---- derivatives


@pytest.mark.parametrize("general", [False, True], ids=["closed form", "recursive"])
def test_derivatives_that_a_run_carries_together_are_those_that_it_carries_alone(general: bool) -> None:
    model = base_model(MA2000).with_effect("joint_compliance", (1,), {"compliance": 1e-3})
    free = [model.parameter(name) for name in CASES] + [initial_position(j) for j in (1, 2, 3)]
    assert len(free) > WIDTH
    options = Options(general=general)
    inputs = ramp_inputs(model.machine, duration=0.6)
    together = sensitivities(model, inputs, free, options)
    for parameter, slope in zip(free, together.jacobian, strict=True):
        alone = sensitivities(model, inputs, [parameter], options)
        np.testing.assert_array_equal(alone.jacobian[0], slope)
        assert np.abs(slope).max() > 0
    assert together.simulation.position == pytest.approx(
        simulate(model, inputs, replace(options, quantise=False)).position, abs=1e-12
    )


# ---- Exact derivatives against wide finite differences of the same loop without rounding

SMOOTH = Options(quantise=False, step=2.5e-4)

CASES = {
    "load.mass": 1e-3,
    "link3.length": 1e-4,
    "joint2.motor.back_emf_constant": 1e-5,
    "joint2.viscous_friction.coefficient": 1e-6,
    "joint3.load_dependent_friction.arm": 1e-4,
    "controller.delay": 2e-4,
}


@pytest.mark.parametrize("name", CASES)
def test_dual_numbers_give_the_slope_of_finite_differences(name: str) -> None:
    model = base_model(load_machine("ma2000"))
    inputs = ramp_inputs(model.machine)
    exact = sensitivities(model, inputs, [model.parameter(name)], SMOOTH).reading[0]
    value, width = model.parameter(name).value, CASES[name]
    ends = [simulate(model.with_values({name: value + w}), inputs, SMOOTH).reading for w in (-width, width)]
    difference = (ends[1] - ends[0]) / (2 * width)
    assert np.abs(exact).max() > 0
    assert np.abs(exact - difference).max() < 0.01 * np.abs(exact).max()


def test_effects_at_their_null_value_have_derivatives_too() -> None:
    model = base_model(load_machine("ma2000")).with_effect("spring_torque", (2,)).with_effect("input_delay", (3,))
    spring, delay = model.parameter("joint2.spring_torque.stiffness"), model.parameter("joint3.input_delay.time")
    inputs = ramp_inputs(model.machine)
    found = sensitivities(model, inputs, [spring, delay, initial_position(1)], SMOOTH)
    stiffer = simulate(model.with_values({spring.name: 0.05}), inputs, SMOOTH).reading
    slope = (stiffer - found.simulation.reading) / 0.05
    assert np.abs(found.reading[0] - slope).max() < 0.02 * np.abs(slope).max()
    assert np.abs(found.reading[1][:, 2]).max() > 10 * np.abs(found.reading[1][:, 0]).max()
    assert found.reading[2][0] == pytest.approx([1.0, 0.0, 0.0])


@pytest.mark.parametrize("general", [False, True], ids=["closed form", "recursive"])
def test_friction_under_gravity_has_its_derivative_where_there_is_none_yet(general: bool) -> None:
    """The term is left out at a share of zero; a dual part alone is enough to have it."""
    options = Options(quantise=False, step=2.5e-4, general=general)
    model = base_model(load_machine("ma2000")).with_effect("gravity_torque_friction", (2, 3))
    shares = [model.parameter(f"joint{j}.gravity_torque_friction.share") for j in (2, 3)]
    inputs = ramp_inputs(model.machine)
    found = sensitivities(model, inputs, shares, options)
    for share, slope in zip(shares, found.reading, strict=True):
        more = simulate(model.with_values({share.name: 1e-4}), inputs, options).reading
        difference = (more - found.simulation.reading) / 1e-4
        assert np.abs(slope).max() > 1e-3
        assert np.abs(slope - difference).max() < 0.02 * np.abs(slope).max()
