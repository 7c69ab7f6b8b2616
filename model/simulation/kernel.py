"""The compiled run of a whole trace: one entry for the closed form, its parallel form, and what both share.

One module-level kernel holds every effect of the library. Effects that only add a term are off at their null value;
those that add state have a flag. Real numbers for a simulation, dual numbers (complex128) for exact sensitivities.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from model.drives.amplifier import motor_volts
from model.drives.controller import MEMORY
from model.drives.piecewise import clamped
from model.dynamics import effective_inertia as lumped
from model.dynamics.compilation import compiled
from model.dynamics.three_joint import gravity_torques
from model.machine_model import layout as at
from model.simulation.bodies import rod_arm_body
from model.simulation.closed_form_motion import (
    CURRENT, DEFLECTION, POSITION, ROTOR_POSITION, ROTOR_SPEED, SPEED, STATE, STUCK, advance, friction_levels,
)  # fmt: skip
from model.simulation.joint_torques import motor_gain, steady_current
from model.simulation.period import QUEUE, extra_flags, sample, step_count, switching_times, warm_up


@compiled
def run_closed_form(
    set_points: NDArray[Any], recorded: NDArray[Any], noise: NDArray[Any], initial: NDArray[Any],
    first_drive: NDArray[Any], vector: NDArray[Any], gains: NDArray[Any], flags: NDArray[Any],
    settings: NDArray[Any], step: float, out: NDArray[Any],
) -> None:  # fmt: skip
    """Simulate one record of the waist-shoulder-elbow arm.

    Args:
        set_points: (k, 3) counts for the board's PID, rad else. recorded: (k, 3) motor volts where nothing controls.
        noise: (k, 3) added to the readings before rounding, counts (rad without a converter).
        initial: (3, 2) position (rad) and speed (rad/s). first_drive: (3,) commanded volts before the record.
        vector: flat parameters (`model.machine_model.layout`). gains: (3, GAINS). flags: (3,). settings: (SETTINGS,).
        step: longest step of integration, s.
        out: (OUTPUTS, k, 3), filled.
    """
    shared = vector[: at.SHARED]
    joints = vector[at.SHARED :].reshape(3, at.PER_JOINT)
    body = rod_arm_body(shared, joints)
    modes = extra_flags(joints, flags)
    state = np.zeros((3, STATE), dtype=vector.dtype)
    memory = np.zeros((3, MEMORY), dtype=vector.dtype)
    queue = np.zeros((QUEUE, 3), dtype=vector.dtype)
    volts = np.zeros(3, dtype=vector.dtype)
    order = np.zeros(3, dtype=np.int64)
    times = np.zeros(3, dtype=vector.dtype)
    periods = switching_times(shared, joints, order, times)
    for j in range(3):
        for i in range(QUEUE):
            queue[i, j] = first_drive[j]
        volts[j] = motor_volts(queue[0, j], joints[j])
    _start(state, initial, volts, joints, body)
    for k in range(set_points.shape[0]):
        for j in range(3):
            queue[k % QUEUE, j] = sample(
                k, j, state, set_points, recorded, noise, gains, shared, joints, settings, memory, out
            )
        start, done = k * shared[at.PERIOD], 0.0 * shared[at.PERIOD]
        for i in range(4):
            until = times[order[i]] if i < 3 else shared[at.PERIOD]
            if until != done:
                steps = step_count(until - done, step)
                advance(state, volts, start + done, until - done, steps, shared, joints, body, modes)
            done = until
            if i < 3:
                j = order[i]
                volts[j] = motor_volts(queue[(k - periods[j]) % QUEUE, j], joints[j])
        warm_up(state, volts, shared, joints)


@compiled
def _start(
    state: NDArray[Any], initial: NDArray[Any], volts: NDArray[Any], joints: NDArray[Any], body: NDArray[Any]
) -> None:
    """Initial state: at rest, friction carries what gravity and motor leave over, as far as it can."""
    arms = (joints[0, at.COULOMB_ARM], joints[1, at.COULOMB_ARM], joints[2, at.COULOMB_ARM])
    plain = (joints[0, at.COULOMB], joints[1, at.COULOMB], joints[2, at.COULOMB])
    q = initial[:, 0]
    theta_1, theta_2, theta_3 = q[0] + joints[0, at.THETA], q[1] + joints[1, at.THETA], q[2] + joints[2, at.THETA]
    levels = friction_levels(theta_2, theta_3, arms, plain, body[lumped.SIZE], body[lumped.SIZE + 1])
    weights = gravity_torques(theta_1, theta_2, theta_3, body)
    for j in range(3):
        state[j, POSITION], state[j, SPEED] = initial[j, 0], initial[j, 1]
        state[j, ROTOR_POSITION], state[j, ROTOR_SPEED] = initial[j, 0], initial[j, 1]
        state[j, STUCK] = 1.0 + 0.0 * initial[j, 0]
        state[j, CURRENT] = steady_current(joints[j], 0.0 * volts[j], volts[j], initial[j, 1])
        left_over = motor_gain(joints[j], 0.0 * volts[j]) * volts[j] - weights[j]
        if levels[j].real > 0.0 and initial[j, 1].real == 0.0:
            state[j, DEFLECTION] = clamped(left_over / levels[j], 1.0 + 0.0 * left_over)


@numba.njit(cache=True, error_model="numpy", fastmath={"contract"}, parallel=True)
def many_closed_form(
    set_points: NDArray[Any], recorded: NDArray[Any], noise: NDArray[Any], initial: NDArray[Any],
    first_drive: NDArray[Any], lengths: NDArray[Any], traces: NDArray[Any], vectors: NDArray[Any],
    gains: NDArray[Any], flags: NDArray[Any], settings: NDArray[Any], step: float, out: NDArray[Any],
) -> None:  # fmt: skip
    """Many runs on all cores: run r takes trace `traces[r]` (padded to a common length) and row r of `vectors`."""
    for r in numba.prange(vectors.shape[0]):
        t = traces[r]
        n = lengths[t]
        run_closed_form(
            set_points[t, :n], recorded[t, :n], noise[t, :n], initial[r], first_drive[t], vectors[r], gains[t],
            flags, settings[t], step, out[r, :, :n],
        )  # fmt: skip
