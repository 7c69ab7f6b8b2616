"""What records that no fit has seen say for an effect."""

from collections.abc import Mapping

import numpy as np
import pytest

from model.arrays import Floats
from model.discrepancy.engine.case import is_strained
from model.discrepancy.engine.fitting import Fit, evaluate, fit
from model.discrepancy.engine.holdout import evidence, is_beyond_noise, share_removed, squares_between, squares_unseen
from tests.model.discrepancy.engine.curves import Curve, Formula, compared, curve_case, unknown

TIME = np.arange(400.0)
STEADY = (unknown("level", size=1.0),)
WITH_BUMP = (*STEADY, unknown("bump", size=1.0))
WITH_WAVE = (*STEADY, unknown("wave", size=1.0))


def bump(time: Floats) -> Floats:
    """All of it in the first quarter, but for a little that says elsewhere how large it is."""
    return np.asarray(np.where(time < 100.0, 1.0, 0.3 * (-1.0) ** time))


SLOPES: dict[str, Formula] = {
    "level": lambda t, _at: np.ones_like(t),
    "bump": lambda t, _at: bump(t),
    "wave": lambda t, _at: np.sin(t / 5.0),
}


def formula(time: Floats, at: Mapping[str, float]) -> Floats:
    return np.asarray(sum((value * SLOPES[name](time, at) for name, value in at.items()), np.zeros_like(time)))


def record(seed: int, **truth: float) -> Curve:
    """A record of noise of deviation 1 and of what is there."""
    noise = np.random.default_rng(seed).standard_normal(len(TIME))
    return Curve(TIME, formula(TIME, truth) + noise, formula, SLOPES)


def test_what_is_there_is_there_on_records_that_were_not_fitted_to_and_what_followed_noise_is_not() -> None:
    """Evidence is the fall of −2 log likelihood there: nothing was fitted, so that a useless number costs itself."""
    fitted, unseen = record(1, level=5.0, wave=1.0), record(2, level=5.0, wave=1.0)
    case = curve_case(fitted, unseen)
    plain, wave, idle = (fit(compared(fitted), free, {}) for free in (STEADY, WITH_WAVE, WITH_BUMP))
    of_wave, of_idle = evidence(case, plain, [wave, idle])
    left = [unseen.measured - formula(TIME, one.values) for one in (plain, wave)]
    assert of_wave.alone == of_wave.compared == pytest.approx(left[0] @ left[0] - left[1] @ left[1])
    assert of_wave.alone > 150.0
    assert of_idle.alone < 5.0
    between = formula(TIME, plain.values) - formula(TIME, wave.values)
    np.testing.assert_allclose(squares_between(case, plain, wave), np.mean(between**2))
    assert squares_unseen(case, wave) == pytest.approx(left[1] @ left[1] / len(TIME))
    removed = share_removed(plain.squares, wave.squares, *(squares_unseen(case, one) for one in (plain, wave)))
    assert removed == pytest.approx(1 / 3, abs=0.06), "a wave of unit size is a half of noise of unit size"


def test_a_simulation_of_unseen_records_that_does_not_stay_finite_refutes_its_effect() -> None:
    case = curve_case(record(1), record(2))
    plain = fit(compared(record(1)), STEADY, {})
    wild = evaluate(plain.compared, STEADY, {"level": np.nan}, np.ones(1))
    assert evidence(case, plain, [wild])[0].alone == -np.inf
    assert [one.alone for one in evidence(curve_case(record(1)), plain, [wild])] == [0.0], "none are held out"


@pytest.mark.parametrize(("truth", "kept"), [({"wave": 1.0}, True), ({"bump": 2.0}, False)])
def test_without_held_out_records_every_quarter_is_predicted_from_the_others(
    truth: Mapping[str, float], kept: bool
) -> None:
    """What is in one quarter alone, the others do not foretell."""
    curve = record(3, level=5.0, **truth)
    curve.measured[100:] -= truth.get("bump", 0.0) * bump(TIME[100:])
    case, names = curve_case(curve), {"wave": WITH_WAVE, "bump": WITH_BUMP}
    before, after = (fit(compared(curve), free, {}) for free in (STEADY, names[next(iter(truth))]))
    assert after.squares < 0.8 * before.squares, "the fit has followed it"
    unseen = [squares_unseen(case, one) for one in (before, after)]
    removed = share_removed(before.squares, after.squares, unseen[0], unseen[1])
    assert (removed > 0.2) is kept
    assert (removed < 0.05) is not kept
    edges = [slice(k, k + 100) for k in range(0, 400, 100)]
    alone = [np.mean(np.delete(curve.measured, np.r_[own])) for own in edges]
    expected = np.mean([(curve.measured[own] - one) ** 2 for own, one in zip(edges, alone, strict=True)])
    assert unseen[0][0] == pytest.approx(expected, rel=1e-3)


def test_only_joints_that_an_effect_improves_count_and_only_above_noise() -> None:
    before, after = np.array([4.0, 4.0, np.nan]), np.array([1.0, 3.99, np.nan])
    unseen = np.array([8.0, 1.0, 1.0]), np.array([2.0, 9.0, 0.1])
    assert share_removed(before, after, *unseen) == 0.75
    assert share_removed(before, before, *unseen) == 0.0
    for side in ((np.full(3, np.nan), unseen[1]), (unseen[0], np.full(3, np.nan))):
        assert share_removed(before, after, *side) == 0.0, "nothing is known of the joint there"
    assert is_beyond_noise(before, after, np.array([1.9, 1.0, 1.0]))
    assert not is_beyond_noise(before, after, np.array([2.1, 1.0, 1.0])), "the second has hardly fallen"


# ---- A fit that leaves numbers far off is begun again as the file states them.


def swinging(expected: float) -> tuple[Curve, Fit]:
    """A wave whose rate is stated, and a fit that began at another one, from where no step leads back."""
    slopes = {"rate": lambda t, at: 10.0 * t * np.cos(at["rate"] * t)}
    time = np.linspace(0.0, 10.0, 300)

    def wave(t: Floats, at: Mapping[str, float]) -> Floats:
        return np.asarray(10.0 * np.sin(at["rate"] * t))

    noise = np.random.default_rng(5).standard_normal(300)
    curve = Curve(time, wave(time, {"rate": 2.03}) + noise, wave, slopes)
    return curve, fit(compared(curve), (unknown("rate", expected=expected, deviation=0.05),), {"rate": 3.0})


def test_a_fit_that_leaves_a_number_far_from_its_file_is_begun_again_there() -> None:
    curve, astray = swinging(2.0)
    assert is_strained(astray)
    found = curve_case(curve).or_from_expected(astray)
    assert found.values["rate"] == pytest.approx(2.03, abs=0.01)
    assert found.cost < astray.cost - 1000.0
    assert not is_strained(found)
    assert curve_case(curve, from_expected=None).or_from_expected(found) is found, "nothing is strange here"
    misled, ended = swinging(4.0)
    right = fit(ended.compared, ended.unknowns, {"rate": 2.03})
    assert is_strained(right), "what the file states is worse"
    assert curve_case(misled).or_from_expected(right) is right
