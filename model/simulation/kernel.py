"""The compiled run of a whole record, and its entries: the closed form, its flexible form, and any chain.

One module-level kernel holds every effect of the library. Effects that only add a term are off at their null value;
those that add state have a flag. Real numbers for a simulation, dual numbers (complex128) for exact sensitivities.
Every entry takes a batch of runs:

    which: (r,) record of each run; first, last: the runs to do, first ≤ i < last.
    lengths: (t,) periods of each record. set_points: (t, k, n) counts for the board's PID, rad else.
    recorded: (t, k, n) motor volts where nothing controls. noise: (t, k, n) added to the readings before rounding.
    readings: (t, k, n) recorded ones in rad, NaN where there is none, and following: (t,), as `Options` tells.
    initial: (r, n, 2) position and speed. first_drive: (t, n) commanded volts before the record.
    shares: (r, SHARED) and parts: (r, n, PER_JOINT), the flat vectors. gains: (t, n, GAINS). flags: (n,).
    settings: (t, SETTINGS). own: (n, e, 2), the user's own effects (`model.simulation.own_torque`).
    step: longest step of integration, s. out: (r, OUTPUTS, k, n), filled.
"""

# ruff: noqa: ARG001 (what an implementation does not need is part of the face all of them share)

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from model.drives.amplifier import motor_volts
from model.drives.controller import MEMORY
from model.drives.piecewise import clamped
from model.dynamics.compilation import internal
from model.machine_model import layout as at
from model.simulation import closed_form_motion, general_motion
from model.simulation.dynamics_of_run import body_of, friction_levels_of, gravity_of
from model.simulation.joint_torques import (
    CURRENT,
    DEFLECTION,
    POSITION,
    ROTOR_POSITION,
    ROTOR_SPEED,
    SPEED,
    STATE,
    STUCK,
    motor_gain,
    steady_current,
)
from model.simulation.period import (
    BEGUN,
    QUEUE,
    begin_stretch,
    end_stretch,
    extra_flags,
    sample,
    step_count,
    switching_times,
    warms,
)
from model.simulation.specialised import OPTIONS, AnyChain, ClosedForm, Flexible, entry

Array = NDArray[Any]


def advance_of(
    kind: Any, own: Any, state: Any, volts: Any, start: Any, duration: Any, steps: Any, joints: Any, body: Any,
    flags: Any, settings: Any, work: Any,
) -> None:  # fmt: skip
    """Advances `state` over a stretch of constant motor volts."""
    raise NotImplementedError("for compiled code")


@overload(advance_of, jit_options=OPTIONS)
def _advance_of(
    kind: Any, own: Any, state: Any, volts: Any, start: Any, duration: Any, steps: Any, joints: Any, body: Any,
    flags: Any, settings: Any, work: Any,
) -> Any:  # fmt: skip
    if kind.instance_class is ClosedForm:

        def closed_form(
            kind: Any, own: Any, state: Any, volts: Any, start: Any, duration: Any, steps: Any, joints: Any, body: Any,
            flags: Any, settings: Any, work: Any,
        ) -> None:  # fmt: skip
            closed_form_motion.advance(state, volts, start, duration, steps, joints, body, flags)

        return closed_form

    def general(
        kind: Any, own: Any, state: Any, volts: Any, start: Any, duration: Any, steps: Any, joints: Any, body: Any,
        flags: Any, settings: Any, work: Any,
    ) -> None:  # fmt: skip
        general_motion.advance(own, kind, state, volts, start, duration, steps, joints, body, flags, settings, work)

    return general


