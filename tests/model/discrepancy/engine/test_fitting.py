"""Fits end where those of others do, know when to stop, and say how well they know a number."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.signal import lfilter

from model.arrays import Floats
from model.discrepancy.engine.fitting import LONG, SETTLED, Fit, evaluate, fit, found_values
from model.fitting.fit import INTERVAL
from model.fitting.unknowns import Unknown
from tests.model.discrepancy.engine.curves import Curve, Formula, compared, unknown

TRUTH = {"size": 20.0, "rate": 0.8, "end": 3.0}
FAR = {"size": 60.0, "rate": 5.0, "end": 10.0}
FREE = (unknown("size", size=1.0), unknown("rate", 0.01, 20.0, size=1.0), unknown("end", size=1.0))


def decay(time: Floats, at: Mapping[str, float]) -> Floats:
    return np.asarray(at["size"] * np.exp(-at["rate"] * time) + at["end"])


SLOPES: dict[str, Formula] = {
    "size": lambda t, at: np.exp(-at["rate"] * t),
    "rate": lambda t, at: -t * at["size"] * np.exp(-at["rate"] * t),
    "end": lambda t, _at: np.ones_like(t),
}


def decaying(seed: int = 1) -> Curve:
    """A decay with white noise."""
    time = np.linspace(0.0, 5.0, 200)
    return Curve(time, decay(time, TRUTH) + np.random.default_rng(seed).standard_normal(200), decay, SLOPES)


def of_scipy(curve: Curve, unknowns: tuple[Unknown, ...]) -> tuple[Floats, float]:
    """Where scipy's least squares end, and −2 log posterior there."""
    names = [u.name for u in unknowns]
    stated = [(k, u.expected, u.deviation) for k, u in enumerate(unknowns) if u.deviation is not None]

    def residuals(x: Floats) -> Floats:
        left = curve.measured - decay(curve.time, dict(zip(names, x, strict=True)))
        return np.array([*left, *((x[k] - expected) / deviation for k, expected, deviation in stated)])

    begin = np.clip(list(TRUTH.values()), [u.low + 1e-9 for u in unknowns], [u.high - 1e-9 for u in unknowns])
    found = least_squares(residuals, begin, bounds=([u.low for u in unknowns], [u.high for u in unknowns]), xtol=1e-12)
    return found.x, 2.0 * float(found.cost)


@pytest.mark.parametrize(
    "changed",
    [
        {},
        {"rate": unknown("rate", 0.01, 0.7, size=1.0)},
        {"end": unknown("end", low=3.5, size=1.0)},
        {"size": unknown("size", expected=25.0, deviation=0.3)},
    ],
    ids=["free", "at a bound", "at another", "held by a prior"],
)
@pytest.mark.parametrize("begin", [TRUTH, FAR], ids=["near", "far"])
def test_a_fit_ends_where_scipy_does(changed: Mapping[str, Unknown], begin: Mapping[str, float]) -> None:
    curve, unknowns = decaying(), tuple(changed.get(u.name, u) for u in FREE)
    found = fit(compared(curve), unknowns, begin, rounds=LONG)
    values, cost = of_scipy(curve, unknowns)
    assert found.cost == pytest.approx(cost, abs=SETTLED)
    for u, theirs in zip(unknowns, values, strict=True):
        at_bound = min(abs(theirs - u.low), abs(theirs - u.high)) < 1e-6
        tolerance = 1e-6 if at_bound else 0.5 * found.standard_deviations[u.name]
        assert found.values[u.name] == pytest.approx(theirs, abs=tolerance)
        assert u.low <= found.values[u.name] <= u.high


@pytest.mark.parametrize("product", [30.0, 150.0], ids=["a valley", "a steep one"])
def test_a_fit_follows_a_valley_of_two_numbers_whose_product_counts_to_its_end(product: float) -> None:
    """As a torque constant and a back-EMF constant: only what is expected of one of them says where on a hyperbola."""
    time = np.linspace(0.0, 5.0, 200)
    slopes: dict[str, Formula] = {"one": lambda t, at: at["other"] * t, "other": lambda t, at: at["one"] * t}
    curve = Curve(time, product * time, lambda t, at: np.asarray(at["one"] * at["other"] * t), slopes)
    unknowns = (unknown("one", expected=1.0, deviation=0.1), unknown("other", size=1.0))
    found = fit(compared(curve), unknowns, {"one": 3.0, "other": product / 3.0}, rounds=LONG)
    assert found.values == {"one": pytest.approx(1.0, abs=0.1), "other": pytest.approx(product, rel=0.1)}


def test_derivatives_of_another_place_do_not_keep_a_fit_from_its_end() -> None:
    """Those of all unknowns are corrected by every step, and computed anew where that leads no further."""
    curve = decaying()
    _, cost = of_scipy(curve, FREE)
    elsewhere = evaluate(compared(curve), FREE, dict(FAR), np.ones(1)).slopes()
    curve.asked.clear()
    assert fit(compared(curve), FREE, TRUTH, known=elsewhere).cost == pytest.approx(cost, abs=SETTLED)
    assert curve.asked[0] == list(TRUTH)
    there = fit(compared(curve), FREE, TRUTH).with_slopes()
    curve.asked.clear()
    again = fit(compared(curve), FREE, there.values, known=there.known)
    assert again.cost <= there.cost
    assert curve.asked == [], "nothing is left to be gained"


