"""An experiment for a hidden arm: a set point for every joint in every period."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from firmware_protocol.memory_map import JOINTS
from firmware_protocol.units import GAIN_MAX, POSTURE_UNITS, JointCalibration

Gains = tuple[int, int, int]
_COLUMNS = [f"set_point_{joint}" for joint in range(1, JOINTS + 1)]
_REST = (500, 333, 500, 500, 500, 500)


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


def read_experiment(path: Path, gains: Gains = (2, 0, 0)) -> Experiment:
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
    return Experiment(rows, gains)


class _Path:
    """Builds set points of joints 1 to 3 from moves, in 20 ms periods."""

    def __init__(self) -> None:
        self.rows: list[list[float]] = []
        self._now = [float(value) for value in _REST[:3]]

    def hold(self, seconds: float) -> None:
        self.rows += [list(self._now)] * round(seconds * 50)

    def move(self, by: tuple[float, float, float], seconds: float) -> None:
        """Adds a straight ramp by so many posture units."""
        periods = max(round(seconds * 50), 1)
        start = list(self._now)
        for k in range(1, periods + 1):
            self._now = [a + b * k / periods for a, b in zip(start, by, strict=True)]
            self.rows.append(list(self._now))

    def finished(self) -> Experiment:
        return Experiment(tuple((*(math.floor(v + 0.5) for v in row), *_REST[3:]) for row in self.rows))


def ramp_step() -> Experiment:
    """Returns 8 s: the source's ramp (80 posture units in 0.65 s, joints 1 to 3 together), held, and back."""
    path = _Path()
    path.hold(0.5)
    path.move((80, 80, 80), 0.65)
    path.hold(3.0)
    path.move((-80, -80, -80), 0.65)
    path.hold(3.2)
    return path.finished()


def reference_set() -> Experiment:
    """Returns 55 s: one joint at a time, slow reversals, a staircase, fast moves of many sizes, and a second
    posture."""
    path = _Path()
    path.hold(0.5)
    for joint in range(3):  # one at a time, there and back
        for way in (1, -1):
            path.move((80.0 * way * (joint == 0), 80.0 * way * (joint == 1), 80.0 * way * (joint == 2)), 0.65)
            path.hold(0.75)
    for ratio in ((1.0, 0.6, -0.8), (-0.7, 1.0, 0.9)):  # slow reversals, 2 to 5 °/s
        for way, units, seconds in ((1, 40, 2.0), (-1, 55, 3.5)):
            a, b, c = (way * units * share for share in ratio)
            path.move((a, b, c), seconds)
            path.move((-0.5 * a, -0.5 * b, -0.5 * c), 0.5 * seconds)
    for units in (1, 2, 4, 8, 11, -1, -3, -6, -10, -5):  # staircase of 0.3° to 3°
        path.move((units, units, -units), 0.02)
        path.hold(0.8)
    for units, seconds in ((30, 0.12), (-60, 0.2), (110, 0.5), (-90, 0.4), (15, 0.06), (-35, 0.15), (70, 0.35)):
        path.move((units, 0.8 * units, -units), seconds)
        path.hold(0.7)
    path.move((60, -110, 90), 2.0)  # a second posture
    for way in (1, -1):
        path.move((80 * way, 70 * way, -80 * way), 0.65)
        path.hold(1.0)
        for back in (1, -1):
            path.move((35 * back, 30 * back, 40 * back), 2.2)
    path.hold(0.5)
    return path.finished()


BUILT_IN = {"ramp-step": ramp_step, "reference-set": reference_set}
