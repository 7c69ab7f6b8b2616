"""Prepares the inputs of a simulation, per control period, from a recorded trace."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from daq.contracts.errors import TraceError
from daq.contracts.experiment import Gain
from daq.contracts.joint_matching import matched
from daq.contracts.machine import BoardPid, Machine, NoController, SampledPid, of_joint
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.drives import controller as pid

REST_COUNTS = 2.0
"""Largest difference, in sensor counts, of readings that count as one posture before the first new set point."""
REST_PERIODS = 25
"""Most readings that are averaged to the posture at rest."""
NEIGHBOURS = 1.5
"""Largest distance, in periods, between samples without a gap."""
MOST_SAMPLES = 0.8
"""Least share of periods with a sample at which a record counts as sampled in every period."""
NEARLY = 1e-6
"""Distance, in periods, that counts as rounding."""
LARGEST_ANGLE = 20.0
"""Largest plausible angle, rad; more than three turns of a joint are assumed to be degrees."""


@dataclass(frozen=True)
class RunInputs:
    """Everything that a run uses of a record, on the grid of control periods.

    Args:
        joints: joints that the model moves, numbered from 1.
        period: s. time: (k,) s, of the record's clock.
        set_points: (k, n) rad, held where the record has gaps. drive: (k, n) motor volts, for a run in open loop.
        initial: (n, 2) position (rad) and speed (rad/s). first_drive: (n,) commanded volts before the first period.
        readings: (k, n) rad, NaN where the record has a gap.
        rows: (m,) position of each sample on the grid. gains: (n, GAINS).
        has_set_points, has_drive: whether the record has them. Missing set points are held at the reading; missing
            drive is zero.
    """

    joints: tuple[int, ...]
    period: float
    time: Floats
    set_points: Floats
    drive: Floats
    readings: Floats = field(repr=False)
    initial: Floats
    first_drive: Floats
    rows: Floats
    gains: Floats
    noise: Floats = field(repr=False)
    name: str = ""
    has_set_points: bool = True
    has_drive: bool = True

    def __len__(self) -> int:
        return len(self.time)

    @property
    def drive_of_every_period(self) -> bool:
        """Whether the record holds the drive of each control period: one sample per period, with few missing."""
        whole = bool(np.all(self.rows == np.round(self.rows)))
        return self.has_drive and whole and len(self.rows) > MOST_SAMPLES * len(self)


def inputs_of(trace: Trace, machine: Machine) -> RunInputs:
    """Returns the inputs of a run that repeats a trace.

    The arm starts at rest at the posture measured before the first new set point (at the first reading, with the
    measured speed, where the trace has one). Its first drive is that of the first sample. If only the recorded drive
    moves the model and no speed was measured, the initial speed is estimated from the first readings.

    Raises:
        TraceError: for fewer than three samples, a missing joint, angles that look like degrees, or neither
            set points (with a controller) nor drive.
    """
    joints = machine.modelled_joints
    if len(trace) < 3:
        raise TraceError(f"{trace.called}: {len(trace)} samples; at least 3 are needed")
    trace = matched(trace, machine)
    columns = [trace.column(j) for j in joints]
    measured = trace.position[:, columns]
    _check_unit(trace, measured, machine)
    period = _period(trace, machine)
    rows = _rows(trace, period)
    count = int(np.ceil(rows[-1] - 1e-6)) + 1
    controlled = not isinstance(machine.controller, NoController)
    if controlled and trace.set_point is None and trace.drive is None:
        raise TraceError(f"{trace.called}: has neither set points nor drive, so nothing moves the model")
    if not controlled and trace.drive is None:
        raise TraceError(f"{trace.called}: has no drive, and {machine.name} has no controller that could compute it")
    wanted = measured if trace.set_point is None else trace.set_point[:, columns]
    set_points = _held(wanted, _taken_from(trace, rows), count)
    drive = _held(np.zeros_like(measured) if trace.drive is None else trace.drive[:, columns], rows, count)
    initial = np.zeros((len(joints), 2))
    initial[:, 0] = _rest_posture(trace, measured, set_points[0], machine)
    if trace.velocity is not None:
        initial[:, 0], initial[:, 1] = measured[0], trace.velocity[0, columns]
    elif not controlled or trace.set_point is None:  # no feedback brings it back to the record
        initial[:, 1] = speed_at_start(trace, machine)
    return RunInputs(
        joints,
        period,
        trace.time[0] + period * np.arange(count),
        set_points,
        drive,
        readings_on_grid(measured, rows, count),
        initial,
        drive[0].copy(),
        rows,
        gains_of(machine, trace.record.gains),
        np.zeros((count, len(joints))),
        trace.record.trace_id,
        trace.set_point is not None,
        trace.drive is not None,
    )


def _check_unit(trace: Trace, measured: Floats, machine: Machine) -> None:
    for k, joint in enumerate(machine.modelled_joints):
        largest = float(np.abs(measured[:, k]).max())
        sensor = machine.joint(joint).sensor
        reads_angles = sensor is not None and sensor.measures == "position"  # a tachometer's shaft may turn endlessly
        if machine.joint(joint).kind == "revolute" and reads_angles and largest > LARGEST_ANGLE:
            raise TraceError(
                f"{trace.called}: joint {joint} reaches {largest:.4g} rad; are these degrees? "
                f"angles must be in rad, up to {LARGEST_ANGLE:g}"
            )


def _period(trace: Trace, machine: Machine) -> float:
    if trace.record.period is not None:
        return trace.record.period
    if not isinstance(machine.controller, NoController):
        return machine.controller.period.value
    return float(np.median(np.diff(trace.time)))


def _rows(trace: Trace, period: float) -> Floats:
    """Returns each sample's position on the grid of periods: whole numbers when every period was sampled."""
    if trace.tick is not None:
        return np.asarray(trace.tick - trace.tick[0], dtype=np.float64)
    rows = (trace.time - trace.time[0]) / period
    whole = np.round(rows)
    return np.asarray(whole if np.abs(rows - whole).max() < 0.05 else rows)


