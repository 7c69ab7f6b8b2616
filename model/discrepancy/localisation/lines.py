"""Whether a signal holds a tone: one frequency in time, or one wavelength over a joint's position.

An autoregression describes a tone as well as it describes noise, and filters it away. Noise of a smooth spectrum has
ordinates that are exponentially distributed about it, and hence a largest one that is known (Fisher 1929; Percival and
Walden 1993, section 10.9): what is far above that is a line.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq

from model.arrays import Floats
from model.fitting.whitening import Whitener, fitted_whitener

HALF = 12
"""Ordinates on either side from whose median the spectrum under a line is taken."""
LOWEST = 2
"""Periods in a record, or waves over a travel, from which a tone is one: less is a drift or a spring."""
MOST_WAVES = 128
"""Most waves over the travel of a joint that are looked for."""
LONGEST_MEMORY = 12
"""Largest order, in samples, of the autoregression that whitens a signal before waves over position are looked for."""
FAST = 0.99
"""Quantile of the distance from sample to sample that is a joint's fastest motion: set points may step at once."""
BLOCK = 2_000_000
"""Samples of waves in memory at a time: 64 MB."""


def has_line_over_time(runs: Sequence[Floats], false_rate: float, floor: float) -> bool:
    """Whether a signal, in uninterrupted runs (m,) of equal samples, holds a frequency that its noise does not.

    Each run is looked at by itself, since a disturbance has another phase in every record. The signal is filtered by an
    autoregression of first order, which has no peak inside the band, so that slow noise has nearly a flat spectrum.

    Args:
        false_rate: probability with which Gaussian noise of a smooth spectrum is said to hold one.
        floor: least standard deviation of the signal's noise.
    """
    flat = fitted_whitener(runs, 1, floor)
    spectra = [_periodogram(flat.whitened(run)) for run in runs]
    spectra = [s for s in spectra if len(s) > 2 * HALF]
    ordinates = sum(len(s) for s in spectra)
    if not ordinates:
        return False
    line = line_over_median(false_rate / ordinates)
    return any(bool(np.any(s > line * _running_median(s))) for s in spectra)


def has_line_over_position(
    runs: Sequence[Floats], positions: Sequence[Floats], false_rate: float, floor: float
) -> bool:
    """Whether a signal, in uninterrupted runs (m,), holds a wave over position, (m,) per run and without noise.

    Signal and waves are filtered by the signal's own autoregression; the share of the signal that a wave then takes
    is exponentially distributed. `false_rate` and `floor` as over time.
    """
    travel = float(np.ptp(np.concatenate(list(positions))))
    waves = np.arange(LOWEST, _most_waves(positions, travel) + 1)
    if not len(waves):
        return False
    whitener = fitted_whitener(runs, LONGEST_MEMORY, floor)
    left = _joined(whitener, runs)
    size = float(np.mean(left**2))
    if size == 0.0:
        return False
    line = float(np.log(len(waves) / false_rate))
    for some in np.array_split(waves, -(-len(waves) * len(left) // BLOCK)):
        phases = [2 * np.pi / travel * position[:, None] * some for position in positions]
        cosine, sine = (_joined(whitener, [wave(p) for p in phases]) for wave in (np.cos, np.sin))
        if np.any(_explained(left, cosine, sine) > 2.0 * size * line):
            return True
    return False


def line_over_median(probability: float) -> float:
    """Ratio to the median of an ordinate and its `HALF` neighbours on either side that it exceeds with a probability.

    Of 2 h other ordinates, all exponential, the median of all is then the h + 1st smallest, a sum of independent
    exponentials of rates 2 h to h (Rényi 1953); the probability is its Laplace transform.
    """
    rates = np.arange(HALF, 2 * HALF + 1)

    def beyond(ratio: float) -> float:
        return float(np.log(probability) + np.sum(np.log1p(ratio / rates)))

    return float(brentq(beyond, 0.0, 1e6))


def _periodogram(run: Floats) -> Floats:
    """Ordinates of a run (m,) from `LOWEST` periods up, without that of half the sampling rate."""
    spectrum = np.abs(np.fft.rfft(run - run.mean())) ** 2
    return np.asarray(spectrum[LOWEST : (len(run) + 1) // 2])


def _running_median(spectrum: Floats) -> Floats:
    """Median of 2 `HALF` + 1 ordinates about each; at the ends, of the first and the last ones."""
    inner = np.median(np.lib.stride_tricks.sliding_window_view(spectrum, 2 * HALF + 1), axis=1)
    return np.asarray(np.pad(inner, HALF, mode="edge"))


def _most_waves(positions: Sequence[Floats], travel: float) -> int:
    """Waves over the travel that are still sampled twice where the joint is fastest; none for a joint that rests."""
    moved = np.abs(np.concatenate([np.diff(p) for p in positions]))
    fastest = float(np.quantile(moved, FAST)) if len(moved) else 0.0
    return 0 if fastest == 0.0 else min(MOST_WAVES, int(travel / (2 * fastest)))


def _joined(whitener: Whitener, runs: Sequence[Floats]) -> Floats:
    """Filtered runs (m, …) in a row, less the mean."""
    joined = np.concatenate([whitener.whitened(run) for run in runs])
    return np.asarray(joined - joined.mean(axis=0))


def _explained(left: Floats, cosine: Floats, sine: Floats) -> Floats:
    """Sum of squares (k,) of a signal (m,) that pairs of waves (m, k) explain."""
    by_cosine, by_sine = left @ cosine, left @ sine
    cosines, sines, mixed = (cosine**2).sum(0), (sine**2).sum(0), (cosine * sine).sum(0)
    determinant = np.maximum(cosines * sines - mixed**2, 1e-6 * cosines * sines + 1e-30)
    return np.asarray((sines * by_cosine**2 - 2 * mixed * by_cosine * by_sine + cosines * by_sine**2) / determinant)
