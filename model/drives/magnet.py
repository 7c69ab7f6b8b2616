"""A DC motor's two constants. Both are proportional to the flux of its magnet, so they weaken together."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from model import layout as at
from model.dynamics.compilation import inlined


@inlined
def torque_constant(joint: NDArray[Any]) -> Any:
    """Returns N·m/A, with the remaining flux."""
    return joint[at.TORQUE_CONSTANT] * (1.0 - joint[at.FLUX_LOSS])


@inlined
def back_emf_constant(joint: NDArray[Any]) -> Any:
    """Returns V·s/rad, with the remaining flux."""
    return joint[at.BACK_EMF] * (1.0 - joint[at.FLUX_LOSS])