def _taken_from(trace: Trace, rows: Floats) -> Floats:
    """Returns the period from which each recorded set point was used.

    The record may state it; it can only be after the previous sample. Otherwise, the host of a slow line wrote the next
    set point right after a sampled period, so it was used in all periods up to the next sample.
    """
    if trace.tick is None:
        return rows
    assumed = rows - (trace.record.every - 1)
    if trace.taken is None:
        return assumed
    taken = np.where(trace.taken > 0, trace.taken - trace.tick[0], assumed)
    return np.asarray(np.clip(taken, np.concatenate([rows[:1], rows[:-1] + 1]), rows))


def _held(samples: Floats, rows: Floats, count: int) -> Floats:
    """Returns samples on the grid, each held until the next one."""
    last = np.searchsorted(rows, np.arange(count) + 1e-6, side="right") - 1
    return np.ascontiguousarray(samples[np.clip(last, 0, len(samples) - 1)])


def readings_on_grid(measured: Floats, rows: Floats, count: int) -> Floats:
    """Returns readings (k, n) at whole periods, interpolated between adjacent samples; NaN where one is missing."""
    grid = np.arange(float(count))
    after = np.clip(np.searchsorted(rows, grid - NEARLY), 1, len(rows) - 1)
    left, right = rows[after - 1], rows[after]
    known = (right - left < NEIGHBOURS) | (np.abs(grid - left) < NEARLY) | (np.abs(grid - right) < NEARLY)
    known &= (grid > rows[0] - NEARLY) & (grid < rows[-1] + NEARLY)
    found = np.stack([np.interp(grid, rows, column) for column in measured.T], axis=1)
    found[~known] = np.nan
    return found


def _rest_posture(trace: Trace, measured: Floats, first: Floats, machine: Machine) -> Floats:
    """Returns the mean reading before the set points first change, as long as the arm stands still."""
    still = np.ones(len(trace), dtype=bool)
    if trace.set_point is not None:
        columns = [trace.column(j) for j in machine.modelled_joints]
        still &= (np.abs(trace.set_point[:, columns] - first) < 1e-9).all(axis=1)
    for k, joint in enumerate(machine.modelled_joints):
        near = REST_COUNTS * machine.joint(joint).count or 1e-9
        still &= np.abs(measured[:, k] - measured[0, k]) <= near
    until = int(np.argmin(still)) if not still.all() else len(still)
    return np.asarray(measured[: max(1, min(until, REST_PERIODS))].mean(axis=0))


