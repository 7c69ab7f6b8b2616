"""How well a residual is described as noise of its own kind, and noise as a record shows it.

The right model leaves nearly white noise: noise of the readings and rounding, and the little by which laws of friction
differ near zero speed. A wrong model leaves a coloured residual. An autoregression is fitted to each residual, joint by
joint, and the likelihood of its prediction errors is compared, so that no model is rejected for noise that the colour
of another model's residual would make unlikely.

An autoregression describes what is smooth in any case, of whatever size: sampled at 200 Hz, a residual of seventy
counts that inertia has smoothed leaves prediction errors of one. No sensor's noise is like that. So a residual counts
as noise no more predictable than `structure.PREDICTABLE`; the rest is taken for what it is, an error of the model.

A file may state a sensor's noise too small, as white although it is slow, and never as readings that are far off now
and then. Least squares with the stated noise then follow the noise: priors count too little against it, and what the
fit has moved for it looks like an effect. Where a fit leaves more than the stated noise, and that has no shape
(`localisation.structure`), it is noise, and from there on records are weighed with it: an autoregression for each
joint (generalised least squares; Söderström and Stoica 1989, section 7.5).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from model.arrays import Floats
from model.discrepancy.grounds import Note
from model.discrepancy.localisation.structure import CLIP, PREDICTABLE, clipped
from model.discrepancy.readings.observation import Observation, ShownNoise
from model.fitting.whitening import Whitener, fitted_whitener

LONGEST_MEMORY = 6
"""Largest order of the autoregression in samples: 0.12 s at 20 ms."""
LEAST_DEVIATION = 0.8
"""Lower bound of a prediction error's deviation, in deviations of a reading, so that a joint at rest gains no evidence
by fitting its rounding offset: rounding is not always as random as its variance says."""
PRICE_OF_MEMORY = 2.0
"""Cost of each order of the autoregression: Akaike's, by which the order was chosen. Without it, the description would
jump by twelve where two orders are close, and the margin between rivals with it."""


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


LARGER = 1.15
"""Misfit above which a fit is said to leave more than the noise it was weighed with: it has not explained the record,
and may have ended in a wrong minimum."""


def shown_noise(by_joint: Sequence[Sequence[Floats]]) -> ShownNoise:
    """The noise that a residual shows: runs (m,) of every joint in stated deviations."""
    whiteners, sizes = [], []
    for runs in by_joint:
        sizes.append(max(1.0, float(np.sqrt(np.mean(clipped(np.concatenate(list(runs))) ** 2)))))
        whiteners.append(fitted_whitener(runs, LONGEST_MEMORY, 1.0))
    return ShownNoise(tuple(whiteners), np.array(sizes))


def note_on_noise(observation: Observation, rms: Floats, joints: Sequence[int]) -> tuple[Note, ...]:
    """A note on joints whose readings are noisier than the machine file states; none where there are none.

    Args:
        observation: with the noise that it is weighed with, where that is not the stated one. rms: of each joint's
            residual, rad. joints: those on which more is left than noise, without any shape.
    """
    found = []
    for column, joint in enumerate(observation.machine.modelled_joints):
        stated = float(observation.deviations[column])
        size = max(float(observation.sizes[column]), float(rms[column]) if joint in joints else 0.0)
        if size**2 < LARGER * stated**2:
            continue
        counts = observation.machine.joint(joint).sensor is not None
        unit = float(observation.unit[column]) if counts else 1.0
        found.append(
            {
                "joint": joint,
                "size": size / unit,
                "stated": stated / unit,
                "unit": "count" if counts else observation.units[column],
            }
        )
    return (Note(kind="larger-noise", values={"joints": found}),) if found else ()
