"""What must hold of any mechanics: energy, periods, Newton's law, work; on one joint and on three."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipk

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from model import layout as at
from model.drives.controller import GAINS, MEMORY, SCALE, D, I, P, board_pid
from model.drives.sensor import reading
from model.machine_model.model import base_model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.simulation.machines import pendulum, slide
from tests.model.simulation.records import ramp_inputs, ramp_trace, trace_of


def test_a_pendulum_swings_with_the_period_of_its_elliptic_integral() -> None:
    amplitude = 1.2
    model = base_model(pendulum())
    start = np.array([[-np.pi / 2 + amplitude, 0.0]])
    trace = trace_of(np.zeros((600, 1)), 0.01, drive=np.zeros((600, 1)))
    swing = simulate(model, trace, Options(loop="open", initial=start)).position[:, 0] + np.pi / 2
    down = np.flatnonzero((swing[:-1] > 0) & (swing[1:] <= 0))
    crossings = 0.01 * (down + swing[down] / (swing[down] - swing[down + 1]))
    period = 4 * np.sqrt(2 * 0.5 / (3 * 9.81)) * ellipk(np.sin(amplitude / 2) ** 2)
    assert np.diff(crossings).mean() == pytest.approx(period, rel=1e-4)


def test_a_record_of_drive_alone_is_repeated_in_open_loop() -> None:
    machine = load_machine("ma2000")
    model = base_model(machine)
    closed = simulate(model, ramp_trace(machine), Options(quantise=False))
    ramp = ramp_trace(machine)
    driven = replace(ramp, drive=closed.drive)
    alone = replace(driven, set_point=None)
    opened = simulate(model, alone, Options(loop="open", quantise=False))
    np.testing.assert_array_equal(
        opened.position, simulate(model, driven, Options(loop="open", quantise=False)).position
    )
    np.testing.assert_allclose(opened.position, closed.position, atol=1e-5)  # the drive before the record differs


def test_a_carriage_obeys_newton_and_its_friction() -> None:
    model = base_model(slide())
    drive = np.full((100, 1), 2.0)
    trace = trace_of(np.zeros((100, 1)), 0.01, drive=drive)
    free = simulate(model, trace, Options(loop="open", quantise=False))
    assert free.velocity[-1, 0] == pytest.approx(1.5 * 2.0 / 2.5 * 0.99, rel=1e-9)
    rubbed = simulate(
        model.with_effect("coulomb_friction", (1,), {"torque": 1.0}), trace, Options(loop="open", quantise=False)
    )
    assert rubbed.velocity[-1, 0] == pytest.approx((3.0 - 1.0) / 2.5 * 0.99, rel=1e-2)
    held = simulate(
        model.with_effect("coulomb_friction", (1,), {"torque": 4.0}), trace, Options(loop="open", quantise=False)
    )
    assert np.abs(held.position).max() < 2e-5  # within the distance over which friction builds up
    assert model.with_effect("coulomb_friction", (1,)).parameter("joint1.coulomb_friction.torque").unit == "N"


def test_a_cascade_brings_the_carriage_to_its_set_point() -> None:
    model = base_model(slide())
    wanted = np.full((200, 1), 0.1)
    trace = trace_of(wanted, 0.01, position=np.zeros((200, 1)))
    run = simulate(model, trace)
    assert run.position[-1, 0] == pytest.approx(0.1, abs=1e-4)
    assert run.position[:, 0].max() < 0.102


def test_an_unstable_loop_is_said_to_be_one() -> None:
    model = base_model(pendulum()).with_effect("spring_torque", (1,), {"stiffness": -9.0})
    trace = trace_of(np.zeros((3000, 1)), 0.01, drive=np.zeros((3000, 1)))
    with pytest.raises(SpecError, match="does not stay finite"):
        simulate(model, trace)


# ---- The controller and converters against vectors worked out by hand.


def row(joint: int) -> np.ndarray:
    vector = base_model(load_machine("ma2000")).vector
    return vector[at.slot(joint, 0) : at.slot(joint + 1, 0)].copy()


@pytest.mark.parametrize(
    ("gains", "errors", "powers"),
    [
        ((2, 0, 0), (0, 3, -5, 63, 64, -200), (0, 6, -10, 126, 127, -127)),
        # sum before each period: 0, 20, 40, 60, 80 → 0, 0, 0, 0, 1 after the division by 64
        ((1, 2, 0), (10, 10, 10, 10, 10), (10, 10, 10, 10, 11)),
        # a negative sum is divided towards minus infinity: −2 / 64 → −1
        ((1, 2, 0), (-1, -1), (-1, -2)),
        ((1, 0, 3), (4, 6, 1), (4, 12, -14)),
    ],
)
def test_integer_pid(gains: tuple[int, int, int], errors: tuple[int, ...], powers: tuple[int, ...]) -> None:
    own, memory = np.zeros(GAINS), np.zeros(MEMORY)
    own[[P, I, D]], own[SCALE] = gains, 1.0
    memory[1] = errors[0]
    assert [board_pid(float(e), own, row(1), True, memory) for e in errors] == list(powers)


def test_the_sum_does_not_grow_further_into_a_limit_that_is_reached() -> None:
    own, memory = np.zeros(GAINS), np.zeros(MEMORY)
    own[[P, I]], own[SCALE] = (2.0, 1.0), 1.0
    for _ in range(5):
        assert board_pid(100.0, own, row(1), True, memory) == 127.0
    assert memory[0] == 0.0
    assert board_pid(-10.0, own, row(1), True, memory) == -20.0


def test_readings_round_half_up_to_counts() -> None:
    joint = row(3)
    angle = joint[at.AT_ZERO] + joint[at.RAD_PER_COUNT] * np.array([2047.4, 2047.5, 2048.0])
    assert [reading(float(a), 0.0, True, joint) for a in angle] == [2047.0, 2048.0, 2048.0]
    assert reading(float(angle[0]), 0.0, False, joint) == pytest.approx(2047.4)


def test_power_is_the_gain_times_the_error_of_the_same_period() -> None:
    model = base_model(load_machine("ma2000"))
    run = simulate(model, ramp_inputs(model.machine))
    counts = run.error / [model.machine.calibration(j).rad_per_count for j in (1, 2, 3)]
    assert np.abs(counts - np.round(counts)).max() < 1e-6
    assert np.array_equal(run.power, np.clip(2 * np.round(counts), -127, 127))
    assert np.abs(run.drive - run.power * 36 / 127).max() < 1e-12


def test_static_error_falls_with_the_gain() -> None:
    machine = load_machine("ma2000")
    model = base_model(machine, friction=False)
    inputs = ramp_inputs(machine, duration=3.0)
    errors = []
    for gain in (1.0, 2.0):
        inputs.gains[:, P] = gain
        errors.append(simulate(model, inputs, Options(quantise=False)).error[-1])
    assert errors[0][1:] == pytest.approx(2 * errors[1][1:], rel=0.05)  # the posture differs a little
    assert abs(errors[1][1]) > 1e-4