@internal
def batch(
    kind: Any, first: int, last: int, which: Array, lengths: Array,
    set_points: Array, recorded: Array, noise: Array, readings: Array, following: Array, initial: Array,
    first_drive: Array, shares: Array, parts: Array, gains: Array, flags: Array, settings: Array, own: Array,
    step: float, out: Array,
) -> None:  # fmt: skip
    """Runs first … last − 1; `kind` is a tag that chooses the dynamics."""
    n = initial.shape[1]
    state = np.zeros((n, STATE), dtype=parts.dtype)
    memory = np.zeros((n, MEMORY), dtype=parts.dtype)
    queue = np.zeros((QUEUE, n), dtype=parts.dtype)
    volts = np.zeros(n, dtype=parts.dtype)
    order = np.zeros(n, dtype=np.int64)
    times = np.zeros(n, dtype=parts.dtype)
    begun = np.zeros((BEGUN, n), dtype=parts.dtype)
    work = np.zeros((general_motion.WORK, n), dtype=parts.dtype)
    for r in range(first, last):
        t = which[r]
        shared, joints = shares[r], parts[r]
        modes = extra_flags(joints, flags)
        body = body_of(kind, shared, joints, modes)
        period = shared[at.PERIOD]
        late = switching_times(shared, joints, order, times)
        posture = work[general_motion.Q]
        for j in range(n):
            posture[j] = initial[r, j, 0]
            for i in range(MEMORY):
                memory[j, i] = 0.0 * posture[j]
            for i in range(STATE):
                state[j, i] = 0.0 * posture[j]
            for i in range(QUEUE):
                queue[i, j] = first_drive[t, j]
            volts[j] = motor_volts(queue[0, j], joints[j])
        friction_levels_of(kind, posture, joints, body, settings[t], work[general_motion.LEVEL])
        at_rest(state, initial[r], volts, joints, gravity_of(kind, posture, joints, body), modes, work)
        for k in range(lengths[t]):
            for j in range(n):
                queue[k % QUEUE, j] = sample(
                    k, j, state, set_points[t], recorded[t], noise[t], readings[t], following[t], gains[t], shared,
                    joints, settings[t], memory, out[r],
                )  # fmt: skip
            done = 0.0 * period
            for i in range(n + 1):
                until = times[order[i]] if i < n else period
                if until != done:
                    steps = step_count(until - done, step)
                    pieces = steps if warms(joints) else 1
                    duration = (until - done) / pieces
                    for piece in range(pieces):
                        begin_stretch(state, volts, duration, joints, modes, begun)
                        start = k * period + done + piece * duration
                        advance_of(
                            kind, own, state, volts, start, duration, steps // pieces, joints, body, modes,
                            settings[t], work,
                        )  # fmt: skip
                        end_stretch(state, volts, duration, joints, modes, begun)
                done = until
                if i < n:
                    j = order[i]
                    volts[j] = motor_volts(queue[(k - late[j]) % QUEUE, j], joints[j])


@internal
def at_rest(
    state: Array, initial: Array, volts: Array, joints: Array, weights: Array, flags: Array, work: Array
) -> None:
    """Initial state: friction carries at rest what gravity and motor leave over, as far as it can."""
    for j in range(joints.shape[0]):
        state[j, POSITION], state[j, SPEED] = initial[j, 0], initial[j, 1]
        state[j, ROTOR_POSITION], state[j, ROTOR_SPEED] = initial[j, 0], initial[j, 1]
        state[j, STUCK] = 1.0 + 0.0 * initial[j, 0]
        state[j, CURRENT] = steady_current(joints[j], 0.0 * volts[j], volts[j], initial[j, 1])
        pull = motor_gain(joints[j], 0.0 * volts[j]) * volts[j]
        level = work[general_motion.LEVEL, j]
        if flags[j] & at.HAS_STICTION:
            level += joints[j, at.BREAKAWAY]
        if level.real > 0.0 and initial[j, 1].real == 0.0:
            state[j, DEFLECTION] = clamped((pull - weights[j]) / level, 1.0 + 0.0 * pull)
        if flags[j] & at.HAS_FLEXIBILITY:
            give = joints[j, at.COMPLIANCE] + joints[j, at.CONTACT_COMPLIANCE]
            slack = 0.5 * joints[j, at.GAP]
            state[j, ROTOR_POSITION] += give * pull + (slack if pull.real >= 0.0 else -slack)


@entry
def run_closed_form(
    first: int, last: int, which: Array, lengths: Array, set_points: Array, recorded: Array, noise: Array,
    readings: Array, following: Array, initial: Array, first_drive: Array, shares: Array, parts: Array, gains: Array,
    flags: Array, settings: Array, own: Array, step: float, out: Array,
) -> None:  # fmt: skip
    """The waist-shoulder-elbow arm of rods with rigid transmissions."""
    batch(
        ClosedForm(0), first, last, which, lengths, set_points, recorded, noise, readings, following, initial,
        first_drive, shares, parts, gains, flags, settings, own, step, out,
    )  # fmt: skip


@entry
def run_flexible(
    first: int, last: int, which: Array, lengths: Array, set_points: Array, recorded: Array, noise: Array,
    readings: Array, following: Array, initial: Array, first_drive: Array, shares: Array, parts: Array, gains: Array,
    flags: Array, settings: Array, own: Array, step: float, out: Array,
) -> None:  # fmt: skip
    """The same arm where a transmission gives or has play."""
    batch(
        Flexible(0), first, last, which, lengths, set_points, recorded, noise, readings, following, initial,
        first_drive, shares, parts, gains, flags, settings, own, step, out,
    )  # fmt: skip


@entry
def run_chain(
    first: int, last: int, which: Array, lengths: Array, set_points: Array, recorded: Array, noise: Array,
    readings: Array, following: Array, initial: Array, first_drive: Array, shares: Array, parts: Array, gains: Array,
    flags: Array, settings: Array, own: Array, step: float, out: Array,
) -> None:  # fmt: skip
    """Any machine."""
    batch(
        AnyChain(0), first, last, which, lengths, set_points, recorded, noise, readings, following, initial,
        first_drive, shares, parts, gains, flags, settings, own, step, out,
    )  # fmt: skip
