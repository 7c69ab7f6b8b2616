"""Where a recorded drive stands at a limit that no file states."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.arrays import Floats
from model.inverse_dynamics.drive_limits import LATER, at_shown_limit, pieces_of, stands_at_limit
from tests.model.discrepancy.inverse_dynamics.rigs import bench_machine, six_machine, slide_machine

WAVE = np.sin(0.05 * np.arange(600))


def at_limit(drive: Floats) -> list[int]:
    """Samples of a sliding joint's drive (r,) that stand at its limit."""
    return np.flatnonzero(stands_at_limit(drive[:, None], slide_machine())[:, 0]).tolist()


def with_runs(*runs: tuple[int, int, float]) -> Floats:
    """A wave with stretches (first, count) of one value."""
    drive: Floats = WAVE.copy()
    for first, count, value in runs:
        drive[first : first + count] = value
    return drive


def test_a_drive_that_passes_its_largest_value_stands_at_no_limit() -> None:
    assert at_limit(WAVE) == []
    assert at_limit(with_runs((100, 2, 3.0), (300, 2, -3.0))) == [], "two samples in a row are no stretch"


def test_a_drive_stands_at_its_largest_value_on_both_sides_where_it_stays_there_once() -> None:
    found = at_limit(with_runs((100, 3, 3.0), (300, 1, -3.0)))
    assert found == [100, 101, 102, 300], "that it stays there once shows the limit, which acts at every sample there"
    assert at_limit(with_runs((100, 40, 3.0), (300, 40, -2.9))) == list(range(100, 140))


def test_a_value_within_rounding_of_the_largest_is_the_limit_as_well() -> None:
    drive = with_runs((100, 5, 3.0))
    drive[101], drive[103] = 3.0 * (1 - 5e-7), 3.0 * (1 - 1e-4)
    drive[200:203] = 3.0
    assert at_limit(drive) == [100, 101, 102, 104, 200, 201, 202]


@pytest.mark.parametrize(("calm", "found"), [(0.05, 0), (0.15, 510)])
def test_a_drive_that_only_switches_is_taken_as_it_was_recorded(calm: float, found: int) -> None:
    drive = 3.0 * np.sign(WAVE + 0.01)
    drive[: round(calm * len(drive))] = 0.5
    assert len(at_limit(drive)) == found


def test_a_joint_without_drive_stands_at_no_limit() -> None:
    assert at_limit(np.zeros(100)) == []


def test_the_volts_of_a_dc_motor_are_at_no_unknown_limit() -> None:
    assert not stands_at_limit(with_runs((100, 50, 3.0))[:, None], bench_machine()).any()


def test_every_joint_is_judged_by_its_own_drive() -> None:
    drive = np.tile(WAVE[:, None], (1, 6))
    drive[200:230, 3] = -7.0
    found = stands_at_limit(drive, six_machine())
    assert found.any(axis=0).tolist() == [False, False, False, True, False, False]
    assert np.flatnonzero(found[:, 3]).tolist() == list(range(200, 230))


@given(mask=st.lists(st.booleans(), min_size=1, max_size=60), longest=st.integers(1, 12))
def test_pieces_cover_every_stretch_and_little_else(mask: list[bool], longest: int) -> None:
    at = np.array(mask)
    pieces = pieces_of(at, longest)
    covered = np.zeros(len(at) + LATER, dtype=bool)
    for piece in pieces:
        assert at[piece.start]
        assert 1 <= piece.stop - piece.start <= longest + LATER
        covered[piece] = True
    later = np.zeros_like(covered)
    for lag in range(LATER + 1):
        later[lag : lag + len(at)] |= at
    assert covered[: len(at)][at].all()
    assert not covered[~later].any(), "no further than the drive may act later"
    assert len({piece.start for piece in pieces}) == len(pieces)


def test_a_stretch_is_cut_into_pieces_that_reach_a_little_beyond_its_end() -> None:
    at = np.zeros(30, dtype=bool)
    at[4:14] = at[20] = True
    assert pieces_of(at, 6) == [slice(4, 10), slice(10, 14 + LATER), slice(20, 21 + LATER)]
    assert pieces_of(at, 20) == [slice(4, 14 + LATER), slice(20, 21 + LATER)]
    assert pieces_of(np.zeros(5, dtype=bool), 4) == []


def test_the_rounded_top_of_a_smooth_motion_is_no_limit_and_a_cut_one_is() -> None:
    """A drive that is rounded comes to the top of a swing step by step; where it is cut off, it jumps there."""
    time = np.arange(0.0, 4.0, 0.001)
    swing = 3.0 * np.sin(2 * np.pi * 0.9 * time) + 0.5 * np.sin(2 * np.pi * 5.0 * time)
    rounded = 0.01 * np.round(swing / 0.01)
    assert (np.abs(rounded) == np.abs(rounded).max()).sum() > 3
    assert not at_shown_limit(rounded).any()
    steep = 0.01 * np.round(np.clip(40.0 * swing, -3.0, 3.0) / 0.01)
    assert at_shown_limit(steep).mean() > 0.5


@pytest.mark.parametrize("drive", [np.zeros(20), np.full(20, 2.0)])
def test_a_drive_of_one_size_shows_no_limit(drive: Floats) -> None:
    assert not at_shown_limit(drive).any()
