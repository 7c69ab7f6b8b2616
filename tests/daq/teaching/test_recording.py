"""Recorded paths: thinning and playing back."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from daq.contracts.errors import SpecError
from daq.safety import check_plan
from daq.teaching.recording import RecordedPath, playback
from daq.trajectories.planner import plan, start_angles
from tests.daq.teaching.stand_in import MA2000, REST


def recorded(*angles: float) -> RecordedPath:
    return RecordedPath(
        joints=(1,), times=tuple(k * 0.02 for k in range(len(angles))), positions=tuple((a,) for a in angles)
    )


WAVE = recorded(*(math.pi + 0.2 * math.sin(k / 50) for k in range(500)))


@pytest.mark.parametrize("rate", [0.5, 1.0, 2.0])
def test_playback_goes_where_the_hand_went_at_the_rate_asked_for(rate: float) -> None:
    spec = playback(WAVE, rate)
    made = plan(spec, MA2000, start_angles(spec, MA2000))
    assert check_plan(made, MA2000, MA2000.limits) == []
    motion = made.time - spec.settle
    inside = (motion >= 0.02) & (motion <= WAVE.duration / rate)
    expected = np.interp(motion[inside] * rate, WAVE.times, [row[0] for row in WAVE.positions])
    assert made.angles[inside, 0] == pytest.approx(expected, abs=1e-9)


def test_playback_starts_at_the_first_point_of_the_path() -> None:
    assert start_angles(playback(WAVE), MA2000) == (WAVE.positions[0][0], *REST[1:])


def test_a_path_longer_than_the_originals_sixty_seconds_plays() -> None:
    spec = playback(recorded(*(math.pi + 0.1 * math.sin(k / 200) for k in range(10_000))))
    made = plan(spec, MA2000, start_angles(spec, MA2000))
    assert made.duration > 199
    assert check_plan(made, MA2000, MA2000.limits) == []


def test_too_fast_a_playback_is_stopped_by_the_limits_before_anything_moves() -> None:
    spec = playback(WAVE, 10)
    rules = {v.rule for v in check_plan(plan(spec, MA2000, start_angles(spec, MA2000)), MA2000, MA2000.limits)}
    assert rules == {"speed"}


@pytest.mark.parametrize("rate", [0, -1, math.nan, math.inf, 11])
def test_a_rate_that_cannot_be_is_refused(rate: float) -> None:
    with pytest.raises(SpecError, match=r"allowed are 0\.01 to 10"):
        playback(WAVE, rate)


@given(st.lists(st.floats(-1, 1), min_size=2, max_size=60), st.floats(0.001, 0.3))
def test_thinning_keeps_every_recorded_point_within_its_tolerance(angles: list[float], within: float) -> None:
    path = recorded(*angles)
    thin = path.thinned(within)
    back = np.interp(path.times, thin.times, [row[0] for row in thin.positions])
    assert np.abs(back - angles).max() <= within + 1e-12
    assert (thin.times[0], thin.times[-1]) == (path.times[0], path.times[-1])
    assert set(thin.times) <= set(path.times)


def test_thinning_leaves_rests_and_straight_lines_out() -> None:
    assert len(recorded(*([1.0] * 1000)).thinned(0.001).times) == 2
    assert len(recorded(*np.linspace(0, 1, 1000)).thinned(0.001).times) == 2


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"joints": (2, 1)}, "different and ascending"),
        ({"times": (0, 1, 2)}, "3 times for 2 rows"),
        ({"times": (0, 0)}, "increase strictly"),
        ({"positions": ((1.0,), (1.0, 2.0))}, "every row of positions needs 2 angles"),
        ({"positions": ((1.0, 1.0), (math.nan, 2.0))}, "finite"),
    ],
)
def test_a_path_that_cannot_be_is_refused(fields: dict[str, object], line: str) -> None:
    good = {"joints": (1, 2), "times": (0, 1), "positions": ((1.0, 1.0), (1.1, 1.1))}
    RecordedPath.model_validate(good)
    with pytest.raises(ValidationError, match=line):
        RecordedPath.model_validate(good | fields)
