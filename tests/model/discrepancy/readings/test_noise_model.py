"""The yardstick: each residual judged by a noise model of its own."""

import numpy as np
from scipy.signal import lfilter

from model.discrepancy.readings.noise_model import LEAST_DEVIATION, fit_noise_model


def coloured(count: int, pole: float, seed: int) -> np.ndarray:
    """An autoregression of the first order with prediction errors of deviation 1."""
    rng = np.random.default_rng(seed)
    signal = np.zeros(count)
    for k, error in enumerate(rng.standard_normal(count)):
        signal[k] = (pole * signal[k - 1] if k else 0.0) + error
    return signal


def test_a_coloured_residual_costs_no_more_than_a_white_one_but_a_larger_one_does() -> None:
    white, red = coloured(4000, 0.0, 1), coloured(4000, 0.9, 2)
    described = fit_noise_model([[white], [red]]).by_joint
    assert abs(described[0] - described[1]) < 250, "a red residual of the same prediction error is as likely"
    louder = fit_noise_model([[1.1 * white], [red]]).by_joint
    assert abs(louder[0] - described[0] - 2 * 4000 * np.log(1.1)) < 20


def test_a_description_does_not_jump_where_the_order_is_a_close_choice() -> None:
    """From white to a little red: an order more is paid for by what it brings."""
    white = coloured(2750, 0.0, 6)
    described = [
        fit_noise_model([[lfilter([1.0], [1.0, -pole], white)]]).description for pole in np.arange(0, 0.1, 0.001)
    ]
    assert np.max(np.abs(np.diff(described))) < 1.0


def test_one_bad_reading_proves_nothing() -> None:
    white = coloured(4000, 0.0, 3)
    spoilt = white.copy()
    spoilt[2000] += 20.0
    assert fit_noise_model([[spoilt]]).description - fit_noise_model([[white]]).description < 60


def test_separate_runs_are_described_as_well_as_one() -> None:
    white = coloured(4000, 0.0, 4)
    halves = [white[:2000] + 0.0, white[2000:] + 0.0]
    assert np.isclose(fit_noise_model([halves]).description, fit_noise_model([[white]]).description, atol=15)


def test_a_residual_below_rounding_gains_no_likelihood() -> None:
    white = coloured(2750, 0.0, 5)
    floor = 2 * 2750 * np.log(LEAST_DEVIATION)
    for scale in (0.7, 0.4, 0.05, 0.0):
        assert fit_noise_model([[scale * white]]).description == floor
    assert fit_noise_model([[0.9 * white]]).description > floor


def test_a_rounding_offset_at_rest_is_no_evidence() -> None:
    """A joint at rest whose readings have no noise: half a count to one side, or none."""
    still = np.zeros(2750)
    assert fit_noise_model([[still + 0.5]]).description == fit_noise_model([[still]]).description


def test_what_inertia_has_smoothed_is_no_noise_however_well_its_past_predicts_it() -> None:
    """Seventy deviations at 0.4 Hz, sampled at 200 Hz, beside four deviations that are nearly white."""
    time = np.arange(2400) / 200.0
    smooth = 70.0 * np.sqrt(2.0) * np.sin(2 * np.pi * 0.4 * time) + 0.3 * coloured(2400, 0.0, 7)
    rough = 4.0 * coloured(2400, 0.0, 8)
    assert fit_noise_model([[smooth]]).description > fit_noise_model([[rough]]).description + 1000.0
