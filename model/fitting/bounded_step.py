"""Computes the step of a Gauss–Newton or Levenberg–Marquardt search within bounds."""

from __future__ import annotations

import numpy as np

from model.arrays import Floats


def bounded_step(curvature: Floats, descent: Floats, low: Floats, high: Floats) -> Floats:
    """Returns the step (p,) that minimises ½ sᵀ A s − dᵀ s within bounds.

    Unknowns that the step would take over a bound stop at the bound and are held there; the others are then solved for
    again. Cutting the first step off instead would spoil the descent of the others.

    Args:
        curvature: A (p, p), symmetric and positive definite: the damped information.
        descent: d (p,), minus the gradient.
        low, high: (p,) distances to the bounds, low ≤ 0 ≤ high.
    """
    step = np.zeros_like(descent)
    held = np.zeros(len(descent), dtype=bool)
    while not held.all():
        free = ~held
        pull = descent[free] - curvature[np.ix_(free, held)] @ step[held]
        step[free] = np.linalg.solve(curvature[np.ix_(free, free)], pull)
        outside = free & ((step < low) | (step > high))
        if not outside.any():
            break
        step[outside] = np.clip(step, low, high)[outside]
        held |= outside
    return step
