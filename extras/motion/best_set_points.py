"""Finds the set points whose linear response comes nearest to a motion, within limits, and rounds them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from extras.motion.posture_units import Allowed
from extras.motion.response import Response
from model.arrays import Floats, Mask

ROUGHNESS = 0.01
"""Weight of a correction's squared second difference relative to the squared error. It keeps set points smooth at
frequencies that hardly reach the arm, where a model is least certain."""
RELAXATION = 1.6
"""Over-relaxation of the alternating directions (Boyd et al. 2011, section 3.4.3, recommend 1.5 to 1.8)."""
MOST_STEPS = 300
"""Most steps of the alternating directions; rounding then removes any remaining violation of a limit."""
NEAR = 0.01
"""Violation of a limit, in posture units, that counts as none."""
HELD_WITHIN = 0.75
"""Largest distance, in posture units, at which a set point is held instead of rounded."""
SHARE_OF_RESPONSE = 0.1
"""Weight of the limits in the alternating directions, as a share of the mean square response."""
_NEIGHBOURS = np.array([-1.0, 0.0, 1.0])


@dataclass(frozen=True)
class Task:
    """A joint's optimisation problem, all arrays (k,) in posture units.

    Args:
        wanted: the motion. plain: the set points of the motion itself. now: those about which the response holds.
        reached: readings with the set points `now`. caution: weight of the squared change from `now`.
    """

    wanted: Floats
    plain: Floats
    now: Floats
    reached: Floats
    caution: float


def best_set_points(task: Task, response: Response, allowed: Allowed) -> Floats:
    """Returns set points (k,), not rounded: least squares of error, roughness and change, within the limits.

    Limits are imposed by the alternating direction method of multipliers (Boyd et al. 2011, Foundations and Trends in
    Machine Learning 3(1)), whose every step is one solution of the same banded equations.
    """
    count = len(task.now)
    normal = response.normal()
    size = float(normal[0].mean())
    matrix = _padded(normal, 3)
    matrix[:3] += ROUGHNESS * _second_differences(count)
    matrix[0] += task.caution
    ahead = task.wanted - task.reached + response.applied(task.now)
    rough = _times(_second_differences(count), task.plain)
    aim = response.transposed(ahead) + ROUGHNESS * rough + task.caution * task.now
    low = np.maximum(allowed.low, task.reached - allowed.ahead)
    high = np.minimum(allowed.high, task.reached + allowed.ahead)
    low = np.minimum(low, high)
    low[0] = high[0] = task.now[0]
    return _within(matrix, aim, (low, high), allowed.step, SHARE_OF_RESPONSE * size, task.now)


def _within(
    matrix: Floats, aim: Floats, box: tuple[Floats, Floats], step: float, weight: float, start: Floats
) -> Floats:
    """Returns the minimum of ½ xᵀ matrix x − aimᵀ x within the box and with differences of at most `step`."""
    both = matrix.copy()
    both[0] += 3.0 * weight  # of I + DᵀD, where D is the difference operator
    both[0, [0, -1]] -= weight
    both[1, :-1] -= weight
    factor = cholesky_banded(both, lower=True)
    x = start
    limit, change = np.clip(x, *box), np.clip(np.diff(x), -step, step)
    push, push_change = np.zeros_like(x), np.zeros(len(x) - 1)
    for _ in range(MOST_STEPS):
        towards = weight * (limit - push)
        apart = weight * (change - push_change)
        towards[1:] += apart
        towards[:-1] -= apart
        x = cho_solve_banded((factor, True), aim + towards)
        mixed = RELAXATION * x + (1 - RELAXATION) * limit
        mixed_change = RELAXATION * np.diff(x) + (1 - RELAXATION) * change
        before = limit
        limit, change = np.clip(mixed + push, *box), np.clip(mixed_change + push_change, -step, step)
        push, push_change = push + mixed - limit, push_change + mixed_change - change
        apart_now = max(np.abs(x - limit).max(), np.abs(np.diff(x) - change).max(initial=0.0))
        if apart_now < NEAR and np.abs(limit - before).max() < NEAR:
            break
    return limit


def _second_differences(count: int) -> Floats:
    """Returns the lower band (3, k) of DᵀD, where D is the second difference operator."""
    band = np.zeros((3, count))
    if count < 3:
        return band
    for offset, a in enumerate((1.0, -2.0, 1.0)):
        band[0, offset : count - 2 + offset] += a * a
    band[1, : count - 2] += -2.0
    band[1, 1 : count - 1] += -2.0
    band[2, : count - 2] += 1.0
    return band


def _times(band: Floats, x: Floats) -> Floats:
    """Multiplies x by a symmetric banded matrix, given by its lower band."""
    found = band[0] * x
    for d in range(1, min(len(band), len(x))):
        found[d:] += band[d, :-d] * x[:-d]
        found[:-d] += band[d, :-d] * x[d:]
    return np.asarray(found)


def _padded(band: Floats, rows: int) -> Floats:
    return np.concatenate([band, np.zeros((max(0, rows - len(band)), band.shape[1]))])


def rounded_set_points(
    wanted: Floats, response: Response, allowed: Allowed, effective: Floats, held: Mask | None = None
) -> Floats:
    """Returns whole posture units (k,) whose response is nearest to that of `wanted` (k,), as far as one pass finds
    them.

    effective: value of each posture unit for the controller, whose counts may be coarser or finer.
    held: periods (k,) in which the set point stays at the previous one if that is near enough.

    Each set point is rounded given the errors of those before it, so that their effects on the arm cancel: decision
    feedback, Babai's nearest plane (1986, Combinatorica 6).
    """
    count = len(wanted)
    normal = response.normal()
    normal[0] += ROUGHNESS * float(normal[0].mean())
    reach = len(normal)
    turned = np.zeros_like(normal)  # time is reversed, so that the last unknown solved for is the last period
    for d in range(min(reach, count)):
        turned[d, : count - d] = normal[d, : count - d][::-1]
    factor = cholesky_banded(turned, lower=True)
    chosen, error = np.empty(count), np.zeros(count + reach)
    before = chosen[0] = round(wanted[0])
    error[count - 1] = wanted[0] - effective[int(before)]
    for i in range(1, count):
        row = count - 1 - i
        column = factor[:, row]
        aim = wanted[i] + float(column[1:] @ error[row + 1 : row + reach]) / column[0]
        low, high = max(allowed.low, before - allowed.step), min(allowed.high, before + allowed.step)
        near = np.clip(np.floor(aim + 0.5) + _NEIGHBOURS, low, high).astype(np.int64)
        if held is None or not held[i] or abs(effective[int(before)] - wanted[i]) > HELD_WITHIN:
            before = near[np.abs(effective[near] - aim).argmin()]
        chosen[i] = before
        error[row] = wanted[i] - effective[int(before)]
    return chosen
