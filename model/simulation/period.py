"""Simulates the board in one control period: sample, compute the drive, apply it after its delay. Compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from model import layout as at
from model.arrays import Array
from model.drives.amplifier import risen, warmed
from model.drives.controller import (
    LAST_ERROR,
    LAST_READING,
    MEMORY,
    board_pid,
    cascade,
    given_out,
    linear_board_pid,
    outside_band,
    sampled_pid,
)
from model.drives.sensor import reading
from model.dynamics.compilation import borrowing, internal
from model.dynamics.wide_numbers import first
from model.simulation.joint_torques import POSITION, RISE, ROTOR_POSITION, ROTOR_SPEED, SPEED
from model.simulation.run_arrays import Arm, RecordRow

QUEUE = 16
"""Number of commands kept: the drive may be delayed by up to 14 periods."""

EXTRA_TORQUES = (
    at.STRIBECK,
    at.DIRECTION,
    at.VISCOUS_DIRECTION,
    at.DRAG,
    at.GEAR_LOSS,
    at.GEAR_LOSS_DIRECTION,
    at.RIPPLE_SINE,
    at.RIPPLE_COSINE,
    at.SPRING,
    at.CABLE,
    at.CONSTANT_TORQUE,
    at.DISTURBANCE_SINE,
    at.DISTURBANCE_COSINE,
)
"""Columns of a joint that add a torque unless they are zero."""

# Outputs of a run per period and joint.
OUT_POSITION, OUT_SPEED, OUT_READING, OUT_ERROR, OUT_POWER, OUT_DRIVE = range(6)
OUTPUTS = 6


@borrowing
def sample(k: int, j: int, state: Array, record: RecordRow, arm: Arm, memory: Array, out: Array) -> Any:
    """Returns the commanded motor volts of joint index j in period k; writes reading, error and power to `out`.

    The controller reads a value between the model's reading (`following` = 0) and the recorded one (1), where there is
    one. Where the recorded drive is the input, the controller computes only a correction of it (`corrected`).
    """
    joint, period, set_points = arm.joints[j], arm.shared[at.PERIOD], record.set_points
    kind, quantise = record.settings[at.CONTROLLER], record.settings[at.QUANTISE] == at.ALL_ROUNDED
    rounds = record.settings[at.QUANTISE] != at.NOTHING_ROUNDED
    has_sensor = joint[at.RAD_PER_COUNT].real != 0.0
    read = own = reading(state[j, POSITION], record.noise[k, j], quantise, joint)
    wanted = set_points[k, j] - joint[at.LOST] * (set_points[k, j] - set_points[max(k - 1, 0), j])
    unit = joint[at.RAD_PER_COUNT] if has_sensor else 1.0 + 0.0 * joint[at.RAD_PER_COUNT]
    zero = joint[at.AT_ZERO] if has_sensor else 0.0 * joint[at.AT_ZERO]
    out[OUT_READING, k, j] = zero + unit * read
    if record.following != 0.0 and not np.isnan(record.readings[k, j]):
        read += record.following * ((record.readings[k, j] - zero) / unit - read)
    if kind == at.BOARD_PID:
        error = wanted - read
        if k == 0:
            memory[j, LAST_ERROR] = error
        power = board_pid(error, record.gains[j], joint, rounds, memory[j])
        drive = power * joint[at.VOLTS_PER_COUNT]
        error = error * unit
    else:
        error = wanted - (zero + unit * read)
        acting = outside_band(error, record.gains[j]) if rounds else error
        if k == 0:
            memory[j, LAST_ERROR], memory[j, LAST_READING] = acting, read
        scale = 1.0 + joint[at.GAIN_ERROR]
        if kind == at.SAMPLED_PID:
            drive = scale * sampled_pid(acting, period, record.gains[j], memory[j])
            drive = given_out(drive, acting, period, record.gains[j], joint, rounds, memory[j])
        elif kind == at.CASCADE:
            speed = unit * (read - memory[j, LAST_READING]) / period
            drive = scale * cascade(acting, speed, period, record.gains[j], memory[j])
            drive = given_out(drive, acting, period, record.gains[j], joint, rounds, memory[j])
            memory[j, LAST_READING] = read
        else:  # at.NO_CONTROLLER: the recorded drive moves the model; `prepare` rejects controllers of unknown kind
            drive = record.recorded[k, j] + 0.0 * error
        power = drive / joint[at.VOLTS_PER_COUNT]
    if record.settings[at.DRIVE_RECORDED] != 0:
        shown = (record.readings[k, j] - zero) / unit
        apart = (1.0 - record.following) * (shown - own)
        drive = corrected(k, apart, unit, period, record, arm, j, memory[j, MEMORY:], drive)
        power = drive / joint[at.VOLTS_PER_COUNT]
    out[OUT_POSITION, k, j] = state[j, POSITION]
    out[OUT_SPEED, k, j] = state[j, SPEED]
    out[OUT_ERROR, k, j] = error
    out[OUT_POWER, k, j] = power
    out[OUT_DRIVE, k, j] = drive
    return drive


@borrowing
def corrected(
    k: int,
    apart: complex,
    unit: complex,
    period: complex,
    record: RecordRow,
    arm: Arm,
    j: int,
    memory: Array,
    drive: complex,
) -> Any:
    """Returns the recorded drive plus a controller's correction; the model's own `drive` where the sample is missing.

    The correction is the controller's output for the distance (counts) from simulated to recorded reading, without
    rounding, limits or wrong gain.
    """
    if np.isnan(record.readings[k, j]):
        return drive
    kind, gains = record.settings[at.CONTROLLER], record.gains[j]
    if k == 0:
        memory[LAST_ERROR] = apart if kind == at.BOARD_PID else unit * apart
        memory[LAST_READING] = apart
    if kind == at.BOARD_PID:
        correction = linear_board_pid(apart, gains, memory) * arm.joints[j, at.VOLTS_PER_COUNT]
    elif kind == at.SAMPLED_PID:
        correction = sampled_pid(unit * apart, period, gains, memory)
    else:
        speed = unit * (memory[LAST_READING] - apart) / period
        correction = cascade(unit * apart, speed, period, gains, memory)
        memory[LAST_READING] = apart
    return record.recorded[k, j] + correction


@internal
def switching_times(shared: Array, joints: Array, order: Array, times: Array) -> Any:
    """Computes when in a period each joint's drive changes (`times`, s), in which order, and whole periods of delay.

    Times are compared by their real parts, and equal ones keep the joints' order; dual parts then give exact
    derivatives.
    """
    n = joints.shape[0]
    periods = np.zeros(n, dtype=np.int64)
    for j in range(n):
        delay = shared[at.DELAY] + joints[j, at.EXTRA_DELAY]
        whole = int(np.floor(first(delay) / first(shared[at.PERIOD]) + 1e-12))
        periods[j] = min(max(whole, 0), QUEUE - 2)
        times[j] = delay - periods[j] * shared[at.PERIOD]
        i = j
        while i > 0 and first(times[order[i - 1]]) > first(times[j]):
            order[i] = order[i - 1]
            i -= 1
        order[i] = j
    return periods


@borrowing
def step_count(duration: complex, step: float) -> int:
    """Returns the number of equal steps of at most `step` s in a time; at least one."""
    return max(1, int(np.ceil(first(duration) / step - 1e-9)))


# State of each motor at the beginning of a time with constant volts.
BEGUN_POSITION, BEGUN_SPEED, BEGUN_RISE = range(3)
BEGUN = 3


@borrowing
def warms(joints: Array) -> bool:
    """Whether any winding warms. Each interval of constant volts then has its own resistance, with the same steps."""
    found = False
    for j in range(joints.shape[0]):
        found = found or joints[j, at.HEATING] != 0.0 or joints[j, at.TIMED_RISE] != 0.0
    return found


@borrowing
def begin_stretch(
    state: Array, volts: Array, start: complex, duration: complex, joints: Array, flags: Array, begun: Array
) -> None:
    """Stores in `begun` (BEGUN, n) the state of each motor, and sets the windings' resistance.

    The resistance is that of the middle of the interval, which begins `start` s after the run. Between intervals RISE
    holds only the rise that the current causes, not the one over time.
    """
    for j in range(joints.shape[0]):
        by_time = joints[j, at.TIMED_RISE] != 0.0
        if by_time:
            begun[BEGUN_RISE, j] = state[j, RISE]
        if joints[j, at.HEATING] != 0.0:
            gives = flags[j] & at.HAS_FLEXIBILITY != 0
            speed = state[j, ROTOR_SPEED] if gives else state[j, SPEED]
            rise = state[j, RISE]
            begun[BEGUN_POSITION, j] = state[j, ROTOR_POSITION] if gives else state[j, POSITION]
            begun[BEGUN_SPEED, j], begun[BEGUN_RISE, j] = speed, rise
            hot = rise + risen(start, joints[j]) if by_time else rise
            state[j, RISE] = warmed(rise, hot, volts[j], speed, speed, speed, 0.5 * duration, joints[j])
        if by_time:
            state[j, RISE] += risen(start + 0.5 * duration, joints[j])


@borrowing
def end_stretch(state: Array, volts: Array, duration: complex, joints: Array, flags: Array, begun: Array) -> None:
    """Computes the resistance of each winding after an interval, from its motion."""
    for j in range(joints.shape[0]):
        if joints[j, at.HEATING] != 0.0:
            gives = flags[j] & at.HAS_FLEXIBILITY != 0
            ended = state[j, ROTOR_SPEED] if gives else state[j, SPEED]
            moved = (state[j, ROTOR_POSITION] if gives else state[j, POSITION]) - begun[BEGUN_POSITION, j]
            rise, hot, start = begun[BEGUN_RISE, j], state[j, RISE], begun[BEGUN_SPEED, j]
            state[j, RISE] = warmed(rise, hot, volts[j], start, ended, moved / duration, duration, joints[j])
        elif joints[j, at.TIMED_RISE] != 0.0:
            state[j, RISE] = begun[BEGUN_RISE, j]


@internal
def extra_flags(joints: Array, flags: Array) -> Array:
    """Returns the joints' mode flags, with the bit of every added torque that is not at its null value."""
    result = np.empty(flags.shape[0], dtype=np.int64)
    for j in range(joints.shape[0]):
        result[j] = flags[j]
        for column in EXTRA_TORQUES:
            if joints[j, column] != 0.0:
                result[j] |= at.HAS_EXTRA_TORQUE
    return result
