"""The yardstick: each residual judged by a noise model of its own."""

from __future__ import annotations

import numpy as np

from model.discrepancy.noise_model import noise_model


def coloured(count: int, pole: float, seed: int) -> np.ndarray:
    """An autoregression of the first order with prediction errors of deviation 1."""
    rng = np.random.default_rng(seed)
    signal = np.zeros(count)
    for k, error in enumerate(rng.standard_normal(count)):
        signal[k] = (pole * signal[k - 1] if k else 0.0) + error
    return signal


def test_colour_costs_nothing_but_size_does() -> None:
    white, red = coloured(4000, 0.0, 1), coloured(4000, 0.9, 2)
    described = noise_model([[white], [red]]).by_joint
    assert abs(described[0] - described[1]) < 250, "a red residual of the same prediction error is as likely"
    louder = noise_model([[1.1 * white], [red]]).by_joint
    assert abs(louder[0] - described[0] - 2 * 4000 * np.log(1.1)) < 20


def test_one_bad_reading_proves_nothing() -> None:
    white = coloured(4000, 0.0, 3)
    spoilt = white.copy()
    spoilt[2000] += 20.0
    assert noise_model([[spoilt]]).description - noise_model([[white]]).description < 60


def test_runs_are_not_joined() -> None:
    white = coloured(4000, 0.0, 4)
    halves = [white[:2000] + 0.0, white[2000:] + 0.0]
    assert np.isclose(noise_model([halves]).description, noise_model([[white]]).description, atol=15)
