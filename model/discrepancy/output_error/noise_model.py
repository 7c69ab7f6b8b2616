"""How well a residual is described as noise of its own kind: the yardstick by which candidates are compared.

The right model leaves nearly white noise: noise of the readings and rounding, and the little by which laws of friction
differ near zero speed. A wrong model leaves a coloured residual. An autoregression is fitted to each residual, joint by
joint, and the likelihood of its prediction errors is compared, so that no model is rejected for noise that the colour
of another model's residual would make unlikely.

An autoregression describes what is smooth in any case, of whatever size: sampled at 200 Hz, a residual of seventy
counts that inertia has smoothed leaves prediction errors of one. No sensor's noise is like that. So a residual counts
as noise no more predictable than `structure.PREDICTABLE`; the rest is taken for what it is, an error of the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from model.arrays import Floats
from model.discrepancy.localisation.structure import PREDICTABLE, clipped
from model.fitting.whitening import Whitener, fitted_whitener

LONGEST_MEMORY = 6
"""Largest order of the autoregression in samples: 0.12 s at 20 ms."""
LEAST_DEVIATION = 0.8
"""Lower bound of a prediction error's deviation, in deviations of a reading, so that a joint at rest gains no evidence
by fitting its rounding offset: rounding is not always as random as its variance says."""
PRICE_OF_MEMORY = 2.0
"""Cost of each order of the autoregression: Akaike's, by which the order was chosen. Without it, the description would
jump by twelve where two orders are close, and the margin between rivals with it."""
CLIP = 5.0
"""Prediction errors are clipped to this many deviations, so that one bad reading proves no effect."""


@dataclass(frozen=True)
class AutoregressiveNoise:
    """Colour and size of a residual, joint by joint.

    whiteners: one filter per joint. by_joint: −2 ln likelihood of each joint's prediction errors, up to a constant, and
    the price of the order.
    """

    whiteners: tuple[Whitener, ...]
    by_joint: tuple[float, ...]

    @property
    def description(self) -> float:
        """−2 ln likelihood and the price of the orders, all joints."""
        return sum(self.by_joint)


def fit_noise_model(runs_by_joint: Sequence[Sequence[Floats]]) -> AutoregressiveNoise:
    """The noise model of a weighted residual, given as runs (m,) of every joint (`Observation.by_joint`)."""
    whiteners, parts = [], []
    for runs in runs_by_joint:
        whitener = fitted_whitener(runs, LONGEST_MEMORY, LEAST_DEVIATION)
        errors = np.concatenate([whitener.whitened(run) for run in runs])
        spread = float(np.sqrt(np.mean(np.clip(errors, -CLIP, CLIP) ** 2))) * float(whitener.deviations[-1])
        order = len(whitener.predictors) - 1
        whole = float(np.sqrt((1.0 - PREDICTABLE) * np.mean(clipped(np.concatenate(list(runs))) ** 2)))
        parts.append(2 * len(errors) * float(np.log(max(spread, whole, LEAST_DEVIATION))) + PRICE_OF_MEMORY * order)
        whiteners.append(whitener)
    return AutoregressiveNoise(tuple(whiteners), tuple(parts))
