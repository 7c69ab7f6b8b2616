"""Computes speeds and accelerations from sampled positions, with known noise and without smoothing bias.

A second difference of samples T apart is exactly the acceleration averaged over ±T with triangular weights. The model's
acceleration is averaged with the same weights, and both are smoothed with the same kernel. Smoothing then removes
detail and noise, but adds no error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from daq.contracts.errors import SpecError
from model.arrays import Floats

WIDTHS = tuple(float(w) for w in np.arange(0.5, 6.01, 0.25))
"""Standard deviations of the kernel that `chosen_width` tries, samples."""
TRUNCATION = 4.0
"""Half width of the kernel, in its standard deviations."""


def kernel(width: float) -> Floats:
    """Returns an odd number of Gaussian weights with sum 1; `width` is their standard deviation in samples."""
    reach = max(1, int(np.ceil(TRUNCATION * width)))
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    return np.asarray(weights / weights.sum())


def smoothed(signal: Floats, width: float) -> Floats:
    """Smooths columns of a signal (k, n), real or complex; beyond its ends the signal counts as constant."""
    weights = kernel(width)
    reach = len(weights) // 2
    padded = np.concatenate((np.repeat(signal[:1], reach, axis=0), signal, np.repeat(signal[-1:], reach, axis=0)))
    return np.stack([np.convolve(column, weights, mode="valid") for column in padded.T], axis=1)


def accelerations(position: Floats, period: float) -> Floats:
    """Returns second differences (k, n) of samples, zero at both ends: accelerations averaged over ±period."""
    result = np.zeros_like(position)
    result[1:-1] = (position[2:] - 2 * position[1:-1] + position[:-2]) / period**2
    return result


def speeds(position: Floats, period: float) -> Floats:
    """Returns speeds (k, n) averaged over ±period with the same triangular weights, zero at both ends.

    A central difference averages with equal weights; a third difference corrects them to triangular ones.
    """
    result = np.zeros_like(position)
    result[1:-1] = (position[2:] - position[:-2]) / (2 * period)
    third = position[4:] - 2 * position[3:-1] + 2 * position[1:-3] - position[:-4]
    result[2:-2] -= third / (24 * period)
    return result


@dataclass(frozen=True)
class NoiseGain:
    """Standard deviation of speed and acceleration for white position noise of standard deviation 1."""

    speed: float
    acceleration: float


def noise_gain(width: float, period: float) -> NoiseGain:
    """Returns the noise of derivatives with this smoothing."""
    weights = np.pad(kernel(width), 4)[:, None]
    return NoiseGain(
        float(np.sqrt((speeds(weights, period) ** 2).sum())),
        float(np.sqrt((accelerations(weights, period) ** 2).sum())),
    )


def chosen_width(position: Floats, deviation: Floats, period: float, share: float) -> float:
    """Returns the least smoothing (samples) with which noise is below `share` of every moving joint's acceleration, in
    rms.

    Args:
        position: (k, n). deviation: (n,) standard deviation of the position's noise.

    Raises SpecError if no joint moves.
    """
    for width in WIDTHS:
        signal = accelerations(smoothed(position, width), period)
        noise = deviation * noise_gain(width, period).acceleration
        power = (signal**2).mean(axis=0) - noise**2
        moving = power > noise**2
        if moving.any() and (noise[moving] <= share * np.sqrt(power[moving])).all():
            return width
    if not moving.any():
        raise SpecError("no joint accelerates beyond the noise of its readings, so there is nothing to explain")
    return WIDTHS[-1]
