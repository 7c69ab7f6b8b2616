"""Intervals: right where the residual is coloured, and no narrower than the priors allow."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from model.discrepancy.candidates.candidate_fit import Fit, judge
from model.discrepancy.output_error.calibration import Calibration
from model.discrepancy.output_error.noise_model import fit_noise_model
from model.discrepancy.output_error.observation import observe
from model.discrepancy.output_error.search import converge, point_at
from model.discrepancy.selection.step import found_values, shift_by_noise, standard_deviations
from model.fitting.fit import INTERVAL
from model.fitting.unknowns import Unknown
from model.machine_model.parameter import Parameter
from tests.model.fitting import imagined

COLOUR = 0.8
WIDTH = 0.4
"""V, of a dead zone: little more than a count of the converter."""


def slow_noise(seed: int, count: int) -> NDArray[np.float64]:
    """An autoregression of the first order: what a wrong law of friction leaves."""
    made: NDArray[np.float64] = lfilter([1.0], [1.0, -COLOUR], np.random.default_rng(seed).normal(size=count + 200))
    return made[200:]


def test_slow_noise_is_as_uncertain_as_repeated_records_show() -> None:
    tangent = np.sin(np.arange(2000) / 40)[None]  # a slow response, which slow noise resembles
    estimates, deviations = [], []
    for seed in range(300):
        noise = slow_noise(seed, 2000)
        estimates.append((tangent @ noise / (tangent @ tangent.T))[0, 0])
        noise_of_it = fit_noise_model([[noise]])
        deviations.append(float(standard_deviations(np.zeros(1), noise_of_it.whiteners, [[tangent]])[0]))
    assert np.std(estimates) == pytest.approx(np.median(deviations), rel=0.12)
    white = 1 / np.sqrt((tangent @ tangent.T)[0, 0])
    assert np.median(deviations) > 3 * white


def test_an_estimate_without_information_keeps_the_deviation_of_its_prior() -> None:
    whiteners = fit_noise_model([[slow_noise(1, 500)]]).whiteners
    assert standard_deviations(np.array([4.0]), whiteners, [[np.zeros((1, 500))]])[0] == pytest.approx(0.5)


def test_parameters_of_very_different_units_are_known_as_well_as_alone() -> None:
    rng = np.random.default_rng(2)
    tangents = rng.normal(size=(2, 500)) * np.array([[1e8], [1e-3]])
    whiteners = fit_noise_model([[rng.normal(size=500)]]).whiteners
    alone = [standard_deviations(np.zeros(1), whiteners, [[tangents[[k]]]])[0] for k in range(2)]
    assert standard_deviations(np.zeros(2), whiteners, [[tangents]]) == pytest.approx(alone, rel=0.02)


def dead_zone_fitted(noise: float) -> tuple[Fit, Parameter]:
    """A dead zone, fitted on a record of so much noise, and the parameter that is its width."""
    arm = imagined.arm().with_effect("dead_zone", (1,), {"width": WIDTH})
    begun = imagined.arm().with_effect("dead_zone", (1,), {"width": 0.7 * WIDTH})
    observation, stated = observe(begun, [imagined.trace(arm, seconds=20.0, noise=noise)])
    parameter = stated.model.by_name["joint1.dead_zone.width"]
    width = Unknown(parameter, 0.7 * WIDTH, 0.0, 10.0, 0.0, None)
    free = (*(u for u in stated.unknowns if u.name != parameter.name), width)
    given = Calibration(stated.model, free, np.array([u.start for u in free]))
    return judge(converge(point_at(observation, given), 4)), parameter


def test_an_interval_includes_how_far_noise_has_shifted_the_estimate() -> None:
    """A dead zone of little more than a count, under noise of one and a half."""
    found, parameter = dead_zone_fitted(noise=1.5)
    moved = shift_by_noise(found.point, [parameter])
    narrow = found_values(found, [parameter])[parameter.name]
    wide = found_values(found, [parameter], moved)[parameter.name]
    assert narrow.low is not None
    assert wide.low is not None
    assert wide.high is not None
    own = moved[[u.name for u in found.point.unknowns].index(parameter.name)]
    assert 1e-4 < abs(own) < 3 * abs(narrow.value - WIDTH), "of the size of what it is to account for"
    statistical = (narrow.value - narrow.low) / INTERVAL
    assert (wide.value - wide.low) / INTERVAL == pytest.approx(np.hypot(statistical, own))
    assert wide.low <= WIDTH <= wide.high


def test_derivatives_by_a_tones_rate_do_not_depend_on_their_step(monkeypatch: pytest.MonkeyPatch) -> None:
    ripple = {"sine": 0.6, "cosine": 0.3, "cycles": 30.0}
    arm = imagined.arm().with_effect("torque_ripple", (3,), ripple)
    observation, stated = observe(arm, [imagined.trace(arm, seconds=20.0)])
    cycles = Unknown(stated.model.by_name["joint3.torque_ripple.cycles"], 30.0, 1.0, 100.0, 30.0, 18.0)
    free = Calibration(stated.model, (*stated.unknowns, cycles), np.append(stated.values, 30.0))
    last = [len(stated.unknowns)]
    taken = observation.tangents(free, last)
    monkeypatch.setattr("model.discrepancy.output_error.observation.TONE_DIFFERENCE", 0.005)
    finer = observation.tangents(free, last)
    assert np.linalg.norm(taken - finer) < 0.05 * np.linalg.norm(finer)
