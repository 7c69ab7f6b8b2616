"""Potentiometers and converter."""

import itertools
import math
from dataclasses import replace
from statistics import pstdev

import pytest

from mock_controller.board import BoardParameters, default_board
from mock_controller.board.sensor import PositionSensors

PERFECT = replace(default_board(), linearity=0.0, noise=0.0)


def angles(parameters: BoardParameters, counts: float) -> list[float]:
    return [calibration.counts_to_rad(counts) for calibration in parameters.calibrations]


@pytest.mark.parametrize("counts", [0, 1, 1023, 2048, 4095])
def test_perfect_sensor_shows_the_count_its_calibration_names(counts: int) -> None:
    assert PositionSensors(PERFECT, 1).read(angles(PERFECT, counts)) == (counts,) * 6


def test_reading_stops_at_the_converter_ends() -> None:
    sensors = PositionSensors(PERFECT, 1)
    assert sensors.read(angles(PERFECT, -50)) == (0,) * 6
    assert sensors.read(angles(PERFECT, 5000)) == (4095,) * 6


@pytest.mark.parametrize("seed", range(5))
def test_potentiometers_bend_smoothly_within_the_documented_linearity(seed: int) -> None:
    parameters = replace(default_board(), noise=0.0)
    sensors = PositionSensors(parameters, seed)
    grid = range(20, 4076, 4)
    errors = [[read - at for read in sensors.read(angles(parameters, at))] for at in grid]
    for joint in range(6):
        curve = [row[joint] for row in errors]
        largest = max(map(abs, curve))
        assert 0.3 * 0.0025 * 4096 < largest <= math.ceil(0.0025 * 4096)
        assert max(abs(b - a) for a, b in itertools.pairwise(curve)) <= 1


def test_joints_and_seeds_have_curves_of_their_own() -> None:
    parameters = replace(default_board(), noise=0.0)
    grid = range(20, 4076, 200)

    def curves(seed: int) -> list[tuple[int, ...]]:
        sensors = PositionSensors(parameters, seed)
        return list(zip(*(sensors.read(angles(parameters, at)) for at in grid), strict=True))

    assert len(set(curves(1))) == 6
    assert curves(1) == curves(1)
    assert curves(1)[0] != curves(2)[0]


def test_noise_has_the_stated_size() -> None:
    parameters = replace(PERFECT, noise=3.0)
    sensors = PositionSensors(parameters, 1)
    readings = [sensors.read(angles(parameters, 2000.0))[2] for _ in range(2000)]
    assert pstdev(readings) == pytest.approx(math.sqrt(9 + 1 / 12), rel=0.1)


def test_stuck_wiper_stays_and_follows_again_when_repaired() -> None:
    sensors = PositionSensors(PERFECT, 1)
    sensors.read(angles(PERFECT, 1000))
    sensors.stick(2)
    assert sensors.read(angles(PERFECT, 1500)) == (1500, 1000, 1500, 1500, 1500, 1500)
    sensors.repair(2)
    assert sensors.read(angles(PERFECT, 1500)) == (1500,) * 6


def test_fault_of_one_moment_leaves_all_other_noise_as_it_was() -> None:
    def run(faulty: bool) -> list[tuple[int, ...]]:
        sensors = PositionSensors(default_board(), 7)
        seen = []
        for k in range(40):
            if faulty and k == 10:
                sensors.crackle(3, 30.0)
                sensors.stick(1)
            if faulty and k == 20:
                sensors.repair(3)
                sensors.repair(1)
            seen.append(sensors.read(angles(PERFECT, 2000)))
        return seen

    clean, faulty = run(False), run(True)
    assert clean[:10] + clean[20:] == faulty[:10] + faulty[20:]
    assert [row[2] for row in clean[10:20]] != [row[2] for row in faulty[10:20]]
