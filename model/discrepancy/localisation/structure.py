"""Whether what a model leaves of a record has a shape, or is noise of whatever size and colour.

Noise of a sensor does not know what the arm does: it is as large in one place, direction and second as in another, and
its mean is everywhere the same. A torque or a law that is missing goes with the motion, and is a slow signal, since an
arm's inertia stands between a torque and a reading.
Outliers are clipped, so that a few of them are no shape.
"""

from __future__ import annotations

import numpy as np

from model.arrays import Floats
from model.discrepancy.localisation.phases import Residuals
from model.discrepancy.localisation.statistics import LEAST, LONGEST_MEMORY, dependences, quantities
from model.fitting.whitening import fitted_whitener

LINE = 6.0
"""Significance, in standard deviations, from which a dependence is a shape. Of 3600 dependences of white and coloured
noise the largest had 5.8: tails are fatter than a Gaussian's, since the correlation is estimated as well."""
PREDICTABLE = 0.9
"""Share of a residual's variance that its own past may predict, if it is to be noise: of a sensor's noise below 3 Hz
it predicts two thirds, of what a missing torque leaves of a position nearly all."""
CLIP = 5.0
"""Robust standard deviations at which samples are clipped."""
GAUSSIAN = 1.4826
"""Standard deviation of Gaussian noise over its median distance from zero."""


def clipped(signal: Floats) -> Floats:
    """The signal (m,) without its outliers: `CLIP` robust standard deviations at most, no less than one unit each."""
    most = CLIP * max(1.0, GAUSSIAN * float(np.median(np.abs(signal))))
    return np.clip(signal, -most, most)


def joints_with_structure(residuals: Residuals | None) -> tuple[int, ...]:
    """Joints whose residual, or its square, depends on time, position, speed, direction or drive, or which is so slow
    that it is no noise of a sensor.

    The significance of a dependence takes into account that neighbouring samples are correlated
    (`statistics.binned`). None of no residuals.
    """
    if residuals is None:
        return ()
    known = quantities(residuals.motions)
    joints = residuals.model.machine.modelled_joints
    found = []
    for column, joint in enumerate(joints):
        signal = clipped(np.concatenate(list(residuals.signals))[:, column] / residuals.deviations[column])
        runs = [signal[stretch] for stretch in known.stretches]
        if _is_slow(runs):
            found.append(joint)
            continue
        mean_square = max(float(np.mean(signal**2)), LEAST**2)
        for tried in (signal, signal**2 / mean_square):
            if any(bins.significance > LINE for _, bins in dependences(tried, column, known, LEAST)):
                found.append(joint)
                break
    return tuple(found)


def _is_slow(runs: list[Floats]) -> bool:
    """Whether a residual's own past predicts more of it than it would of noise."""
    variance = float(np.mean(np.concatenate(runs) ** 2))
    innovation = float(fitted_whitener(runs, LONGEST_MEMORY, LEAST).deviations[-1]) ** 2
    return innovation < (1.0 - PREDICTABLE) * variance
