"""The step of a Gauss–Newton or Levenberg–Marquardt search within bounds."""

from __future__ import annotations

import numpy as np

from model.arrays import Floats


def bounded_step(curvature: Floats, descent: Floats, low: Floats, high: Floats) -> Floats:
    """The step (p,) that minimises ½ sᵀ A s − dᵀ s with the unknowns that meet a bound held at it.

    Unknowns that the step would take over a bound go to the bound and stay there; the others are solved for again and
    take that into account. Cutting such a step off instead would spoil the descent of all others.

    Args:
        curvature: A (p, p), symmetric and positive definite: the damped information. descent: d (p,), minus the
            gradient. low, high: (p,) what is left to the bounds, low ≤ 0 ≤ high.
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
