"""Noise as a record shows it, where it is not what the machine file states.

A file may state a sensor's noise too small, as white although it is slow, and never as readings that are far off now
and then. Least squares with the stated noise then follow the noise: priors count too little against it, and what the
fit has moved for it looks like an effect. Where a fit leaves more than the stated noise, and that has no shape
(`localisation.structure`), it is noise, and from there on records are weighed with it: an autoregression for each
joint (generalised least squares; Söderström and Stoica 1989, section 7.5).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from model.arrays import Floats
from model.discrepancy.grounds import Note
from model.discrepancy.localisation.residuals import Residuals
from model.discrepancy.localisation.structure import clipped, joints_with_structure
from model.discrepancy.output_error.observation import Observation, ShownNoise
from model.discrepancy.output_error.search import Point
from model.fitting.whitening import fitted_whitener
from model.machine_model.model import Model

LARGER = 1.15
"""Misfit above which a fit is said to leave more than the noise it was weighed with."""
LONGEST_MEMORY = 6
"""Largest order of the autoregression, samples."""


def shown_noise(point: Point) -> ShownNoise | None:
    """The noise that a point's residual shows; None where that is no more than what is stated, or where it has a
    shape."""
    observation = point.observation
    stated = float(np.mean(observation.in_deviations(point.residuals) ** 2))
    if stated < LARGER or joints_with_structure(residuals_of(point.fitted_model, observation, point.residuals)):
        return None
    known = replace(observation, noise=None)
    whiteners, sizes = [], []
    for runs in known.by_joint(known.in_deviations(point.residuals)):
        size = max(1.0, float(np.sqrt(np.mean(clipped(np.concatenate(runs)) ** 2))))
        whiteners.append(fitted_whitener(runs, LONGEST_MEMORY, 1.0))
        sizes.append(size)
    return ShownNoise(tuple(whiteners), np.array(sizes))


def residuals_of(model: Model, observation: Observation, signals: Sequence[Floats]) -> Residuals:
    """Residuals of an observation as their shape is looked for."""
    return Residuals(
        model=model,
        records=observation.records,
        signals=signals,
        deviations=observation.sizes,
        feedback_share=observation.prepared[0].following,
    )


def note_on_noise(observation: Observation, rms: Sequence[float], joints: Sequence[int]) -> tuple[Note, ...]:
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
