"""Fits of records of an arm that is known: values, intervals that hold, verdicts, lineage, progress, cancelling."""

from pathlib import Path

import numpy as np
import pytest

from daq.contracts.progress import CancelledError
from model.fitting.covariance import inverse, sandwich, score_covariance
from model.fitting.fit import fit
from model.fitting.options import FitOptions, Prior
from model.fitting.result import FitResult, load_result
from tests.model.fitting.imagined import arm, changed, traces

TRUTH = {
    "joint1.motor.back_emf_constant": 0.0300,
    "joint2.motor.back_emf_constant": 0.0460,
    "joint3.motor.back_emf_constant": 0.0360,
    "load.mass": 1.36,
    "joint2.load_dependent_friction.arm": 0.16,
}
QUICK = FitOptions(parameters=tuple(TRUTH), sensor_bend=False, replicas=4, rounds=3)


@pytest.fixture(scope="module")
def result() -> FitResult:
    return fit(arm(), traces(arm().with_values(TRUTH)), QUICK)


def test_finds_the_values_that_the_records_were_made_with(result: FitResult) -> None:
    assert result.converged
    for name, value in TRUTH.items():
        found = result.parameter(name)
        assert found.verdict == "known"
        assert abs(found.value - value) < 4 * found.deviation, name
        assert found.deviation < 0.3 * abs(found.before - value), name
        assert found.low is not None
        assert found.high - found.value == pytest.approx(1.96 * found.deviation, rel=1e-3)


def test_what_is_left_is_the_noise_of_the_sensor(result: FitResult) -> None:
    assert result.whitened_mean_square == pytest.approx(1.0, abs=0.1)
    for error in result.errors:
        assert error.after < 1.35 * error.floor
        assert 0.8 < error.after / (error.noise or 0.0) < 1.15
    assert result.errors[1].before > 4 * result.errors[1].floor
    assert result.verdict.explains
    assert [n.name for n in result.verdict.far] == ["joint2.motor.back_emf_constant"], (
        "which the records were made with"
    )
    assert result.verdict.text in str(result)


def test_a_result_says_where_it_comes_from_and_survives_its_file(result: FitResult, tmp_path: Path) -> None:
    assert result.model.lineage.parent == arm().identity
    assert result.model.lineage.traces == ("imagined-0-0", "imagined-1-0")
    assert result.model.parameter("load.mass").value == result.parameter("load.mass").value
    assert {use.name for use in result.model.effects} == {use.name for use in arm().effects}  # no nuisance stays in it
    assert repr(result) == f"<FitResult {result.model.identity}: 5 of 5 parameters known, 560 samples of 2 traces>"
    assert str(result).splitlines()[0] == repr(result)
    assert all(name in text for name in TRUTH for text in (str(result), result._repr_html_()))
    result.save(tmp_path / "fit.json")
    assert load_result(tmp_path / "fit.json") == result
    again = fit(arm(), traces(arm().with_values(TRUTH)), QUICK)
    assert again.values == result.values
    assert again.covariance == result.covariance


def assert_close(found: FitResult, deviations: float) -> None:
    """Every value within so many deviations of the truth, whatever the verdict."""
    sizes = dict(zip(found.names, np.sqrt(np.diag(found.covariance_matrix)), strict=True))
    for name, value in TRUTH.items():
        assert abs(found.parameter(name).model_value - value) < deviations * sizes[name], name


def test_missing_samples_and_a_crackling_sensor_decide_nothing() -> None:
    whole = traces(arm().with_values(TRUTH))
    keep = np.setdiff1d(np.arange(len(whole[0])), np.r_[120:130, 200])
    signals = {
        name: getattr(whole[0], name)[keep] for name in ("time", "position", "set_point", "error", "drive", "tick")
    }
    found = fit(arm(), [changed(whole[0], **signals), whole[1]], QUICK)
    assert found.samples == 2 * (len(whole[0]) - 20) - 11
    assert_close(found, 5)
    given = traces(arm().with_values(TRUTH))
    crackled = given[0].position.copy()
    crackled[60::97, 1] += 0.03
    found = fit(arm(), [changed(given[0], position=crackled), given[1]], QUICK)
    assert_close(found, 5)


