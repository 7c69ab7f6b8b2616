"""The controller and converters against vectors worked out by hand."""

import numpy as np
import pytest

from daq.contracts.machine import load_machine
from model import layout as at
from model.drives.controller import GAINS, MEMORY, SCALE, D, I, P, board_pid
from model.drives.sensor import reading
from model.machine_model.model import base_model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.simulation.records import ramp_inputs


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
