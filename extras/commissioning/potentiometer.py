"""Estimates direction, zero, range and bend of a potentiometer, from readings at postures measured with a protractor.

It fits a straight line to angles over readings by generalised least squares. Intervals are Student's at 95 %, from the
scatter of the readings themselves. A potentiometer bends smoothly, so neighbouring readings have similar errors and
contain less information on the line than independent ones. Half of the scatter is attributed to such a bend, the other
half to the protractor. The reported bend is the largest departure of a parabola from a line between the outermost
readings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from daq.contracts.errors import SpecError
from firmware_protocol.units import ADC_COUNTS

FEWEST = 5
"""Least number of postures."""
LEAST_SPREAD = ADC_COUNTS / 4
"""Least distance (ADC counts) between the outermost postures: a quarter of the range."""
STUDENT_95 = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131)
"""Two-sided 95 % points of Student's distribution for 1, 2, … degrees of freedom."""
NORMAL_95 = 1.96
BEND_SHARE, BEND_LENGTH = 0.5, 550.0
"""Share of the variance that is smooth, and its correlation length in ADC counts (standard deviation of a Gaussian).
Both are assumptions. With them intervals contained the truth in 92 to 98 % of simulated sensors, whose angles were read
to half a degree, with a scatter of half a degree, or exactly. With independent scatter it was 85 to 96 %."""


@dataclass(frozen=True)
class Interval:
    """A value and half the width of its 95 % interval."""

    value: float
    half_width: float

    def holds(self, truth: float) -> bool:
        """Whether the interval contains a value."""
        return abs(truth - self.value) <= self.half_width


@dataclass(frozen=True)
class Potentiometer:
    """One joint's sensor; angles in rad.

    direction: 1 where the reading rises with the angle, -1 where it falls
    at_zero:   angle at a reading of 0
    range:     angle of 4096 counts
    bend:      largest departure of a parabola from the line, as a share of the range
    scatter:   root mean square departure of the readings from the line (rad)
    angles, residuals: what was measured, and its departure from the line
    """

    joint: int
    direction: int
    at_zero: Interval
    range: Interval
    bend: Interval
    scatter: float
    counts: tuple[float, ...]
    angles: tuple[float, ...]
    residuals: tuple[float, ...]

    def as_data(self) -> dict[str, Any]:
        """Returns plain data."""
        return asdict(self)


def student_95(freedom: int) -> float:
    """Returns the two-sided 95 % point of Student's distribution."""
    if freedom < 1:
        return math.inf
    return STUDENT_95[freedom - 1] if freedom <= len(STUDENT_95) else NORMAL_95 * (1 + 1.2 / freedom)


def calibrate_potentiometer(joint: int, counts: Sequence[float], angles: Sequence[float]) -> Potentiometer:
    """Estimates the sensor with these readings (ADC counts) at these angles (rad).

    Raises SpecError for too few, or too close ones.
    """
    c, a = np.asarray(counts, float), np.asarray(angles, float)
    if len(c) != len(a) or len(c) < FEWEST:
        raise SpecError(f"joint {joint}: {len(c)} postures: at least {FEWEST} are needed")
    if np.ptp(c) < LEAST_SPREAD:
        raise SpecError(
            f"joint {joint}: postures {np.ptp(c):.0f} ADC counts apart: at least {LEAST_SPREAD:.0f} are needed"
        )
    slope, zero, errors, residuals = _line(c, a)
    freedom = len(c) - 2
    t = student_95(freedom)
    bend, bend_error = _bend(c, a, abs(slope) * ADC_COUNTS)
    return Potentiometer(
        joint,
        1 if slope > 0 else -1,
        Interval(zero, t * errors[1]),
        Interval(abs(slope) * ADC_COUNTS, t * errors[0] * ADC_COUNTS),
        Interval(bend, student_95(freedom - 1) * bend_error),
        float(np.sqrt(np.mean(residuals**2))),
        tuple(c.tolist()),
        tuple(a.tolist()),
        tuple(residuals.tolist()),
    )


def _line(c: Any, a: Any) -> tuple[float, float, tuple[float, float], Any]:
    """Returns slope, angle at 0, their standard errors, and the residual."""
    matrix = np.column_stack([c / ADC_COUNTS, np.ones_like(c)])
    alike = np.exp(-0.5 * ((c[:, None] - c) / BEND_LENGTH) ** 2)
    root = np.linalg.cholesky((1.0 - BEND_SHARE) * np.eye(len(c)) + BEND_SHARE * alike)
    white = np.linalg.solve(root, np.column_stack([matrix, a]))
    inverse = np.linalg.inv(white[:, :2].T @ white[:, :2])
    solution = inverse @ white[:, :2].T @ white[:, 2]
    left = white[:, 2] - white[:, :2] @ solution
    spread = np.sqrt(np.diag(inverse) * float(left @ left) / (len(c) - 2))
    errors = (float(spread[0]) / ADC_COUNTS, float(spread[1]))
    return float(solution[0]) / ADC_COUNTS, float(solution[1]), errors, a - matrix @ solution


def _bend(c: Any, a: Any, whole: float) -> tuple[float, float]:
    """Returns the largest departure of a parabola from a line, and its standard error, as shares of the range."""
    half = np.ptp(c) / 2
    x = (c - (c.max() + c.min()) / 2) / half
    matrix = np.column_stack([x**2 - 0.5, x, np.ones_like(x)])
    solution, *_ = np.linalg.lstsq(matrix, a, rcond=None)
    left = a - matrix @ solution
    variance = float(left @ left) / max(len(c) - 3, 1)
    error = math.sqrt(float(np.linalg.inv(matrix.T @ matrix)[0, 0]) * variance)
    return abs(float(solution[0])) / 2 / whole, error / 2 / whole
