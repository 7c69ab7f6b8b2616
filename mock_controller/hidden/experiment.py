"""An experiment for a hidden arm, and the readings of an arm that follows it, as real numbers."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firmware_protocol.memory_map import JOINTS
from firmware_protocol.units import DAC_MAX, GAIN_MAX, POSTURE_UNITS, JointCalibration, posture_to_counts
from mock_controller.board.extension_points import ChangesBoard, ChangesSetPoint
from mock_controller.board.parameters import BoardParameters
from mock_controller.board.sensor import PositionSensors
from mock_controller.modification import Modification, of_kind
from mock_controller.plant import STEP_US, Plant, PlantParameters

Gains = tuple[int, int, int]
_COLUMNS = [f"set_point_{joint}" for joint in range(1, JOINTS + 1)]


class ExperimentError(ValueError):
    """An experiment that cannot be carried out."""


@dataclass(frozen=True)
class Experiment:
    """Set points (posture units, six per period) that follow `settle` periods at the first of them.

    `gains`: P, I, D of every joint.
    """

    set_points: tuple[tuple[int, ...], ...]
    gains: Gains = (2, 0, 0)
    settle: int = 50

    def __post_init__(self) -> None:
        if len(self.set_points) < 2:
            raise ExperimentError(f"{len(self.set_points)} periods: at least 2 are needed")
        for number, row in enumerate(self.set_points, start=1):
            if len(row) != JOINTS or not all(0 <= posture < POSTURE_UNITS for posture in row):
                raise ExperimentError(
                    f"period {number}: set points {row}: must be {JOINTS} from 0 to {POSTURE_UNITS - 1}"
                )
        if len(self.gains) != 3 or not all(0 <= gain <= GAIN_MAX for gain in self.gains):
            raise ExperimentError(f"gains {self.gains}: must be three from 0 to {GAIN_MAX}")

    def start_angles(self, calibrations: Iterable[JointCalibration]) -> list[float]:
        """Angles (rad) of the first set points."""
        pairs = zip(calibrations, self.set_points[0], strict=True)
        return [scale.posture_to_rad(posture) for scale, posture in pairs]


def read_experiment(path: Path) -> Experiment:
    """Reads an experiment from CSV: one line per period, columns set_point_1 … set_point_6 (posture units).

    Raises ExperimentError with one clear line.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            missing = [column for column in _COLUMNS if column not in (reader.fieldnames or ())]
            if missing:
                raise ExperimentError(f"{path}: no column {missing[0]}; needed are {', '.join(_COLUMNS)}")
            rows = tuple(tuple(int(row[column]) for column in _COLUMNS) for row in reader)
    except OSError as error:
        raise ExperimentError(f"{path}: {error.strerror}") from None
    except (TypeError, ValueError) as error:
        if isinstance(error, ExperimentError):
            raise
        raise ExperimentError(f"{path}: not whole posture units: {error}") from None
    return Experiment(rows)


# --- The control loop without rounding: an arm's readings as real numbers
#
# Positions, errors and drive are real numbers here. Instead of rounding, each reading carries noise of the same size,
# drawn from a seed: the converter's own and that of a rounding error, uniform over one count. With the same noise, the
# readings of two arms differ only by the difference of the arms, and neither comes to rest where rounding would have
# kept it moving.


ROUNDING_VARIANCE = 1.0 / 12.0
"""Variance (counts²) of a rounding error that is uniform over one count."""


@dataclass(frozen=True)
class LoopParts:
    """The parts of a control loop; `arm_seed` draws the potentiometers' curves."""

    plant: PlantParameters
    board: BoardParameters
    modifications: tuple[Modification, ...]
    arm_seed: int


def reading_deviation(board: BoardParameters) -> float:
    """Returns the standard deviation (counts) of a reading: the converter's noise and its rounding."""
    return float(np.sqrt(board.noise**2 + ROUNDING_VARIANCE))


class _SmoothPid:
    """The controller's law in real numbers."""

    def __init__(self, gains: tuple[int, int, int], shift: int, scale: float) -> None:
        self._gains = gains
        self._scale = scale
        self._unit = float(1 << shift)
        self._sum = 0.0
        self._previous: float | None = None
        self._power = 0.0

    def update(self, error: float) -> float:
        """Returns the power (DAC counts) for this period's error (ADC counts)."""
        p, i, d = self._gains
        if i and self._power * error < DAC_MAX * abs(error):
            limit = DAC_MAX * self._unit
            self._sum = min(max(self._sum + i * error, -limit), limit)
        change = 0.0 if self._previous is None else error - self._previous
        self._previous = error
        power = self._scale * (p * error + self._sum / self._unit + d * change)
        self._power = min(max(power, -DAC_MAX), DAC_MAX)
        return self._power


def readings(
    parts: LoopParts, experiment: Experiment, noise_seed: int = 0, step_us: int = STEP_US
) -> NDArray[np.float64]:
    """Returns readings (counts, one row per period, joints 1 to 6) of the experiment, without the settling before
    it."""
    board = parts.board
    for change in of_kind(parts.modifications, ChangesBoard):
        board = change.change_board(board)
    plant = Plant(parts.plant, parts.modifications, experiment.start_angles(board.calibrations), step_us)
    sensors = PositionSensors(board, 0, parts.modifications, parts.arm_seed)
    set_point_effects: list[ChangesSetPoint] = of_kind(parts.modifications, ChangesSetPoint)
    pids = [_SmoothPid(experiment.gains, board.integral_shift, scale) for scale in board.controller_scales]
    scales = [scale.direction * board.dac_full_scale / DAC_MAX for scale in board.calibrations]
    delay, period = board.timing.computing_delay, board.timing.period
    rows: Sequence[tuple[int, ...]] = (experiment.set_points[0],) * experiment.settle + experiment.set_points
    noise = np.random.default_rng(noise_seed).normal(0.0, reading_deviation(board), (len(rows), JOINTS)).tolist()
    seen = np.empty((len(rows), JOINTS))
    volts = [0.0] * JOINTS
    for tick, (postures, extra) in enumerate(zip(rows, noise, strict=True), start=1):
        measured = sensors.unrounded(plant.joint_angles, extra)
        seen[tick - 1] = measured
        targets = [posture_to_counts(posture) for posture in postures]
        for effect in set_point_effects:
            targets[effect.joint - 1] = effect.set_point(targets[effect.joint - 1], tick)
        plant.advance(volts, delay)
        volts = [
            scale * pid.update(target - counts)
            for scale, pid, target, counts in zip(scales, pids, targets, measured, strict=True)
        ]
        plant.advance(volts, period - delay)
    return seen[experiment.settle :]
