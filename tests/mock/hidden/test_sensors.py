"""Potentiometers that a seed draws."""

import math

import pytest

from firmware_protocol.units import posture_to_counts
from mock_controller.board.parameters import default_board
from mock_controller.hidden.sensors import RANGE_DEVIATION, TURNED, draw_sensors, truth_of
from tests.mock.host import make_device

STATED = default_board().calibrations


def test_every_seed_draws_sensors_near_the_stated_ones_the_same_each_time() -> None:
    directions = set()
    for seed in range(40):
        sensors = draw_sensors(seed, STATED)
        assert sensors == draw_sensors(seed, STATED)
        for found, stated in zip(sensors, STATED, strict=True):
            assert abs(found.range_rad / stated.range_rad - 1) <= 2 * RANGE_DEVIATION + 1e-12
            assert abs(found.counts_to_rad(2048) - stated.counts_to_rad(2048)) <= TURNED + 1e-12
            directions.add(found.direction)
    assert directions == {-1, 1}


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_an_arm_with_secret_sensors_holds_itself_and_follows_its_set_points(seed: int) -> None:
    board = make_device(secret_sensors=seed, lock_step=True).board
    assert board.parameters.calibrations == draw_sensors(seed, STATED)
    board.run_until(200_000)
    there = board.memory.values("set_point")
    board.write_set_points({1: there[0] + 20})
    board.run_until(2_000_000)
    assert abs(board.memory.values("position")[0] - posture_to_counts(there[0] + 20)) < 12


def test_the_truth_is_told_in_degrees() -> None:
    (first, *_) = draw_sensors(3, STATED)
    assert truth_of([first])[0]["range_deg"] == pytest.approx(math.degrees(first.range_rad), abs=1e-3)
