"""The power amplifier and the warming of the winding it feeds."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.drives.piecewise import clamped, outside
from model.dynamics.compilation import internal
from model.machine_model import layout as at


@internal
def motor_volts(command: complex, joint: NDArray[Any]) -> Any:
    """Volts at the motor for commanded volts: dead zone, then the supply's limit."""
    return clamped(outside(command, joint[at.DEAD_ZONE]), joint[at.SUPPLY])


@internal
def warmed(rise: complex, volts: complex, speed: complex, period: complex, joint: NDArray[Any]) -> Any:
    """Relative rise of the winding's resistance one period later: heated by i², cooled with a time constant."""
    current = (volts - joint[at.BACK_EMF] * (1.0 + joint[at.BACK_EMF_ERROR]) * joint[at.GEAR] * speed) / (
        joint[at.RESISTANCE] * (1.0 + rise)
    )
    kept = np.exp(-period / joint[at.COOLING_TIME])
    return rise * kept + joint[at.HEATING] * current * current * joint[at.COOLING_TIME] * (1.0 - kept)
