"""The sandwich: intervals that hold when residuals are correlated, where the plain formula's do not."""

import numpy as np
import pytest

from model.fitting.covariance import inverse, sandwich, score_covariance


def estimates(bandwidth: int, repeats: int = 300) -> tuple[float, float]:
    """Share of 95 % intervals that contain the truth, plain and sandwich, for a mean with noise that is held
    in stretches."""
    plain = robust = 0
    for seed in range(repeats):
        rng = np.random.default_rng(seed)
        noise = np.repeat(rng.normal(size=60), 20) + 0.3 * rng.normal(size=1200)
        time = np.linspace(0.0, 1.0, len(noise))
        J = np.stack([np.ones_like(time), time], axis=1)
        y = J @ [1.0, -2.0] + noise
        scale = noise.std()
        found = np.linalg.lstsq(J, y, rcond=None)[0]
        residual = (y - J @ found) / scale
        information = J.T @ J / scale**2
        scores = [J / scale * residual[:, None]]
        covariance = sandwich(information, scores, np.zeros(2), bandwidth)
        plain += abs(found[1] + 2.0) < 1.96 * np.sqrt(np.linalg.inv(information)[1, 1])
        robust += abs(found[1] + 2.0) < 1.96 * np.sqrt(covariance[1, 1])
    return plain / repeats, robust / repeats


def test_intervals_hold_with_correlated_residuals_where_the_plain_ones_fail() -> None:
    plain, robust = estimates(bandwidth=50)
    assert plain < 0.6
    assert 0.88 < robust < 0.98


def test_what_the_data_say_nothing_of_is_wide_and_never_of_negative_variance() -> None:
    """Two columns that are one but for rounding, and no prior to speak of; warnings are errors in this suite."""
    rng = np.random.default_rng(3)
    for scale in (1.0, 1e3, 1e6):
        one = scale * rng.normal(size=(400, 1))
        J = np.hstack([one, 3.0 * one, one + 1e-12 * scale * rng.normal(size=one.shape), rng.normal(size=one.shape)])
        covariance = sandwich(J.T @ J, [J * rng.normal(size=one.shape)], np.full(4, 1e-12))
        variances = np.diag(covariance)
        assert (variances > 0).all()
        assert variances[0] > 1e6 / (J.T @ J)[0, 0]
        assert variances[3] < 0.1


def test_the_inverse_is_the_inverse_where_there_is_one() -> None:
    matrix = np.diag([1e12, 1.0, 1e-9]) + 1e-11
    np.testing.assert_allclose(inverse(matrix) @ matrix, np.eye(3), atol=1e-9)


def test_scores_of_neighbours_count_less_the_further_they_are_apart_and_never_across_runs() -> None:
    one, other = np.array([[1.0], [2.0], [4.0], [8.0]]), np.array([[3.0], [5.0]])
    squares = 1 + 4 + 16 + 64 + 9 + 25
    next_to, two_apart = 2 + 8 + 32 + 15, 4 + 16
    found = score_covariance([one, other], bandwidth=2)
    assert found[0, 0] == pytest.approx(squares + 2 * (2 / 3 * next_to + 1 / 3 * two_apart))
    assert score_covariance([one, other], bandwidth=0)[0, 0] == squares


def test_the_covariance_of_scores_is_symmetric() -> None:
    scores = np.random.default_rng(4).normal(size=(30, 3))
    found = score_covariance([scores], bandwidth=4)
    np.testing.assert_array_equal(found, found.T)
    by_hand = sum(
        (1 - abs(lag) / 5) * np.outer(scores[k], scores[k + lag])
        for lag in range(-4, 5)
        for k in range(30)
        if 0 <= k + lag < 30
    )
    np.testing.assert_allclose(found, by_hand)
