"""Readings less simulated ones: their derivatives, what held-out records know by themselves, and coloured noise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from model.arrays import Floats
from model.discrepancy.engine.fitting import Fit, evaluate
from model.discrepancy.engine.residual import Values
from model.discrepancy.readings.case import ReadingCase, noise_floor
from model.discrepancy.readings.noise_model import shown_noise
from model.discrepancy.readings.observation import STEP, difference
from model.discrepancy.readings.residual import ReadingResidual
from model.fitting.phases import is_phase
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model
from model.machine_model.parameter import Kind
from tests.model.discrepancy.readings.cases import case_of, fitted, searched
from tests.model.fitting import imagined

SECONDS = 3.0


def moves(compared: ReadingResidual, unknowns: tuple[Unknown, ...], at: Values, seconds: float = SECONDS) -> Floats:
    """Steps (k,) of differences by these unknowns."""
    return np.array([difference(compared.model, u, at[u.name], seconds) for u in unknowns])


def test_exact_derivatives_agree_with_differences_by_every_unknown() -> None:
    """Central ones over half of the usual step: masses, drives, friction and its form, bends, a tone's rate, and
    postures, each of which moves its own record alone."""
    ripple = {"sine": 0.2, "cosine": 0.1, "cycles": 30.0}
    arm = imagined.arm().with_effect("torque_ripple", (3,), ripple)
    case = case_of(arm, imagined.traces(arm, seconds=SECONDS))
    own = {p.name: p for p in arm.parameters if p.effect == "torque_ripple"}
    unknowns, compared = case.unknowns(arm, own), case.compared
    at = {u.name: u.start for u in unknowns}
    steps = 0.5 * moves(compared, unknowns, at)
    sides = [{**at, u.name: at[u.name] + side * h} for u, h in zip(unknowns, steps, strict=True) for side in (1, -1)]
    shown = compared.observation.readings(compared.model, [compared.state(v) for v in sides], STEP)
    expected = compared.samples.flat([y[1::2] - y[::2] for y in shown]) / (2 * steps[:, None])
    exact = compared.slopes(at, unknowns)
    apart = np.linalg.norm(exact - expected, axis=1) / np.linalg.norm(expected, axis=1)
    assert {u.name: a for u, a in zip(unknowns, apart, strict=True) if not a < 0.03} == {}
    assert {u.kind for u in unknowns} >= {Kind.EFFECT, Kind.PRESLIDING, Kind.INITIAL_POSITION, Kind.CONTROLLER}
    first = compared.samples.runs[0][0][1]
    for u, row in zip(unknowns, exact, strict=True):
        if u.trace is not None:
            by_record = np.abs(row).reshape(3, 2, first.stop - first.start).max(axis=(0, 2))
            assert by_record[1 - u.trace] == 0.0 < by_record[u.trace]


def test_where_a_loop_swings_up_differences_take_the_place_of_derivatives() -> None:
    """With four times the usual gain, a small change has grown a thousand times by the end of the record, until drives
    are at their limits: no fit may believe that."""
    case = case_of(imagined.arm(), [imagined.trace(imagined.arm(), seconds=4.0, gains=(8, 0, 0))])
    compared = case.compared.on(case.compared.observation.with_feedback_share(0.0))
    unknowns = case.unknowns(case.given, {})
    at = {u.name: u.start for u in unknowns}
    steps, room = moves(compared, unknowns, at, 4.0), compared.observation.range_of_motion
    exact = compared.samples.flat(compared.observation.derivatives(compared.model, compared.state(at), unknowns))
    foretold = np.abs(compared.slopes(at, unknowns) * steps[:, None]).max(axis=1)
    wild = np.abs(exact * steps[:, None]).max(axis=1) > room
    assert wild.sum() > len(unknowns) / 2
    assert np.all(foretold < 2 * room)
    moved = [{**at, u.name: at[u.name] + h} for u, h, far in zip(unknowns, steps, wild, strict=True) if far]
    there = np.abs(compared.changes(at, moved)).max(axis=1)
    np.testing.assert_allclose(foretold[wild], there, rtol=1e-9)


def test_of_parts_that_knock_in_their_play_derivatives_are_differences() -> None:
    loose = imagined.arm().with_effect("backlash", (2,), {"gap": 0.01})
    case = case_of(loose, [imagined.trace(loose, seconds=2.0)])
    unknowns = tuple(u for u in case.unknowns(loose, {}) if u.joints == (2,))
    at = {u.name: u.start for u in case.unknowns(loose, {})}
    steps = moves(case.compared, unknowns, at, 2.0)
    moved = [{**at, u.name: at[u.name] + h} for u, h in zip(unknowns, steps, strict=True)]
    expected = case.compared.changes(at, moved) / steps[:, None]
    np.testing.assert_allclose(case.compared.slopes(at, unknowns), expected, rtol=1e-9)
    assert np.abs(expected).max(axis=1).all()


def test_shares_of_a_record_are_its_samples_each_once() -> None:
    case = case_of(imagined.arm(), imagined.traces(imagined.arm(), seconds=2.0))
    whole = case.compared.samples
    row = np.arange(float(sum(whole.sizes)))
    signals = tuple(np.zeros_like(r.measured) for r in case.compared.observation.records)
    for j, own in enumerate(whole.runs):
        for (t, rows), part in zip(own, whole.split(row, j), strict=True):
            signals[t][rows, j] = part
    inside = []
    for fold in range(4):
        outside, within = (side.samples for side in case.compared.within(fold, 4))
        inside.append(within.flat(signals))
        np.testing.assert_array_equal(np.sort([*outside.flat(signals), *inside[-1]]), row)
    np.testing.assert_array_equal(np.sort(np.concatenate(inside)), row)


# ---- Held-out records begin where they begin, at the phase at which they begin.

HERTZ, SIZE = 1.7, 4.0
"""Of a disturbance on joint 2, Hz and N·m."""


def humming(phase: float, size: float = SIZE) -> Model:
    """The arm with a disturbance that a record meets at a phase, rad."""
    values = {"sine": size * np.cos(phase), "cosine": size * np.sin(phase), "frequency": HERTZ}
    return imagined.arm().with_effect("periodic_disturbance", (2,), values)


def standing(model: Model, *held: Model) -> tuple[ReadingCase, Fit]:
    """A model as the fit of a record of that very arm, and held-out records of others."""
    unseen = [imagined.trace(one, k, seconds=4.0, seed=6) for k, one in enumerate(held)]
    case = case_of(model, [imagined.trace(model, seconds=2.0)], unseen)
    own = {p.name: p for p in model.parameters if p.effect == "periodic_disturbance"}
    unknowns = case.unknowns(model, own)
    return case, evaluate(case.compared, unknowns, {u.name: u.start for u in unknowns}, np.ones(3))


def left_on(model: Model, *held: Model) -> list[Floats]:
    """Root mean squares (n,) of what the model leaves of every held-out record, in floors of noise."""
    case, now = standing(model, *held)
    floor = noise_floor(case.held_out, now.values)
    runs = [r.runs[0] for r in case.held_out.observation.records]
    return [np.sqrt(np.mean(one[rows] ** 2, axis=0)) / floor for one, rows in zip(case.held(now), runs, strict=True)]


def test_every_held_out_record_has_a_posture_of_its_own_at_the_start() -> None:
    """Whatever is known of those fitted to, and however its potentiometers bend: a dozen counts at the start."""
    bent = imagined.arm().with_effect("potentiometer_nonlinearity", (1, 2, 3), {"bend_1": 0.011, "bend_3": -0.008})
    for left in left_on(bent, bent, bent):
        assert np.all(left < 1.15)
    case, now = standing(imagined.arm(), imagined.arm())
    off = {u.name: 0.02 for u in now.unknowns if u.kind is Kind.INITIAL_POSITION}
    elsewhere = replace(now, values={**now.values, **off})
    np.testing.assert_array_equal(case.held(elsewhere)[0], case.held(now)[0])


def test_every_held_out_record_has_a_phase_of_its_own() -> None:
    for left in left_on(humming(0.0), humming(1.6), humming(5.0)):
        assert np.all(left < 1.15)


def test_records_that_are_fitted_together_have_phases_of_their_own() -> None:
    phases = (0.0, 1.6, 5.0)
    traces = [imagined.trace(humming(p), k, seconds=4.0) for k, p in enumerate(phases)]
    findings = searched(case := case_of(imagined.arm(), traces, effects=("periodic_disturbance",)), fitted(case))
    best = findings.fitted[0]
    values = {p.part: best.fit.values[p.name] for p in best.parameters}
    assert (best.joints, values["frequency"]) == ((2,), pytest.approx(HERTZ, abs=0.01))
    assert np.hypot(values["sine"], values["cosine"]) == pytest.approx(SIZE, rel=0.1)
    found = [best.fit.values[u.name] for u in best.fit.unknowns if is_phase(u)]
    wrong = np.angle(np.exp(1j * (np.array(found) - phases[1:])))
    assert np.abs(wrong).max() < 0.1
    assert np.all(np.sqrt(best.fit.squares) < 1.15 * best.fit.compared.floor)


def test_a_disturbance_does_not_vanish_from_records_that_do_not_show_it() -> None:
    (left,) = left_on(humming(0.0), humming(0.0, size=0.0))
    assert left[1] > 2.0
    (plain,) = left_on(imagined.arm(), humming(0.0, size=0.0))
    assert np.all(plain < 1.15)


# ---- Noise as records show it.


def test_noise_that_is_not_stated_is_weighed_by_its_size_and_colour() -> None:
    """White noise as stated, and two deviations of noise whose neighbours are alike to seven tenths. One joint is
    weighed as all of them are."""
    case = case_of(imagined.arm(), imagined.traces(imagined.arm(), seconds=9.0))
    plain, draw = case.compared, np.random.default_rng(4)
    left = [draw.standard_normal(r.measured.shape) for r in plain.observation.records]
    left = [w + 2.0 * lfilter([0.51**0.5], [1.0, -0.7], draw.standard_normal(w.shape), axis=0) for w in left]
    row = plain.samples.flat([one * plain.observation.deviations for one in left])
    noise = shown_noise(plain.by_joint(row))
    np.testing.assert_allclose(noise.sizes, np.sqrt(5.0), rtol=0.2)
    compared = plain.on(replace(plain.observation, noise=noise))
    ones = np.ones(3)
    whitened = compared.weighted(row, compared.floor, ones)
    assert np.mean(plain.weighted(row, plain.floor, ones) ** 2) == pytest.approx(5.0, rel=0.2)
    assert np.mean(whitened**2) == pytest.approx(1.0, abs=0.05)
    for j, columns in enumerate(compared.samples.columns):
        neighbours = np.corrcoef(whitened[columns][1:], whitened[columns][:-1])[0, 1]
        assert abs(neighbours) < 0.1
        alone = compared.weighted(row[columns], compared.floor, ones, j)
        np.testing.assert_allclose(alone, whitened[columns], rtol=1e-12)
    np.testing.assert_allclose(compared.floor, noise.sizes * plain.observation.deviations)
