"""Set points with every phase of motion, and records of an arm that is the model itself, with an effect or without."""

import numpy as np

from daq.contracts.trace import Trace
from model.arrays import Floats
from model.machine_model.model import Model
from tests.model.fitting import imagined

HOME = np.array([3.1, 0.9, -0.4])
"""rad: a posture of joints 1-3 with gravity on joint 2."""
PERIOD = imagined.PERIOD


def legs(*parts: tuple[float, float]) -> Floats:
    """A path (k,) from legs of (seconds, distance in rad) one after the other, from zero."""
    path = [0.0]
    for seconds, distance in parts:
        count = round(seconds / PERIOD)
        path.extend(path[-1] + distance * np.arange(1, count + 1) / count)
    return np.array(path)


def every_phase(seconds: float = 20.0) -> Floats:
    """Set points (k, 3): rest, ramps there and back, slow reversals, fast reversals, the joints shifted in time."""
    slow, fast = 0.1, 0.36
    own = legs(
        (0.6, 0.0),
        (0.65, 0.377),
        (0.8, 0.0),
        (0.65, -0.377),
        (0.8, 0.0),
        (2.0, slow),
        (2.0, -slow),
        (2.0, slow),
        (2.0, -slow),
        (0.6, 0.0),
        (0.5, fast),
        (0.5, -fast),
        (0.5, fast),
        (0.5, -fast),
        (0.8, 0.0),
        (0.6, -0.3),
        (0.6, 0.0),
        (0.6, 0.3),
    )
    count = round(seconds / PERIOD)
    columns = [np.concatenate([np.zeros(shift), own])[:count] for shift in (0, 25, 50)]
    padded = [np.concatenate([c, np.full(count - len(c), c[-1])]) for c in columns]
    return np.asarray(HOME + np.stack(padded, axis=1))


def trace_of(model: Model, seconds: float = 20.0, seed: int = 0) -> Trace:
    """A record of `model` as the arm on `every_phase`."""
    return imagined.trace(model, seed=seed, points=every_phase(seconds))
