"""Records of one sliding joint whose drive a test writes itself: the motion is a sum of sines, and takes no part."""

import numpy as np

from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.inverse_dynamics.recorded_motion import RecordedMotion, recorded_motion
from tests.model.discrepancy.inverse_dynamics.rigs import slide_machine, trace_of

PERIOD, CUTOFF = 0.004, 6.0
TIME: Floats = np.arange(2000, dtype=np.float64) * PERIOD


def controlled(period: float = PERIOD) -> Machine:
    """The slide, with a controller that holds its drive for a period."""
    written = slide_machine().model_dump(mode="json", exclude_none=True)
    second = {"unit": "s", "source": "test"}
    written["controller"] = {
        "kind": "pid",
        "period": {"value": period, **second},
        "delay": {"value": 0.0, **second},
        "gains": [[8000.0, 0.0, 500.0]],
    }
    return Machine.model_validate(written)


def slide_of(drive: Floats) -> Trace:
    """A trace (k, 1) of the slide with this drive (k,)."""
    place = 0.1 * np.sin(1.3 * TIME) + 0.05 * np.sin(4.1 * TIME + 1.0)
    speed = 0.13 * np.cos(1.3 * TIME) + 0.205 * np.cos(4.1 * TIME + 1.0)
    noise = 1e-6 * np.random.default_rng(3).standard_normal((2, len(TIME)))
    return trace_of("made", TIME, (place + noise[0])[:, None], drive[:, None], "N", (speed + noise[1])[:, None])


def motion_of(drive: Floats, machine: Machine | None = None, cutoff: float = CUTOFF) -> RecordedMotion:
    """The recorded motion of the slide with this drive (k,)."""
    return recorded_motion(slide_of(drive), machine or slide_machine(), cutoff)