def test_of_unknowns_some_of_which_have_derivatives_only_those_of_the_others_are_computed() -> None:
    curve = decaying()
    near = evaluate(compared(curve), FREE, dict(TRUTH), np.ones(1)).slopes()
    curve.asked.clear()
    found = fit(compared(curve), FREE, {**TRUTH, "rate": 0.4}, known={n: near[n] for n in ("size", "end")})
    assert found.cost == pytest.approx(of_scipy(curve, FREE)[1], abs=SETTLED)
    assert curve.asked
    assert all(names == ["rate"] for names in curve.asked)


@pytest.mark.parametrize(("beyond", "ends"), [(1.0, True), (-1e6, False)], ids=["within reach", "out of reach"])
def test_a_fit_that_cannot_reach_its_goal_is_given_up(beyond: float, ends: bool) -> None:
    curve = decaying()
    whole = fit(compared(curve), FREE, FAR, rounds=LONG)
    usual = len(curve.asked)
    curve.asked.clear()
    found = fit(compared(curve), FREE, FAR, rounds=LONG, goal=whole.cost + beyond)
    assert (found.cost == whole.cost) is ends
    assert (len(curve.asked) == usual) is ends


def test_a_step_to_where_a_simulation_does_not_stay_finite_is_not_taken() -> None:
    """It says nothing of the derivatives either."""

    def breaking(time: Floats, at: Mapping[str, float]) -> Floats:
        tried.append(at["rate"])
        return np.full_like(time, np.nan) if at["rate"] < 0.5 else decay(time, at)

    tried: list[float] = []
    curve = replace(decaying(), formula=breaking)
    found = fit(compared(curve), FREE, FAR, rounds=LONG)
    assert min(tried) < 0.5, "it was tried"
    assert found.cost == pytest.approx(of_scipy(curve, FREE)[1], abs=SETTLED)
    curve.asked.clear()
    lost = fit(compared(curve), FREE, {**FAR, "rate": 0.1})
    assert curve.asked == []
    assert (lost.cost, lost.values) == (np.inf, {**FAR, "rate": 0.1}), "there is nowhere to go from"


# ---- How well a number is known.

LINE: dict[str, Formula] = {
    "level": lambda t, _at: 1e8 * np.ones_like(t),
    "slow": lambda t, _at: 1e-3 * np.sin(t / 40.0),
}
LEVELS = (unknown("level", size=1e-8), unknown("slow", size=1e3))


def line(time: Floats, at: Mapping[str, float]) -> Floats:
    return np.asarray(sum(at[name] * slope(time, at) for name, slope in LINE.items()))


def line_fit(noise: Floats) -> Fit:
    """Two numbers of very different units, of which nothing is there, fitted to noise."""
    return fit(compared(Curve(np.arange(float(len(noise))), noise, line, LINE)), LEVELS, {"level": 0.0, "slow": 0.0})


def test_numbers_are_as_uncertain_as_repeated_records_show_however_slow_their_noise() -> None:
    """Neighbours are alike to 0.8: three times as uncertain as white noise of that size would leave them."""
    draw = np.random.default_rng(3)
    fits = [line_fit(lfilter([1.0], [1.0, -0.8], draw.standard_normal(1200))[200:]) for _ in range(150)]
    design = np.stack([LINE[u.name](np.arange(1000.0), {}) for u in LEVELS])
    white = np.sqrt(np.diag(np.linalg.inv(design @ design.T))) / 0.6  # noise of deviation 1 / 0.6
    for u, alone in zip(LEVELS, white, strict=True):
        estimates = np.array([f.values[u.name] for f in fits])
        said = np.array([f.standard_deviations[u.name] for f in fits])
        assert np.median(said) == pytest.approx(np.std(estimates), rel=0.15)
        assert np.median(said) > 2.5 * alone
        assert 0.88 <= np.mean(np.abs(estimates) < INTERVAL * said) <= 0.99


def test_a_prior_bounds_what_is_unknown_and_what_no_record_shows_has_no_interval() -> None:
    noise = np.random.default_rng(2).standard_normal(1000)
    silent = {**LINE, "silent": lambda t, _at: np.zeros_like(t)}
    held = (LEVELS[0], unknown("slow", expected=0.0, deviation=1.0), unknown("silent", size=1.0))
    found = fit(compared(Curve(np.arange(1000.0), noise, line, silent)), held, {"level": 0.0, "silent": 0.0})
    assert found.standard_deviations["slow"] == pytest.approx(1.0, rel=1e-3)
    assert found.standard_deviations["level"] == pytest.approx(1e-8 / np.sqrt(1000), rel=0.15)
    value = found_values(found, [held[2].parameter])["silent"]
    assert (value.low, value.high) == (None, None)


def test_an_interval_covers_the_bias_and_ends_at_a_bound() -> None:
    found = line_fit(np.random.default_rng(2).standard_normal(1000))
    deviation, at = found.standard_deviations["slow"], found.values["slow"]
    plain, wide = (
        found_values(found, [LEVELS[1].parameter], bias)["slow"] for bias in (None, {"slow": 2.0 * deviation})
    )
    assert plain.value == at
    assert plain.high == pytest.approx(at + INTERVAL * deviation)
    assert wide.high == pytest.approx(at + INTERVAL * np.sqrt(5.0) * deviation)
    bounded = replace(LEVELS[1].parameter, low=at - 0.1 * deviation)
    assert found_values(found, [bounded])["slow"].low == bounded.low
