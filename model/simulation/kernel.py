"""The compiled simulation of a whole record. Entries: the closed form, its flexible form, and any chain.

One module-level kernel contains every effect of the library. Effects that only add a term are off at their null value;
those that add state have a flag. Real numbers give a simulation, dual numbers (complex128) exact sensitivities. Every
entry runs first ≤ i < last of a batch and fills `out` (r, OUTPUTS, k, n).
"""

# ruff: noqa: ARG001 (all implementations share an interface, and some need only part of it)

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import overload

from model import layout as at
from model.arrays import Array
from model.drives.amplifier import motor_volts
from model.drives.controller import MEMORY
from model.drives.piecewise import clamped, magnitude
from model.dynamics.compilation import internal
from model.dynamics.wide_numbers import seen_as, where
from model.simulation import closed_form_motion, flexible_motion, general_motion
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
from model.simulation.run_arrays import (
    OPTIONS,
    AnyChain,
    Arm,
    ClosedForm,
    Flexible,
    RecordArrays,
    RunArrays,
    entry,
    record_row,
    uncompiled,
)


def advance_of(kind: Any, state: Any, volts: Any, start: Any, duration: Any, steps: Any, arm: Any, work: Any) -> None:
    """Advances `state` over a time with constant motor volts."""
    uncompiled(_advance_of, kind, state, volts, start, duration, steps, arm, work)


@overload(advance_of, jit_options=OPTIONS)
def _advance_of(kind: Any, state: Any, volts: Any, start: Any, duration: Any, steps: Any, arm: Any, work: Any) -> Any:
    if kind.instance_class is ClosedForm:

        def closed_form(
            kind: Any, state: Any, volts: Any, start: Any, duration: Any, steps: Any, arm: Any, work: Any
        ) -> None:
            closed_form_motion.advance(state, volts, start, duration, steps, arm)

        return closed_form

    if kind.instance_class is Flexible:

        def flexible(
            kind: Any, state: Any, volts: Any, start: Any, duration: Any, steps: Any, arm: Any, work: Any
        ) -> None:
            if arm.own.shape[1] > 0:
                general_motion.advance(kind, state, volts, start, duration, steps, arm, work)
            else:
                flexible_motion.advance(state, volts, start, duration, steps, arm, work)

        return flexible

    def general(kind: Any, state: Any, volts: Any, start: Any, duration: Any, steps: Any, arm: Any, work: Any) -> None:
        general_motion.advance(kind, state, volts, start, duration, steps, arm, work)

    return general


