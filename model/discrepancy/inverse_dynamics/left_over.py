"""What is left over where a diagnosis ends: joints with more than noise, and laws that are of another form."""

from __future__ import annotations

import numpy as np

from model.arrays import Floats
from model.discrepancy.diagnosis import Step
from model.discrepancy.inverse_dynamics import holdout
from model.discrepancy.inverse_dynamics.localisation import ANOTHER_LAW, is_function_of, remaining_shapes
from model.discrepancy.inverse_dynamics.standing import Standing

FAR_ABOVE_NOISE = 10.0
"""Residual torque, in deviations of noise, that is taken for something missing even where no shape of it is found:
friction at a place, for one, depends on neither position nor direction alone. Sound rigs of other worlds leave up to
2.6, where friction turns (docs/how-well.md)."""
SHAPED_ABOVE_NOISE = 3.0
"""The same where a shape explains much of it (`ANOTHER_LAW`): the shape says as well that something is missing."""
LONG_MEMORY = 4.0
"""Memory of a residual, in samples, beyond which it is slower than noise. White noise of a drive comes to 1.9 behind
the low-pass, that of accelerations to 2.7."""


def is_left_beside(standing: Standing) -> bool:
    """Whether far more than noise is left, on fitted and on held-out records, on a joint of an effect that was
    adopted: its name is then not all of the answer."""
    own = {j for step in standing.steps if step.adopted for j in step.joints}
    joints = standing.model.machine.modelled_joints
    far = _noises_left(standing) > FAR_ABOVE_NOISE
    return any(is_far and (j in own or not own) for j, is_far in zip(joints, far, strict=True))


def joints_left_over(standing: Standing) -> tuple[int, ...]:
    """Joints whose residual is above noise on fitted and on held-out records, and is no noise: far above and slower, or
    of a shape."""
    case, now = standing.case, standing.now
    least = _noises_left(standing)
    shaped = {shape.joint for shape in remaining_shapes(now, case) if shape.explained >= ANOTHER_LAW}
    joints = standing.model.machine.modelled_joints
    slow = (least > FAR_ABOVE_NOISE) & (now.noise.memory > LONG_MEMORY)
    shapes = (least > SHAPED_ABOVE_NOISE) & np.array([j in shaped for j in joints])
    return tuple(j for j, left in zip(joints, slow | shapes, strict=True) if left)


def has_another_form(standing: Standing, step: Step) -> tuple[int, ...]:
    """Joints on which what is left is a function of a step's own torque.

    The numbers of a law are fitted. What is left as a function of the law's own torque is then something that the form
    of the law has not: it is another law of the same quantity, as drag that grows with the square of speed is beside
    viscous friction.
    """
    now, case = standing.now, standing.case
    absent = {p.name: p.null for n in step.parameters if (p := now.balance.model.by_name[n]).null is not None}
    left = set(joints_left_over(standing)) & set(step.joints)
    if not left or not absent:
        return ()
    without = now.balance.residual({**now.values, **absent})
    own = [less - all_of_it for less, all_of_it in zip(without, now.residual, strict=True)]
    joints = standing.model.machine.modelled_joints
    return tuple(j for k, j in enumerate(joints) if j in left and is_function_of(own, now, case, k))


def _noises_left(standing: Standing) -> Floats:
    """(n,) what fitted and held-out records leave at least, in noise floors: a record in which a joint rests says
    nothing of it."""
    case, now = standing.case, standing.now
    left = [np.sqrt(holdout.mean_squares(case.stretches, now.residual))]
    if case.held_out:
        left.append(np.sqrt(holdout.held_out_squares(standing.model, now.values, case.held_out)))
    return np.asarray(np.fmin.reduce(left) / case.noise)
