"""A recorded motion: what its low-pass keeps, what its derivatives lose, and how a recorded drive acts."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import butter, sosfiltfilt

from daq.contracts.machine import Machine
from model.arrays import Floats
from model.discrepancy.inverse_dynamics.residual import samples_of
from model.inverse_dynamics.recorded_motion import RecordedMotion, derivative, low_pass, turns_round
from tests.model.discrepancy.inverse_dynamics.rigs import bench_machine, slide_machine
from tests.model.inverse_dynamics.driven_slide import CUTOFF, PERIOD, TIME, controlled, motion_of

ALL = np.array([np.inf])
NONE = np.zeros(1)


def filtered_both_ways(signal: Floats, cutoff: float, period: float) -> Floats:
    """The same low-pass by scipy, which runs it forwards and backwards, sample by sample."""
    padding = min(len(signal) - 1, int(4.0 / (cutoff * period)))
    return np.asarray(sosfiltfilt(butter(4, 2 * cutoff * period, output="sos"), signal, axis=0, padlen=padding))


@given(
    seed=st.integers(0, 2**32 - 1),
    periods=st.integers(4, 80),
    share=st.floats(0.02, 0.25),
    more=st.sampled_from([(), (2,), (2, 3)]),
)
def test_the_low_pass_is_scipy_s_run_both_ways(seed: int, periods: int, share: float, more: tuple[int, ...]) -> None:
    """share: of the cutoff, of the sampling rate. Of the ends, 24 samples and more are left out."""
    count = 64 + int(np.ceil(periods / share))
    signal = np.cumsum(np.random.default_rng(seed).standard_normal((count, *more)), axis=0)
    edge = max(24, int(np.ceil(1.5 / share)))
    found, other = (f(signal, share / PERIOD, PERIOD) for f in (low_pass, filtered_both_ways))
    assert found.shape == signal.shape
    apart = np.abs(found - other)[edge:-edge].max()
    assert apart < 1e-5 * np.abs(signal).max()


@pytest.mark.parametrize("shape", [(2,), (3,), (7, 2), (20,), (20, 2, 3)])
def test_a_constant_that_is_shorter_than_a_period_of_the_cutoff_stays_one(shape: tuple[int, ...]) -> None:
    np.testing.assert_allclose(low_pass(np.full(shape, 3.7), 12.0, PERIOD), 3.7, rtol=1e-12)


@pytest.mark.parametrize("count", [60, 61, 97])
def test_a_short_record_that_drifts_keeps_its_drift(count: int) -> None:
    drift = 5.0 + np.arange(float(count))[:, None] * (1.0, -2.0)
    np.testing.assert_allclose(low_pass(drift, 12.0, PERIOD), drift, atol=1e-3 * np.ptp(drift))


def test_what_is_sampled_below_the_cutoff_stays_and_what_turns_many_times_is_no_other() -> None:
    signal = np.random.default_rng(1).standard_normal(50)
    assert np.array_equal(low_pass(signal, 0.46 / PERIOD, PERIOD), signal)
    assert not np.allclose(low_pass(signal, 0.44 / PERIOD, PERIOD), signal)
    # What is continued at one end must not reach the other: 100 rad of travel were 12 % of an acceleration
    time = np.arange(0.0, 25.0, 0.004)
    wave = 0.1 * np.sin(2 * np.pi * 0.7 * time)
    inside = slice(100, -100)
    turning = low_pass(wave + 4.0 * time, 36.0, 0.004) - 4.0 * time
    assert np.abs(turning - low_pass(wave, 36.0, 0.004))[inside].max() < 1e-9


def test_derivatives_and_thresholds_are_right_where_the_simple_ones_are_not() -> None:
    angular = 2 * np.pi * 12.0
    slope, inside = angular * np.cos(angular * TIME), slice(20, -20)
    wave = np.stack([np.sin(angular * TIME), 2 * np.sin(angular * TIME)], axis=1)
    wrong = np.abs(derivative(wave, PERIOD) - slope[:, None] * (1, 2)).max(axis=1)[inside].max()
    by_differences = np.abs(np.gradient(wave[:, 0], PERIOD) - slope)[inside].max()
    assert wrong < 1e-3 * angular
    assert by_differences == pytest.approx(0.015 * angular, rel=0.05)
    small, large = 0.5 * np.sin(7.0 * TIME), jumping(5.0)
    record, without = motion_of(np.where(large == 0.0, small, large)), motion_of(large)
    np.testing.assert_allclose(record.driven(NONE, ALL, np.array([0.6])), without.drive, atol=1e-9)
    np.testing.assert_array_equal(record.driven(NONE, ALL, NONE), record.drive)


@pytest.mark.parametrize("hertz", [3.0, 10.0, 25.0])
def test_a_drive_that_is_held_between_samples_moves_less_by_what_holding_takes(hertz: float) -> None:
    """What acts is written out at a twentieth of the period; the amplitude of its wave is that of the samples less."""
    whole = slice(0, 20 * round(7.0 / PERIOD))
    fine = PERIOD / 20 * (np.arange(20 * len(TIME)) + 0.5)
    acting = np.repeat(np.sin(2 * np.pi * hertz * TIME), 20)
    true = 2 * np.abs(np.mean((acting * np.exp(-2j * np.pi * hertz * fine))[whole]))
    assert 1 - true == pytest.approx((2 * np.pi * hertz * PERIOD) ** 2 / 24, rel=0.02), "holding takes this much"
    found = [motion_of(np.sin(2 * np.pi * hertz * TIME), m, cutoff=40.0) for m in (controlled(), None)]
    assert [record.held for record in found] == [True, False]
    held, as_sampled = (np.linalg.norm(r.drive[40:-40, 0]) for r in found)
    assert 1 - held / as_sampled == pytest.approx(1 - true, rel=0.03)


def jumping(size: float) -> Floats:
    """A drive (k,) that jumps between ± `size` every 0.3 to 0.8 s, and stands at nothing between."""
    draw = np.random.default_rng(2)
    pieces = [np.full(draw.integers(75, 200), level) for level in draw.permutation([-size, 0.0, size] * 8)]
    return np.concatenate(pieces)[: len(TIME)]


@pytest.mark.parametrize("held", [False, True])
def test_a_limit_that_the_samples_only_reach_takes_nothing_of_what_the_low_pass_adds(held: bool) -> None:
    """Where samples jump, the low-passed drive overshoots; a limit that acted on it would cut that off."""
    record = motion_of(jumping(5.0), controlled() if held else None)
    assert np.abs(record.drive).max() > 5.2, "the low-pass overshoots"
    np.testing.assert_allclose(record.driven(NONE, np.array([5.0]), NONE), record.drive, atol=1e-9)
    np.testing.assert_allclose(record.driven(NONE, np.array([5.0 - 1e-9]), NONE), record.drive, atol=1e-7)


@pytest.mark.parametrize("held", [False, True])
def test_a_limit_below_the_samples_makes_smaller_jumps_of_them(held: bool) -> None:
    machine = controlled() if held else None
    record, smaller = motion_of(jumping(5.0), machine), motion_of(jumping(3.0), machine)
    np.testing.assert_allclose(record.driven(NONE, np.array([3.0]), NONE), smaller.drive, atol=1e-9)


@pytest.mark.parametrize("late", [0.004, 0.011])
def test_a_limit_acts_on_a_drive_that_acts_late_as_well(late: float) -> None:
    wave = 4.0 * np.sin(3.0 * TIME)
    record = motion_of(wave)
    found = record.driven(np.array([late]), np.array([2.5]), NONE)
    later = np.clip(4.0 * np.sin(3.0 * (record.time - late)), -2.5, 2.5)
    np.testing.assert_allclose(found[20:-20, 0], later[20:-20], atol=0.06)


def standing(stretch: float, every: float, size: float = 9.0) -> Floats:
    """A drive (k,) that swings, and stands at ± `size` for `stretch` s once in `every` s."""
    drive: Floats = 4.0 * np.sin(2.7 * TIME)
    for number, begin in enumerate(np.arange(0.5, TIME[-1] - 0.5, every)):
        drive[(begin <= TIME) & (begin + stretch > TIME)] = size * (-1) ** number
    return drive


def share_left(record: RecordedMotion, missing: Floats) -> float:
    """Share of the mean square of a torque (r,) that `subtract_unknown` leaves of it."""
    whole = record.compared(low_pass(missing[:: round(record.period / PERIOD), None], 3 * CUTOFF, record.period))
    left = record.subtract_unknown(whole)
    moving = record.moving[:, 0]
    return float((left[moving] ** 2).sum() / (whole[moving] ** 2).sum())


def test_torque_missing_only_at_a_limit_leaves_little_and_elsewhere_all() -> None:
    # A torque that is missing only while a drive stands at its largest value leaves next to nothing
    record = motion_of(standing(0.12, 0.8))
    at_limit = record.at_limit[:, 0]
    assert 0.1 < at_limit.mean() < 0.2
    draw = np.random.default_rng(4)
    constant = np.where(at_limit, np.repeat(draw.uniform(0.5, 3.0, 20), 100)[: len(at_limit)], 0.0)
    slowly = np.where(at_limit, 1.0 + 0.8 * np.sin(11.0 * TIME[: len(at_limit)]), 0.0)
    assert share_left(record, constant) < 1e-3
    assert share_left(record, slowly) < 1e-2
    # A torque that is missing elsewhere is kept
    record = motion_of(standing(0.12, 0.8))
    time = TIME[: len(record.at_limit)]
    far = np.abs(((time - 0.56) % 0.8) - 0.4) < 0.15
    assert not (far & record.at_limit[:, 0]).any()
    assert share_left(record, np.where(far, np.sin(9.0 * time), 0.0)) > 0.9
    assert share_left(record, 0.3 + np.sin(2.0 * time)) > 0.6, "what acts all the time is kept between"
    # A joint with too many pieces is not known at all
    record = motion_of(standing(0.16, 0.32))
    assert 0.4 < record.at_limit.mean() < 0.6
    assert share_left(record, np.sin(2.0 * TIME)) < 1e-20
    resting = record.subtract_unknown(np.ones((len(record.moving), 1)))[~record.moving[:, 0]]
    assert (resting == 1.0).all(), "samples at rest are not touched"


def test_dimensions_that_are_projected_away_count_as_no_samples() -> None:
    record, free, lost = (motion_of(d) for d in (standing(0.12, 0.8), 4.0 * np.sin(2.7 * TIME), standing(0.16, 0.32)))
    assert free.unknown_count.tolist() == [0]
    assert lost.unknown_count.tolist() == lost.moving.sum(axis=0).tolist()
    own, every = (samples_of([one]) for one in (record, free))
    rows = sum(r.stop - r.start for _, r in own.runs[0])
    assert 0 < record.unknown_count[0] < rows
    assert own.told.tolist() == [rows - record.unknown_count[0]]
    white = np.random.default_rng(2).standard_normal((len(record.moving), 1))
    assert float(own.mean_squares([record.subtract_unknown(white)])[0]) == pytest.approx(1.0, abs=0.25)
    assert every.told[0] == sum(r.stop - r.start for _, r in every.runs[0])
    assert np.isnan(samples_of([lost]).mean_squares([lost.subtract_unknown(white)])[0])


@pytest.mark.parametrize(
    ("machine", "travel", "round_"),
    [(bench_machine, 6.5, True), (bench_machine, 6.0, False), (slide_machine, 6.5, False)],
)
def test_a_joint_turns_round_once_it_has_moved_by_more_than_a_turn(
    machine: Callable[[], Machine], travel: float, round_: bool
) -> None:
    record: Any = SimpleNamespace(position=np.array([[0.0], [travel]]))
    assert turns_round([record], machine()).tolist() == [round_]
