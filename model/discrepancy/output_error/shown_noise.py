"""Noise as a record shows it, where it is not what the machine file states.

A file may state a sensor's noise too small, as white although it is slow, and never as readings that are far off now
and then. Least squares with the stated noise then follow the noise: priors count too little against it, and what the
fit has moved for it looks like an effect. Where a fit leaves more than the stated noise, and that has no shape
(`localisation.structure`), it is noise, and from there on records are weighed with it: an autoregression for each
joint (generalised least squares; Söderström and Stoica 1989, section 7.5), without readings that lie apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from model.arrays import Floats
from model.discrepancy.grounds import Note
from model.discrepancy.localisation.residuals import Residuals
from model.discrepancy.localisation.structure import GAUSSIAN, joints_with_structure
from model.discrepancy.output_error.observation import Observation, ShownNoise, Signals
from model.discrepancy.output_error.search import Point
from model.fitting.whitening import fitted_whitener
from model.machine_model.model import Model

LARGER = 1.15
"""Misfit above which a fit is said to leave more than the noise it was weighed with."""
LONGEST_MEMORY = 6
"""Largest order of the autoregression, samples."""
FAR = 6.0
"""Standard deviations of the noise from which a reading lies apart: one of a hundred million, if noise is Gaussian."""
FOUR_NEIGHBOURS = np.array([-1.0, 4.0, 0.0, 4.0, -1.0]) / 6.0
"""Weights with which a reading follows from two on either side, exactly for a motion of constant jerk."""
GAIN = float(np.sqrt(1.0 + FOUR_NEIGHBOURS @ FOUR_NEIGHBOURS))
"""Standard deviation of a reading less that, in deviations of white noise."""


def shown_noise(point: Point) -> ShownNoise | None:
    """The noise that a point's residual shows; None where that is no more than what is stated, or where it has a
    shape."""
    observation = point.observation
    stated = float(np.mean(observation.in_deviations(point.residuals) ** 2))
    if stated < LARGER or joints_with_structure(residuals_of(point.fitted_model, observation, point.residuals)):
        return None
    known = replace(observation, noise=None, apart=readings_apart(observation, point.residuals))
    whiteners, sizes = [], []
    for runs in known.by_joint(known.in_deviations(point.residuals)):
        size = max(1.0, float(np.sqrt(np.mean(np.concatenate(runs) ** 2))))
        whiteners.append(fitted_whitener(runs, LONGEST_MEMORY, 1.0))
        sizes.append(size)
    return ShownNoise(tuple(whiteners), np.array(sizes))


def residuals_of(model: Model, observation: Observation, signals: Sequence[Floats]) -> Residuals:
    """Residuals of an observation as their shape is looked for."""
    return Residuals(
        model=model,
        records=observation.records,
        signals=observation.without_apart(signals),
        deviations=observation.sizes,
        feedback_share=observation.prepared[0].following,
    )


def with_noise(observation: Observation, noise: ShownNoise, signals: Signals) -> Observation:
    """The observation weighed with a noise, without the readings that lie apart. signals: a fit's residuals of it.

    Where the recorded drive is the input, the simulation is not given those readings either: what the real controller
    made of them is in the drive.
    """
    apart = readings_apart(observation, signals)
    weighed = replace(observation, noise=noise, apart=apart)
    if not observation.drive_is_input or not any(a.any() for a in apart):
        return weighed
    prepared = []
    for given, record, own in zip(observation.prepared, observation.records, apart, strict=True):
        readings = given.readings.copy()
        rows = np.round(record.inputs.rows).astype(np.int64)
        for column in range(readings.shape[1]):
            gone = rows[own[:, column]]
            kept = np.setdiff1d(np.flatnonzero(np.isfinite(readings[:, column])), gone)
            readings[gone, column] = np.interp(gone, kept, readings[kept, column])
        prepared.append(replace(given, readings=readings))
    return replace(weighed, prepared=tuple(prepared))


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
                "apart": sum(int(apart[:, column].sum()) for apart in observation.apart),
            }
        )
    return (Note(kind="larger-noise", values={"joints": found}),) if found else ()


def readings_apart(observation: Observation, signals: Signals) -> tuple[NDArray[np.bool_], ...]:
    """Readings (m, n) per record that lie `FAR` from what their neighbours say, and further than these do from theirs.
    What a fit leaves there (signals, rad) must be as far off.

    None of a joint that is sampled so slowly, for how fast it moves, that it may go there and back between two samples:
    one whose simulated motion somewhere lies as far from what its neighbours say.
    """
    found = []
    for record, signal in zip(observation.records, signals, strict=True):
        apart = np.zeros(signal.shape, dtype=np.bool_)
        for run in record.runs:
            for column, deviation in enumerate(observation.deviations):
                readings, left = (s[run, column] / deviation for s in (record.measured, signal))
                moves = _off_neighbours(readings - left)
                if np.any(moves > FAR * _robust(moves)):
                    continue
                own = _alone(readings)
                own &= np.abs(left) > FAR * _robust(left)
                apart[run, column] = own
        found.append(apart)
    return tuple(found)


def _alone(readings: Floats) -> NDArray[np.bool_]:
    """Which readings (m,), in deviations, lie apart from two neighbours on either side."""
    found = np.zeros(len(readings), dtype=np.bool_)
    off = _off_neighbours(readings)
    if not len(off):
        return found
    around = np.lib.stride_tricks.sliding_window_view(np.pad(off, 2), 5).max(axis=1)
    found[2:-2] = (off > FAR * GAIN * max(1.0, _robust(off) / GAIN)) & (off >= around)
    return found


def _off_neighbours(readings: Floats) -> Floats:
    """How far each reading (m,) but two at either end lies from what its neighbours say, (m − 4,)."""
    if len(readings) < len(FOUR_NEIGHBOURS):
        return np.zeros(0)
    return np.asarray(np.abs(readings[2:-2] - np.convolve(readings, FOUR_NEIGHBOURS, "valid")))


def _robust(signal: Floats) -> float:
    """Standard deviation of a signal without its outliers, at least one."""
    if not len(signal):
        return 1.0
    return max(1.0, GAUSSIAN * float(np.median(np.abs(signal))))