def test_progress_grows_to_one() -> None:
    told: list[float] = []
    fit(arm(), traces(arm(), 1, 4.0), QUICK.model_copy(update={"rounds": 1}), lambda f, _text: told.append(f))
    assert told == sorted(told)
    assert told[0] >= 0.0
    assert told[-1] == 1.0


class After:
    """A cancel that comes after some questions."""

    def __init__(self, questions: int) -> None:
        self.left = questions

    def is_set(self) -> bool:
        self.left -= 1
        return self.left < 0


def test_can_be_cancelled_in_the_middle() -> None:
    with pytest.raises(CancelledError):
        fit(arm(), traces(arm(), 1, 4.0), QUICK, cancel=After(3))


def test_another_start_and_another_search_find_the_same() -> None:
    given = traces(arm().with_values(TRUTH))
    plain = QUICK.model_copy(update={"rounds": 1, "replicas": 0, "tolerance": 1e-7})
    one = fit(arm(), given, plain)
    two = fit(arm(), given, plain.model_copy(update={"starts": 2, "seed": 5}))
    deviations = np.sqrt(np.diag(one.covariance_matrix))[: len(TRUTH)]
    assert (np.abs(np.subtract(one.values, two.values))[: len(TRUTH)] < 0.3 * deviations).all()
    names = ("joint2.motor.back_emf_constant", "load.mass")
    start = arm().with_values({k: v for k, v in TRUTH.items() if k not in names})
    options = FitOptions(parameters=names, method="nelder_mead", most_evaluations=120)
    found = fit(start, traces(arm().with_values(TRUTH)), options)
    assert found.parameter(names[0]).model_value == pytest.approx(TRUTH[names[0]], rel=0.02)
    assert found.evaluations <= 120


def test_a_strong_prior_holds_and_the_parameter_is_not_called_known() -> None:
    options = FitOptions(
        parameters=("link1.mass", "load.mass"),
        priors={"link1.mass": Prior(expected=2.6, deviation=0.1)},
        replicas=0,
        rounds=1,
        sensor_bend=False,
    )
    found = fit(arm(), traces(arm(), 1, 4.0), options).parameter("link1.mass")
    assert found.verdict == "unknown"
    assert found.value is found.low is found.high is found.deviation is None
    assert found.model_value == pytest.approx(2.6, abs=0.05)


def test_the_scale_of_torque_is_found_in_records_of_the_whole_arm() -> None:
    options = FitOptions(
        parameters=("*.mass", "*.torque_constant", "*.rotor_inertia", "*.viscous_friction.coefficient", "load.mass"),
        sensor_bend=False,
        friction_form=False,
        replicas=0,
        rounds=1,
    )
    found = fit(arm(), traces(arm(), 2, 4.0), options)
    report = found.identifiability
    assert report.torque_scale_free
    scale = next(c for c in report.undetermined if c.torque_scale)
    assert {m.name for m in scale.members} == {p.name for p in found.parameters}
    assert {m.change for m in scale.members} == {1.0}
    for name in ("load.mass", "joint3.motor.torque_constant", "joint3.motor.rotor_inertia"):
        assert found.parameter(name).verdict != "known"
        assert found.parameter(name).value is None


# ---- The sandwich: intervals that hold when residuals are correlated, where the plain formula's do not


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


def test_scores_of_neighbours_count_less_the_further_they_are_apart() -> None:
    # Scores of neighbours count less the further they are apart and never across runs
    one, other = np.array([[1.0], [2.0], [4.0], [8.0]]), np.array([[3.0], [5.0]])
    squares = 1 + 4 + 16 + 64 + 9 + 25
    next_to, two_apart = 2 + 8 + 32 + 15, 4 + 16
    found = score_covariance([one, other], bandwidth=2)
    assert found[0, 0] == pytest.approx(squares + 2 * (2 / 3 * next_to + 1 / 3 * two_apart))
    assert score_covariance([one, other], bandwidth=0)[0, 0] == squares
    # The inverse is the inverse where there is one
    matrix = np.diag([1e12, 1.0, 1e-9]) + 1e-11
    np.testing.assert_allclose(inverse(matrix) @ matrix, np.eye(3), atol=1e-9)
    # The covariance of scores is symmetric
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