@internal
def batch(
    kind: Any, numbers: Any, first: int, last: int, records: RecordArrays, runs: RunArrays, output: Array
) -> None:
    """Runs first … last − 1; `kind` is a tag that chooses the dynamics, `numbers` one that chooses the numbers."""
    n = runs.initial.shape[1]
    initial, shares = seen_as(numbers, runs.initial), seen_as(numbers, runs.shares)
    parts, out = seen_as(numbers, runs.parts), seen_as(numbers, output)
    state = np.zeros((n, STATE), dtype=parts.dtype)
    memory = np.zeros((n, 2 * MEMORY), dtype=parts.dtype)
    queue = np.zeros((QUEUE, n), dtype=parts.dtype)
    volts = np.zeros(n, dtype=parts.dtype)
    order = np.zeros(n, dtype=np.int64)
    times = np.zeros(n, dtype=parts.dtype)
    begun = np.zeros((BEGUN, n), dtype=parts.dtype)
    work = np.zeros((general_motion.WORK, n), dtype=parts.dtype)
    for r in range(first, last):
        record = record_row(records, runs.which[r])
        shared, joints = shares[r], parts[r]
        modes = extra_flags(joints, runs.flags)
        arm = Arm(shared, joints, body_of(kind, shared, joints, modes), modes, record.settings, runs.own)
        period = shared[at.PERIOD]
        late = switching_times(shared, joints, order, times)
        posture = work[general_motion.Q]
        for j in range(n):
            posture[j] = initial[r, j, 0]
            for i in range(2 * MEMORY):
                memory[j, i] = 0.0 * posture[j]
            for i in range(STATE):
                state[j, i] = 0.0 * posture[j]
            for i in range(QUEUE):
                queue[i, j] = record.first_drive[j]
            volts[j] = motor_volts(queue[0, j], joints[j])
        friction_levels_of(kind, posture, joints, arm.body, arm.settings, work[general_motion.LEVEL])
        at_rest(state, initial[r], volts, gravity_of(kind, posture, joints, arm.body), arm, work)
        for k in range(records.lengths[runs.which[r]]):
            for j in range(n):
                queue[k % QUEUE, j] = sample(k, j, state, record, arm, memory, out[r])
            done = 0.0 * period
            for i in range(n + 1):
                until = times[order[i]] if i < n else period
                if until != done:
                    steps = step_count(until - done, runs.step)
                    pieces = steps if warms(joints) else 1
                    duration = (until - done) / pieces
                    for piece in range(pieces):
                        start = k * period + done + piece * duration
                        begin_stretch(state, volts, start, duration, joints, modes, begun)
                        advance_of(kind, state, volts, start, duration, steps // pieces, arm, work)
                        end_stretch(state, volts, duration, joints, modes, begun)
                done = until
                if i < n:
                    j = order[i]
                    volts[j] = motor_volts(queue[(k - late[j]) % QUEUE, j], joints[j])


@internal
def at_rest(state: Array, initial: Array, volts: Array, weights: Array, arm: Arm, work: Array) -> None:
    """Computes the initial state: friction balances gravity and motor torque at rest, as far as it can."""
    joints, flags = arm.joints, arm.flags
    for j in range(joints.shape[0]):
        state[j, POSITION], state[j, SPEED] = initial[j, 0], initial[j, 1]
        state[j, ROTOR_POSITION], state[j, ROTOR_SPEED] = initial[j, 0], initial[j, 1]
        state[j, STUCK] = 1.0 + 0.0 * initial[j, 0]
        state[j, CURRENT] = steady_current(joints[j], 0.0 * volts[j], volts[j], initial[j, 1])
        pull = motor_gain(joints[j], 0.0 * volts[j]) * volts[j]
        level = work[general_motion.LEVEL, j]
        if flags[j] & at.HAS_STICTION:
            level += joints[j, at.BREAKAWAY]
        rests = (level.real > 0.0) & (magnitude(initial[j, 1]).real <= 0.0)
        state[j, DEFLECTION] = where(rests, clamped((pull - weights[j]) / level, 1.0 + 0.0 * pull), 0.0 * pull)
        if flags[j] & at.HAS_FLEXIBILITY:
            give = joints[j, at.COMPLIANCE] + joints[j, at.CONTACT_COMPLIANCE]
            slack = 0.5 * joints[j, at.GAP]
            state[j, ROTOR_POSITION] += give * pull + where(pull.real >= 0.0, slack, -slack)


@entry
def run_closed_form(numbers: Any, first: int, last: int, records: RecordArrays, runs: RunArrays, out: Array) -> None:
    """Runs the waist-shoulder-elbow arm of rods with rigid transmissions."""
    batch(ClosedForm(0), numbers, first, last, records, runs, out)


@entry
def run_flexible(numbers: Any, first: int, last: int, records: RecordArrays, runs: RunArrays, out: Array) -> None:
    """Runs the same arm with a flexible transmission or backlash."""
    batch(Flexible(0), numbers, first, last, records, runs, out)


@entry
def run_chain(numbers: Any, first: int, last: int, records: RecordArrays, runs: RunArrays, out: Array) -> None:
    """Runs any machine."""
    batch(AnyChain(0), numbers, first, last, records, runs, out)