def gains_of(machine: Machine, own: Mapping[int, Gain] | None) -> Floats:
    """Returns gains (n, GAINS) of the modelled joints: those of the record where it has them, else the machine's."""
    gains = np.zeros((len(machine.modelled_joints), pid.GAINS))
    controller = machine.controller
    if isinstance(controller, NoController):
        return gains
    for k, joint in enumerate(machine.modelled_joints):
        gains[k, pid.P : pid.D + 1] = controller.gains[joint - 1]
        if isinstance(controller, BoardPid):
            gains[k, pid.SCALE] = controller.dac_counts_per_adc_count.value
            if own and joint in own:
                gains[k, pid.P : pid.D + 1] = own[joint]
        elif isinstance(controller, SampledPid):
            if controller.velocity_gains is not None:
                gains[k, pid.INNER_P : pid.INNER_D + 1] = controller.velocity_gains[joint - 1]
            for column, stated in (
                (pid.RESOLUTION, controller.drive_resolution),
                (pid.DEAD_BAND, controller.dead_band),
            ):
                size = of_joint(stated, joint)
                gains[k, column] = 0.0 if size is None else size.value
    return gains


# --- Estimates the speed at which a record begins, from its first readings


LEAST_TIME = 0.05
"""Least length (s) of the record's beginning from which the speed is estimated."""
LEAST_READINGS = 12
"""Least number of readings there: a parabola through six can still be distinguished from noise."""
SURE = 6.0
"""Number of standard errors by which a speed must differ from zero."""
SHARE = 0.1
"""Least share of a joint's largest speed in the record that counts as motion at the beginning."""
AGREEMENT = 0.3
"""Largest relative difference between the speeds estimated from the beginning and from its first half. When a joint
starts from rest, its first half gives a much lower speed, whatever force sets the arm in motion.
"""
COUNTS = 4.0
"""Least displacement over the beginning, in counts of the sensor."""


def speed_at_start(trace: Trace, machine: Machine) -> Floats:
    """Returns speeds (n,), rad/s (m/s), of the modelled joints at the first sample; 0 for joints that begin at rest.

    A least-squares parabola is fitted to the first readings. Its slope at the first sample counts as speed if it is
    significant, a large share of the joint's largest speed, and similar in the first half of the readings.
    """
    return np.array([_speed(trace, machine, joint) for joint in machine.modelled_joints])


def _speed(trace: Trace, machine: Machine, joint: int) -> float:
    sensor = machine.joint(joint).sensor
    if sensor is not None and sensor.measures != "position":
        return 0.0
    time, reading = trace.time - trace.time[0], trace.position[:, trace.column(joint)]
    count = max(LEAST_READINGS, int(np.searchsorted(time, LEAST_TIME, side="right")))
    if len(time) < 2 * count:
        return 0.0
    speed, error = _slope(time[:count], reading[:count])
    early, _ = _slope(time[: count // 2], reading[: count // 2])
    travels = np.abs(reading[count - 1 :] - reading[: 1 - count]) / (time[count - 1 :] - time[: 1 - count])
    moves = abs(speed) > max(SURE * error, SHARE * float(travels.max()))
    seen = abs(speed) * time[count - 1] > COUNTS * machine.joint(joint).count
    agrees = abs(early - speed) <= AGREEMENT * abs(speed)
    return speed if moves and seen and agrees else 0.0


def _slope(time: Floats, reading: Floats) -> tuple[float, float]:
    """Returns the slope of a least-squares parabola at the first time, and its standard error from the residual."""
    span = time[-1]
    design = np.vander(time / span, 3, increasing=True)
    found, *_ = np.linalg.lstsq(design, reading - reading[0], rcond=None)
    residual = reading - reading[0] - design @ found
    variance = float(residual @ residual) / (len(time) - 3)
    spread = float(np.sqrt(variance * np.linalg.inv(design.T @ design)[1, 1]))
    return float(found[1]) / span, spread / span
