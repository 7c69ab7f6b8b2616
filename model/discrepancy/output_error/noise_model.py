"""How well a residual is described as noise of its own kind: the yardstick by which candidates are compared.

What the right model leaves is nearly white: noise and rounding, and the little by which laws of friction differ near
zero speed. What a wrong model leaves is coloured. Each model is judged with an autoregression fitted to its own
residual, joint by joint, and by the likelihood of the prediction errors that are left, so that no model is rejected for
noise that another one's colour would make unlikely.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.fitting.whitening import Whitener, fitted_whitener

Floats = NDArray[np.float64]

LONGEST_MEMORY = 6
"""Samples that the noise model looks back: 0.12 s at 20 ms."""
LEAST_DEVIATION = 0.8
"""Of a prediction error, in deviations of a reading: rounding is not always as random as its variance says. No
likelihood counts an error as smaller, or a joint at rest would make evidence of shaving a rounding offset."""
PRICE_OF_MEMORY = 2.0
"""Of each sample that a noise model looks back: Akaike's, by which the order was chosen. Without it, a description
would jump by twelve where the choice is close, and with it a margin between rivals."""
CLIP = 5.0
"""Prediction errors beyond so many deviations count as that: one bad reading proves no effect."""


@dataclass(frozen=True)
class NoiseModel:
    """Colour and size of a residual, joint by joint.

    whiteners: a filter a joint. description: −2 ln likelihood of the prediction errors, up to a constant, and the price
    of memory. by_joint: its parts.
    """

    whiteners: tuple[Whitener, ...]
    by_joint: tuple[float, ...]

    @property
    def description(self) -> float:
        """−2 ln likelihood and the price of memory, all joints."""
        return sum(self.by_joint)


def noise_model(runs_by_joint: Sequence[Sequence[Floats]]) -> NoiseModel:
    """The noise model of a weighted residual, given as runs (m,) of every joint (`Observation.by_joint`)."""
    whiteners, parts = [], []
    for runs in runs_by_joint:
        whitener = fitted_whitener(runs, LONGEST_MEMORY, LEAST_DEVIATION)
        errors = np.concatenate([whitener.whitened(run) for run in runs])
        spread = float(np.sqrt(np.mean(np.clip(errors, -CLIP, CLIP) ** 2))) * float(whitener.deviations[-1])
        order = len(whitener.predictors) - 1
        parts.append(2 * len(errors) * float(np.log(max(spread, LEAST_DEVIATION))) + PRICE_OF_MEMORY * order)
        whiteners.append(whitener)
    return NoiseModel(tuple(whiteners), tuple(parts))
