"""Σλ² of the distortion method from residuals and derivatives that a diagnosis has anyway, without simulations.

Near a minimum the squared error grows with the square of a change of one parameter, E = |r|² + α² |∂r/∂θ|², so it
doubles at α = |r| / |∂r/∂θ| (4.63). `model.validation.fidelity` finds the same change by simulations, also where the
error is no parabola any more.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from daq.contracts.errors import SpecError
from model.arrays import Floats
from model.machine_model.model import Model
from model.validation.criterion import DAMPING_RATIO, contribution, required_deviation
from model.validation.expected_deviation import Convention, expected_deviation


def sum_of_contributions(
    model: Model,
    names: Sequence[str],
    residual: Floats,
    derivatives: Floats,
    *,
    convention: Convention = "source",
    damping_ratio: float = DAMPING_RATIO,
) -> float:
    """Σλ² (4.92): at 1 or more, parameters that deviate as much as is expected of them explain the residual.

    Names that are no parameters of the model, and parameters of which no deviation is expected, do not count.

    Args:
        residual: (N,) over all samples and joints, in any weighting. derivatives: (p, N) by the p names, in the same.
    """
    size = float(np.linalg.norm(residual))
    total = 0.0
    for name, slope in zip(names, derivatives, strict=True):
        if name not in model.by_name:
            continue
        try:
            expected, _ = expected_deviation(model.by_name[name], convention)
        except SpecError:
            continue
        steep = float(np.linalg.norm(slope))
        required = required_deviation(size / steep, damping_ratio) if steep > 0 and size > 0 else None
        total += contribution(required, expected)
    return total
