"""What is left over where a diagnosis ends: joints with more than noise, and the steps that this contradicts."""

from __future__ import annotations

from collections.abc import Sequence, Set

import numpy as np

from model.arrays import Floats
from model.discrepancy.diagnosis import RemainingShape, Step
from model.discrepancy.inverse_dynamics import holdout
from model.discrepancy.inverse_dynamics.fitting import BalanceFit
from model.discrepancy.inverse_dynamics.localisation import ANOTHER_LAW, bends_with_speed, remaining_shapes
from model.discrepancy.inverse_dynamics.priors import prior_distance
from model.discrepancy.inverse_dynamics.standing import Standing
from model.effects.library import find_named_effect
from model.machine_model.record_verdict import FAR_OFF

FAR_ABOVE_NOISE = 10.0
"""Residual torque, in deviations of noise, that is taken for something missing even where no shape of it is found:
friction at a place, for one, depends on neither position nor direction alone. Sound rigs of other worlds leave up to
2.6, where friction turns (docs/how-well.md)."""
SHAPED_ABOVE_NOISE = 3.0
"""The same where a shape explains much of it (`ANOTHER_LAW`): the shape says as well that something is missing."""
LONG_MEMORY = 4.0
"""Memory of a residual, in samples, beyond which it is slower than noise. White noise of a drive comes to 1.9 behind
the low-pass, that of accelerations to 2.7."""
VISCOUS = "viscous_friction"
PART_OF_IT = 0.3
"""Least share of what is left that friction which goes with the place explains, where another law was named."""
FRICTION = "friction"
"""The family of effects that rub."""
SENSOR = "sensor"
"""The family of a position sensor's errors."""


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


def _noises_left(standing: Standing) -> Floats:
    """(n,) what fitted and held-out records leave at least, in noise floors: a record in which a joint rests says
    nothing of it."""
    case, now = standing.case, standing.now
    left = [np.sqrt(holdout.mean_squares(case.stretches, now.residual))]
    if case.held_out:
        left.append(np.sqrt(holdout.held_out_squares(standing.model, now.values, case.held_out)))
    return np.asarray(np.fmin.reduce(left) / case.noise)


def first_contradicted(standing: Standing, lowered: Set[str]) -> int | None:
    """Index of the first step that the residual contradicts; None where there is none.

    Args:
        lowered: names of numbers that the file states and that steps have lowered.
    """
    shapes, left = remaining_shapes(standing.now, standing.case), set(joints_left_over(standing))
    starved = left & _starved(standing.now)
    for index, step in enumerate(standing.steps):
        joints = left & set(step.joints) if step.adopted else ()
        lowers = bool(lowered & set(step.parameters))
        if any(
            lowers
            or _bends(standing.steps, step, j, shapes)
            or rubs_elsewhere(step, j, shapes)
            or (j in starved and _is_of(step, FRICTION))
            for j in joints
        ):
            return index
    return None


def _starved(now: BalanceFit) -> set[int]:
    """The joints of which the fit has lowered a friction far below what is expected of it."""
    friction = [u for u in now.unknowns if _family(u.parameter.effect) == FRICTION and u.parameter.deviation]
    stated = [u.as_stated for u in friction if u.low >= 0.0 and u.as_stated.expected > 0.0]
    far = [u for u in stated if prior_distance(u, now.values[u.name])[0] <= -FAR_OFF]
    return {joint for u in far for joint in u.parameter.joints}


def rubs_elsewhere(step: Step, joint: int, shapes: Sequence[RemainingShape]) -> bool:
    """Whether a step names friction or a sensor where friction is left that goes with the place: a tight spot looks
    like more friction everywhere, and like a bent sensor."""
    if not _is_of(step, FRICTION, SENSOR):
        return False
    return any(s.joint == joint and s.against_motion and s.explained >= PART_OF_IT for s in shapes)


def _is_of(step: Step, *families: str) -> bool:
    """Whether a step names an effect of one of some families."""
    return step.effect is not None and _family(step.effect) in families


def _family(effect: str | None) -> str | None:
    return None if effect is None else find_named_effect(effect).shared_name.family


def _bends(steps: Sequence[Step], step: Step, joint: int, shapes: Sequence[RemainingShape]) -> bool:
    """Whether a step is viscous friction, the only friction named on a joint, and another law is left there."""
    return step.effect == VISCOUS and _only_viscous(steps, joint) and bends_with_speed(shapes, joint)


def _only_viscous(steps: Sequence[Step], joint: int) -> bool:
    """Whether viscous friction is the only friction that was named on a joint."""
    named = {s.effect for s in steps if s.adopted and joint in s.joints and s.effect is not None}
    return {name for name in named if _family(name) == FRICTION} == {VISCOUS}
