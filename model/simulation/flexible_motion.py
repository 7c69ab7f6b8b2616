"""Integrates the waist-shoulder-elbow arm with flexible transmissions or backlash at constant drive: RK4. Compiled.

The steps are those of `general_motion`, but the closed form is called by name. All of it is thus compiled into one
function without reference counts of its arrays; they took longer than the arithmetic.
"""

from __future__ import annotations

from model.arrays import Array
from model.dynamics.compilation import borrowing
from model.simulation.dynamics_of_run import rod_arm_accelerations, rod_arm_levels
from model.simulation.general_motion import (
    LEVEL,
    TORQUE,
    A,
    Q,
    V,
    add_motors,
    add_stage,
    begin,
    end_joints,
    end_step,
    form_torques,
    to_stage,
)
from model.simulation.run_arrays import Arm


@borrowing
def advance(state: Array, volts: Array, start: complex, duration: complex, steps: int, arm: Arm, work: Array) -> None:
    """Advances the state (3, STATE) by `duration` s in equal steps at constant motor volts, without users' effects.

    `work` (WORK, 3) is overwritten.
    """
    joints, body, flags = arm.joints, arm.body, arm.flags
    h = duration / steps
    for step in range(steps):
        begin(state, work)
        for stage in range(4):
            reach = 0.0 * h if stage == 0 else (h if stage == 3 else 0.5 * h)
            to_stage(state, work, reach)
            rod_arm_levels(work[Q], joints, body, arm.settings, work[LEVEL])
            form_torques(state, work, volts, start + step * h + reach, h, stage, joints, flags)
            add_motors(work)
            rod_arm_accelerations(work[Q], work[V], work[TORQUE], joints, body, work[A])
            add_stage(work, 2.0 if stage in (1, 2) else 1.0)
        end_step(state, work, h / 6.0, joints)
        end_joints(state, work, volts, h, joints, flags)
