"""Compares the recorded drive with the controller's law: with which columns, units and times does the law hold?

The drive follows from set point and position alone, whatever the arm does. So this does not detect effects of the arm.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from daq.contracts.machine import BoardPid, DcMotor, Machine, NoController, SampledPid, of_joint
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.drives.controller import INTEGRAL_SHARE

HOLDS = 0.1
"""Largest remaining share of the drive's variation (root mean squares) with which a law holds. Rounding and lost
samples leave less, and no other law comes so near."""
BETTER = 0.2
"""Largest remainder with other columns, as a share of that with the recorded ones, for them to be accepted."""
AT_LIMIT = 0.98
"""Share of the largest drive from which it may be limited."""
SEVERAL = 3
"""Number of samples at the largest drive that show a limit."""
MOST_ROWS = 3
"""Rows, up or down, by which the drive's column may have slipped against the others."""
DEGREE = math.pi / 180.0


@dataclass(frozen=True)
class Reading:
    """A hypothesis on the columns of one joint.

    Args:
        position, set_point: true content of these columns.
        late: samples by which the drive is too low in the file; below 0 too high.
        swapped: whether position and set point are exchanged. turned: those of both that are in degrees.
    """

    position: Floats
    set_point: Floats
    late: int = 0
    swapped: bool = False
    turned: str = ""


@dataclass(frozen=True)
class LawFit:
    """Fit of the drive to columns: `left` of its variation remains; it is `factor` times that of the gains."""

    reading: Reading
    factor: float
    left: float


def fits_of(trace: Trace, machine: Machine, joint: int) -> list[LawFit]:
    """Fits a joint's drive to each hypothesis on its columns, as recorded first.

    Empty if the machine file describes no controller, or the record lacks an input of it.
    """
    if isinstance(machine.controller, NoController) or trace.set_point is None or trace.drive is None:
        return []
    column = trace.column(joint)
    position, asked, drive = (s[:, column] for s in (trace.position, trace.set_point, trace.drive))
    if not np.ptp(asked) or not np.ptp(drive) or len(drive) < 4 * SEVERAL:
        return []
    found = []
    for reading in _ways(position, asked, slides=machine.joint(joint).kind == "prismatic"):
        formed = formed_drive(trace, machine, joint, reading)
        if formed is None:
            return []
        late, rows = reading.late, len(drive)
        found.append(
            _fit(reading, formed[max(0, -late) : rows - max(0, late)], drive[max(0, late) : rows + min(0, late)])
        )
    return found


def best_fit(fits: list[LawFit]) -> LawFit | None:
    """Returns the fit as recorded if it holds well enough, else a much better one, else None."""
    if not fits:
        return None
    recorded = fits[0]
    best = min((fit for fit in fits if fit is recorded or fit.factor > 0.0), key=lambda fit: fit.left)
    if best.left < HOLDS and best.left < BETTER * recorded.left:
        return best
    return recorded if recorded.left < HOLDS else None


def is_formed_as_recorded(trace: Trace, machine: Machine, joint: int) -> bool:
    """Whether the controller's law gives the recorded drive, its constant too: set point and position then have one
    unit and one zero, however far a load keeps them apart."""
    if isinstance(machine.controller, NoController) or trace.set_point is None or trace.drive is None:
        return False
    column = trace.column(joint)
    formed = formed_drive(trace, machine, joint, Reading(trace.position[:, column], trace.set_point[:, column]))
    drive = trace.drive[:, column]
    return formed is not None and bool(np.linalg.norm(drive - formed) < HOLDS * np.linalg.norm(drive))


def time_matters(trace: Trace, machine: Machine, joint: int, ratio: float) -> bool:
    """Whether the law holds at the file's control period but not at `ratio` times that period.

    If so, the samples are one period apart, whatever their times state.
    """
    column = trace.column(joint)
    assert trace.set_point is not None
    assert trace.drive is not None
    reading = Reading(trace.position[:, column], trace.set_point[:, column])
    formed = [formed_drive(trace, machine, joint, reading, stretched) for stretched in (1.0, ratio)]
    if any(one is None for one in formed):
        return False
    left = [_fit(reading, one, trace.drive[:, column]).left for one in formed if one is not None]
    return left[0] < HOLDS and left[0] < BETTER * left[1]


def formed_drive(trace: Trace, machine: Machine, joint: int, reading: Reading, stretched: float = 1.0) -> Floats | None:
    """Returns the drive (k,) that the machine file's gains compute from columns, without limits, rounding and a
    constant.

    None if the file lacks the sensor whose counts the law uses. stretched: factor of the control period.
    """
    controller = machine.controller
    error = reading.set_point - reading.position
    if isinstance(controller, SampledPid):
        period = stretched * controller.period.value
        band = of_joint(controller.dead_band, joint)
        error = error if band is None else np.where(np.abs(error) <= band.value, 0.0, error)
        output = _pid(error, controller.gains[joint - 1], period)
        if controller.velocity_gains is not None:
            speed = np.diff(reading.position, prepend=reading.position[0]) / period
            output = _pid(output - speed, controller.velocity_gains[joint - 1], period)
        return output
    own = machine.joint(joint)
    if not isinstance(controller, BoardPid) or own.sensor is None or not isinstance(own.drive, DcMotor):
        return None
    p, i, d = (trace.record.gains or {}).get(joint, controller.gains[joint - 1])
    counts = error / (own.sensor.direction * own.sensor.count)
    power = p * counts + i * np.cumsum(counts) / INTEGRAL_SHARE + d * np.diff(counts, prepend=counts[0])
    volts = machine.drive_sign(joint) * own.drive.scale.counts_to_volts(1.0)
    return np.asarray(controller.dac_counts_per_adc_count.value * volts * power)


def _ways(position: Floats, asked: Floats, *, slides: bool) -> Iterator[Reading]:
    yield Reading(position, asked)
    yield from (Reading(position, asked, late=late) for late in range(-MOST_ROWS, MOST_ROWS + 1) if late)
    yield Reading(asked, position, swapped=True)  # for a cascade; a PID's drive has the other sign, as in the first
    if not slides:
        yield Reading(position * DEGREE, asked, turned="positions")
        yield Reading(position, asked * DEGREE, turned="set points")


def _pid(error: Floats, gains: tuple[float, float, float], period: float) -> Floats:
    p, i, d = gains
    return np.asarray(p * error + i * period * np.cumsum(error) + d * np.diff(error, prepend=error[0]) / period)


def _fit(reading: Reading, formed: Floats, drive: Floats) -> LawFit:
    """Fits the drive as a factor times the computed one, plus the unknown initial state of integrators."""
    size = np.abs(drive)
    limited = size >= AT_LIMIT * size.max()
    free = ~limited if int(limited.sum()) >= SEVERAL else np.ones(len(drive), dtype=bool)
    free[0] = False  # the controller's derivative there needs a sample before the record
    if int(free.sum()) < 4 * SEVERAL or not np.ptp(formed[free]):
        return LawFit(reading, 0.0, 1.0)
    columns = np.column_stack([formed[free], np.ones(int(free.sum()))])
    line = np.linalg.lstsq(columns, drive[free], rcond=None)[0]
    left = drive[free] - columns @ line
    whole = float(np.sqrt(np.mean((drive[free] - drive[free].mean()) ** 2)))
    return LawFit(reading, float(line[0]), float(np.sqrt(np.mean(left**2))) / whole if whole > 0.0 else 1.0)
