"""Noise floor of the time-domain form: the residual (rad/s²) of records that the model itself makes.

It has three causes, and only the first follows from a formula.

1. Differentiation and the model's dependence on speed amplify noise and rounding of the readings
  (`measured_motion.smooth`).
2. Between two samples the drive steps and the speed differs from that of the samples.
3. At a reversal friction changes sign, and one count of noise changes the time.

The model therefore simulates the record's set points with drawn noise and rounded readings. The same differentiation is
applied to the result.
"""

from __future__ import annotations

import numpy as np

from daq.contracts.errors import DaqError
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.machine_model.model import Model
from model.record_check.replicas import SEED, made_by
from model.validation.acceleration_model import expected_accelerations
from model.validation.measured_motion import SmoothedTrace, smooth_motion

FEWEST, MOST = 12, 40
"""Least and largest number of replicas of a record."""
SECONDS = 400.0
"""Total length of motion (s) of a record's replicas: in a short record friction changes sign only a few times."""


def noise_floor(model: Model, trace: Trace, smoothed: SmoothedTrace) -> tuple[Floats, bool]:
    """Returns the root mean square (n,) of each joint's acceleration residual for a right model, rad/s² (m/s²).

    It is the median over simulated records. The second value is whether they could be simulated. If not, and for joints
    that do not move in them, the floor is only the noise of the readings, as in `smoothed`.
    """
    smoothing = smoothed.motion.width * smoothed.motion.period
    rng = np.random.default_rng(SEED)
    replicas = int(np.clip(SECONDS / (trace.time[-1] - trace.time[0]), FEWEST, MOST))
    sizes = np.zeros((replicas, model.joint_count))
    try:
        for replica in sizes:
            own = smooth_motion(model, made_by(model, trace, rng), smoothing)
            left = np.where(own.usable, own.acceleration - expected_accelerations(model, own.motion, ())[0], 0.0)
            replica[:] = np.sqrt((left**2).sum(axis=0) / np.maximum(own.usable.sum(axis=0), 1))
    except DaqError:
        return smoothed.noise, False
    median = np.median(sizes, axis=0)
    return np.where(median > 0, median, smoothed.noise), True
