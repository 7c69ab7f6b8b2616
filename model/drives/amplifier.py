"""The power amplifier, and the warming of its winding."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from model import layout as at
from model.drives.piecewise import clamped, outside, passed
from model.dynamics.compilation import borrowing, inlined
from model.dynamics.wide_numbers import exponential


@borrowing
def motor_volts(command: complex, joint: NDArray[Any]) -> Any:
    """Returns volts at the motor for commanded volts: threshold, dead zone, then the supply's limit."""
    return clamped(outside(passed(command, joint[at.THRESHOLD]), joint[at.DEAD_ZONE]), joint[at.SUPPLY])


@borrowing
def warmed(
    rise: Any, hot: Any, volts: Any, begun: Any, ended: Any, mean: Any, duration: Any, joint: NDArray[Any]
) -> Any:
    """Returns the relative rise of the winding's resistance after `duration` s at constant volts.

    It is heated by i² and cooled with a time constant. i is the settled current for the joint's speeds at the
    beginning, at the end and on average, through a winding with the rise `hot` meanwhile. The mean of i² is the square
    of its mean plus the variance of a linearly changing current.
    """
    resistance = joint[at.RESISTANCE] * (1.0 + hot)
    back_emf = back_emf_constant(joint) * joint[at.GEAR]
    current = (volts - back_emf * mean) / resistance
    change = back_emf * (ended - begun) / resistance
    kept = exponential(-duration / joint[at.COOLING_TIME])
    heat = joint[at.HEATING] * (current * current + change * change / 12.0)
    return rise * kept + heat * joint[at.COOLING_TIME] * (1.0 - kept)


@borrowing
def risen(time: Any, joint: NDArray[Any]) -> Any:
    """Returns the relative rise of the winding's resistance over `time` s that does not depend on the current."""
    if joint[at.TIMED_RISE] == 0.0:
        return 0.0 * time
    return joint[at.TIMED_RISE] * (1.0 - exponential(-time / joint[at.RISING_TIME]))


# --- A DC motor's two constants. Both are proportional to the flux of its magnet, so they weaken together


@inlined
def torque_constant(joint: NDArray[Any]) -> Any:
    """Returns N·m/A, with the remaining flux."""
    return joint[at.TORQUE_CONSTANT] * (1.0 - joint[at.FLUX_LOSS])


@inlined
def back_emf_constant(joint: NDArray[Any]) -> Any:
    """Returns V·s/rad, with the remaining flux."""
    return joint[at.BACK_EMF] * (1.0 - joint[at.FLUX_LOSS])
