"""Via points and 4-3-4 trajectories (section 3.7 of the source), and the forward kinematics that they need."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.contracts.errors import SpecError
from daq.safety import check_plan
from daq.trajectories.kinematics import link_ends
from daq.trajectories.pick_and_place import evaluate, last_link, polynomials
from tests.daq.trajectories.machines import MA2000, PERIOD, UNIT, motion, planned

BENT = {2: math.radians(60), 3: math.radians(-90)}
OVER = {1: math.radians(40), 2: math.radians(5), 3: math.radians(10)}


def test_via_points_pass_their_times_and_are_checked_like_all_motions() -> None:
    points = [{1: 0.2, 2: 0.1}, {1: 0.3, 2: -0.1}, {1: 0.1, 2: 0.0}]
    made = motion(joints=(1, 2), trajectory={"kind": "via", "points": points, "times": [1.0, 1.6, 3.0]})
    moved = made.angles - made.angles[0]
    for time, point in zip((1.0, 1.6, 3.0), points, strict=True):
        assert moved[round(time / PERIOD), :2] == pytest.approx([point[1], point[2]], abs=1e-12)
    speed, acceleration = np.diff(moved, axis=0), np.diff(moved, 2, axis=0)
    assert np.abs(speed[[0, -1]]).max() < 0.05 * np.abs(speed).max(), "at rest at both ends"
    assert np.abs(np.diff(acceleration, axis=0)).max() < 0.1 * np.abs(acceleration).max(), "without a jerk between"
    assert [(m.index, m.message) for m in made.marks if m.kind == "waypoint"] == [
        (50, "via point 1 of 2"),
        (80, "via point 2 of 2"),
    ]
    move = {"kind": "via", "points": [0.2, 0.1], "times": [1.0, 2.0]}
    sequence = {"kind": "sequence", "segments": [{"move": move, "joints": [2]}, {"move": move, "joints": [2]}]}
    made = motion(joints=(1, 2), trajectory=sequence)
    assert made.angles[-1, :2] - made.angles[0, :2] == pytest.approx([0, 0.2])
    quick = motion(joints=(1,), trajectory={"kind": "via", "points": [1.0], "times": [0.3]})
    assert [one.rule for one in check_plan(quick, MA2000, MA2000.limits)] == ["speed"]
    with pytest.raises(SpecError, match=r"via: time to point 2: .* is too short"):
        planned(joints=(1,), trajectory={"kind": "via", "points": [0.1, 0.2], "times": [1, 1.001]})


@pytest.mark.parametrize(
    ("trajectory", "expected"),
    [
        ({"points": [0.1], "times": [1, 2]}, "2 times for 1 points"),
        ({"points": [0.1, 0.2], "times": [2, 1]}, "times must increase strictly"),
        ({"points": [{3: 0.1}], "times": [1]}, r"a point is given for joints \[3\], the motion is on \[1\]"),
    ],
)
def test_via_points_that_do_not_fit(trajectory: dict[str, object], expected: str) -> None:
    with pytest.raises(SpecError, match=expected):
        planned(joints=(1,), trajectory={"kind": "via"} | trajectory)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4), st.lists(st.floats(0.05, 20), min_size=3, max_size=3))
def test_the_4_3_4_meets_its_fourteen_conditions(knots: list[float], durations: list[float]) -> None:
    times = np.array(durations)
    pieces = polynomials(np.array(knots)[:, None], times)
    assert [len(one) for one in pieces] == [5, 4, 5]
    ends = np.concatenate([[0.0], np.cumsum(times)])
    scale = 1 + max(abs(k) for k in knots) / times.min() ** 2
    for piece in range(3):
        coefficients = pieces[piece][:, 0]
        for at, knot in ((0, piece), (1, piece + 1)):
            assert np.polynomial.polynomial.polyval(at, coefficients) == pytest.approx(knots[knot], abs=1e-9)
    for order in (1, 2):
        rates = [np.polynomial.polynomial.polyder(one[:, 0], order) for one in pieces]
        value = [
            [np.polynomial.polynomial.polyval(at, rate) / length**order for at in (0, 1)]
            for rate, length in zip(rates, times, strict=True)
        ]
        assert [value[0][0], value[2][1]] == pytest.approx([0, 0], abs=1e-8 * scale)
        assert [value[0][1], value[1][1]] == pytest.approx([value[1][0], value[2][0]], abs=1e-8 * scale)
    assert evaluate(pieces, times, ends)[:, 0] == pytest.approx(knots, abs=1e-9)


def pick_and_place(**own: object) -> dict[str, object]:
    return {"kind": "pick_and_place", "amplitude": OVER, "pick": 1.0, "travel": 2.0, "place": 1.0} | own


def test_a_pick_and_place_passes_above_both_places_and_is_at_rest_at_its_ends() -> None:
    # The arms end passes straight above both places
    made = motion(start=BENT, trajectory=pick_and_place(lift=0.05))
    ends = link_ends(MA2000, made.angles)[:, -1]
    for lifted, place in ((50, 0), (150, -1)):
        assert ends[lifted] - ends[place] == pytest.approx([0, 0, 0.05], abs=1e-5)
    assert made.angles[-1, :3] - made.angles[0, :3] == pytest.approx(list(OVER.values()), abs=1e-12)
    assert (ends[:, 2] >= min(ends[0, 2], ends[-1, 2]) - 1e-3).all()
    assert check_plan(made, MA2000, MA2000.limits) == []
    assert [(m.index, m.message) for m in made.marks if m.kind == "waypoint"] == [
        (50, "lift-off point"),
        (150, "set-down point"),
    ]
    # It begins and ends at rest without a jerk
    made = motion(start=BENT, trajectory=pick_and_place())
    speed = np.diff(made.angles, axis=0) / PERIOD
    acceleration = np.diff(speed, axis=0) / PERIOD
    assert np.abs(speed[[0, -1]]).max() < 0.01 * np.abs(speed).max()
    assert np.abs(np.diff(acceleration, axis=0)).max() < 0.2 * np.abs(acceleration).max()
    # A lift of less than a quarter of the last link is refused
    assert last_link(MA2000) == pytest.approx(0.16841)
    with pytest.raises(SpecError, match=r"lift of 0.042 m: allowed are 0.0421 m and more"):
        motion(start=BENT, trajectory=pick_and_place(lift=0.042))


@pytest.mark.parametrize(
    "fields", [{"start": {3: 0.0}}, {"start": BENT, "joints": (1,)}, {"start": BENT, "joints": (2,)}], ids=repr
)
def test_a_lift_that_these_joints_cannot_make_is_refused(fields: dict[str, object]) -> None:
    with pytest.raises(SpecError, match=r"cannot lift the arm's end straight up by 0.05 m"):
        motion(trajectory={"kind": "pick_and_place", "amplitude": 20 * UNIT}, **fields)


def test_repeats_go_back_slowly_and_lift_again() -> None:
    made = motion(start=BENT, trajectory=pick_and_place(), repeats=2)
    ends = link_ends(MA2000, made.angles)[:, -1, 2]
    lifted = [mark.index for mark in made.marks if mark.message == "lift-off point"]
    assert len(lifted) == 2
    assert ends[lifted[1]] == pytest.approx(ends[lifted[0]], abs=1e-4)


# ---- Forward kinematics of the chain in machine files

A2, A3 = 0.285755, 0.16841
angle = st.floats(-math.pi, math.pi)


def ends(*angles: float) -> np.ndarray:
    return link_ends(MA2000, np.array([angles + (0.0,) * (6 - len(angles))]))[0]


@given(angle, angle, angle)
def test_major_axes_agree_with_plane_geometry(waist: float, shoulder: float, elbow: float) -> None:
    radius = A2 * math.cos(shoulder) + A3 * math.cos(shoulder + elbow)
    height = A2 * math.sin(shoulder) + A3 * math.sin(shoulder + elbow)
    expected = [radius * math.cos(waist), radius * math.sin(waist), height]
    assert ends(waist, shoulder, elbow)[2] == pytest.approx(expected, abs=1e-12)


@given(st.lists(angle, min_size=6, max_size=6))
def test_no_link_changes_its_length(angles: list[float]) -> None:
    origins = np.concatenate([np.zeros((1, 3)), ends(*angles)])
    lengths = np.linalg.norm(np.diff(origins, axis=0), axis=1)
    assert lengths == pytest.approx([0, A2, A3, 0, 0, 0], abs=1e-12)


def test_a_prismatic_joint_moves_along_its_axis() -> None:
    first = MA2000.joints[0].model_copy(update={"kind": "prismatic"})
    slide = MA2000.model_copy(update={"joints": (first,)})
    assert link_ends(slide, np.array([[0.25]]))[0, 0] == pytest.approx([0, 0, 0.25])
