"""What holds for every plan, whatever its trajectory."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import NoController
from daq.trajectories.move import plan_move
from daq.trajectories.planner import plan, start_angles
from daq.trajectories.set_points import control_period, make_plan, representable_angles
from firmware_protocol.errors import UnitsError
from tests.daq.trajectories.machines import MA2000, PERIOD, motion, planned

REST = np.array(MA2000.rest_posture)


def _moves() -> st.SearchStrategy[dict[str, object]]:
    amplitude = st.floats(-0.5, 0.5).filter(lambda angle: angle == 0 or abs(angle) > 0.01)
    short = st.floats(PERIOD, 2.0)
    return st.one_of(
        st.fixed_dictionaries({"kind": st.just("ramp"), "amplitude": amplitude, "duration": short}),
        st.fixed_dictionaries({"kind": st.just("step"), "amplitude": amplitude}),
        st.fixed_dictionaries(
            {"kind": st.just("staircase"), "amplitude": amplitude, "steps": st.integers(1, 5), "dwell": short}
        ),
        st.fixed_dictionaries(
            {
                "kind": st.just("slow_ramp"),
                "amplitude": amplitude,
                "speed": st.floats(0.1, 3),
                "reversals": st.integers(0, 3),
            }
        ),
        st.fixed_dictionaries(
            {
                "kind": st.just("sine"),
                "amplitude": amplitude,
                "period": st.floats(0.1, 2),
                "cycles": st.floats(0.25, 3),
                "phase": st.floats(-6, 6),
            }
        ),
        st.fixed_dictionaries({"kind": st.just("multisine"), "amplitude": amplitude, "duration": st.floats(0.2, 2.0)}),
        st.fixed_dictionaries({"kind": st.just("cubic"), "amplitude": amplitude, "duration": short}),
        st.fixed_dictionaries({"kind": st.just("pause"), "duration": short}),
    )


@st.composite
def specs(draw: st.DrawFn) -> ExperimentSpec:
    joints = tuple(sorted(draw(st.sets(st.integers(1, 6), min_size=1))))
    segments = [{"move": move} for move in draw(st.lists(_moves(), min_size=1, max_size=3))]
    trajectory = draw(st.sampled_from([segments[0]["move"], {"kind": "sequence", "segments": segments}]))
    return ExperimentSpec.model_validate(
        {
            "trajectory": trajectory,
            "joints": joints,
            "start": draw(st.dictionaries(st.sampled_from(joints), st.floats(0.8, 1.5))),
            "settle": draw(st.just(0) | st.floats(PERIOD, 1)),
            "hold": draw(st.just(0) | st.floats(PERIOD, 1)),
            "repeats": draw(st.integers(1, 3)),
        }
    )


@settings(max_examples=150)
@given(specs())
def test_every_plan_starts_where_the_arm_is_leaves_other_joints_alone_and_has_its_marks_in_order(
    spec: ExperimentSpec,
) -> None:
    start = start_angles(spec, MA2000)
    made = plan(spec, MA2000, start)
    assert np.array_equal(made.angles[0], representable_angles(MA2000, start))
    still = [joint - 1 for joint in range(1, 7) if joint not in spec.joints]
    assert (made.postures[:, still] == made.postures[0, still]).all()
    assert np.isfinite(made.angles).all()
    assert made.jumps.shape == (len(made),)
    assert not made.jumps[0]
    indices = [mark.index for mark in made.marks]
    assert indices == sorted(indices)
    assert (made.marks[0].kind, indices[0]) == ("start", 0)
    assert (made.marks[-1].kind, indices[-1]) == ("end", len(made) - 1)


@settings(max_examples=100)
@given(specs())
def test_repeats_are_alike_and_each_starts_where_the_first_did(spec: ExperimentSpec) -> None:
    once = plan(spec.model_copy(update={"repeats": 1}), MA2000, start_angles(spec, MA2000))
    made = plan(spec, MA2000, start_angles(spec, MA2000))
    starts = [mark.index for mark in made.marks if mark.message.startswith("repeat ")] or [0]
    assert len(starts) == spec.repeats
    for start in starts:
        assert made.angles[start : start + len(once)] == pytest.approx(once.angles, abs=1e-9)


@given(st.integers(1, 6), st.lists(st.floats(-0.7, 0.7), min_size=1, max_size=20))
def test_postures_are_rounded_by_the_rule_of_the_wire(joint: int, angles: list[float]) -> None:
    calibration = MA2000.calibration(joint)
    all_angles = np.tile(REST, (len(angles), 1))
    all_angles[:, joint - 1] += angles
    made = make_plan(MA2000, (joint,), all_angles)
    for angle, posture in zip(all_angles[:, joint - 1].tolist(), made.postures[:, joint - 1].tolist(), strict=True):
        try:
            assert posture == calibration.rad_to_posture(angle)
        except UnitsError:
            assert not 0 <= posture <= 999


@given(st.integers(1, 6), st.integers(0, 999))
def test_a_posture_is_where_it_is_snapped_to(joint: int, posture: int) -> None:
    angles = REST.tolist()
    angles[joint - 1] = MA2000.calibration(joint).posture_to_rad(posture)
    made = make_plan(MA2000, (), representable_angles(MA2000, angles)[None, :])
    assert made.postures[0, joint - 1] == posture


@pytest.mark.parametrize(
    ("angles", "line"),
    [
        ([math.nan, 0, 0, 0, 0, 0], "joint 1: start of nan rad: must be finite"),
        ([math.pi, 0, 3.0, 0, 0, 0], r"joint 3: start of 171\.89° is outside its range of -135\.00° to 134\.73°"),
        ([0.0] * 5, "start: 5 angles, ma2000 has 6 joints"),
    ],
)
def test_a_start_that_cannot_be_is_refused(angles: list[float], line: str) -> None:
    with pytest.raises(SpecError, match=line):
        plan(ExperimentSpec(), MA2000, angles)


@pytest.mark.parametrize(
    "spec",
    [
        {"trajectory": {"kind": "sine", "period": 3600, "cycles": 1000}},
        {"trajectory": {"kind": "path", "times": (0, 1e12), "positions": ((3.1,), (3.2,))}, "joints": (1,)},
        {"trajectory": {"kind": "ramp", "duration": 3600}, "repeats": 1000},
        {"trajectory": {"kind": "sequence", "segments": [{"move": {"kind": "pause", "duration": 3600}}] * 1000}},
    ],
)
def test_what_would_take_longer_than_four_hours_is_refused_before_it_fills_the_memory(spec: dict[str, object]) -> None:
    with pytest.raises(SpecError, match="at most 4 h are allowed"):
        planned(**spec)


def test_what_cannot_be_planned_is_refused_and_what_lies_outside_planned_as_it_is() -> None:
    small = MA2000.model_copy(update={"joints": MA2000.joints[:2], "rest_posture": (3.1, 0.8)})
    with pytest.raises(SpecError, match="joint 3: ma2000 has joints 1 to 2"):
        plan(ExperimentSpec(), small, (3.1, 0.8))
    with pytest.raises(SpecError, match="joint 3: ma2000 has joints 1 to 2"):
        start_angles(ExperimentSpec(), small)
    bench = MA2000.model_copy(update={"controller": NoController(kind="none")})
    with pytest.raises(SpecError, match="no controller"):
        control_period(bench)
    angles = np.tile(REST, (3, 1))
    angles[2, 3] = math.inf
    with pytest.raises(SpecError, match="joint 4, set point 2: inf rad: must be finite"):
        make_plan(MA2000, (4,), angles)
    made = motion(joints=(1,), trajectory={"kind": "step", "amplitude": math.radians(200)})
    assert made.postures[-1, 0] == 500 + 741
    angles = REST.tolist()
    angles[0] = MA2000.calibration(1).counts_to_rad(4095)
    assert make_plan(MA2000, (), representable_angles(MA2000, angles)[None, :]).postures[0, 0] == 999


def test_start_is_the_spec_then_the_path_then_the_rest_posture() -> None:
    path = {"kind": "path", "times": (0, 1), "positions": ((3.0, 1.0), (3.1, 1.1))}
    spec = ExperimentSpec.model_validate({"trajectory": path, "joints": (1, 2), "start": {1: 2.0}})
    assert start_angles(spec, MA2000) == (2.0, 1.0, *REST[2:])
    homeless = MA2000.model_copy(update={"rest_posture": None})
    with pytest.raises(SpecError, match=r"start: joints \[1, 3, 4, 5, 6\] have none"):
        start_angles(ExperimentSpec(start={2: 1.0}), homeless)


def test_preview_tells_what_will_move_how_fast_and_in_which_steps() -> None:
    preview = planned().preview()
    assert [joint.joint for joint in preview.joints if joint.moves] == [1, 2, 3]
    assert preview.joints[0].top_speed == pytest.approx(math.radians(21.6) / 0.65)
    assert preview.joints[3].top_speed == 0
    assert preview.duration == pytest.approx(3.16)
    assert preview.as_data()["set_points"] == 159
    joint = motion(joints=(1,), trajectory={"kind": "step", "amplitude": 0.1}).preview().joints[0]
    assert (joint.top_speed, joint.largest_step) == (0, pytest.approx(0.1))


@given(st.lists(st.tuples(st.floats(-1.4, 1.4), st.floats(-1.4, 1.4)), min_size=6, max_size=6), st.floats(0.05, 1.0))
def test_a_move_to_a_start_arrives_together_within_its_speed(ends: list[tuple[float, float]], speed: float) -> None:
    offset = np.array([math.pi, math.pi / 2, 0, 0, 0, 0])
    start, target = (offset + [pair[end] for pair in ends] for end in (0, 1))
    made = plan_move(MA2000, start.tolist(), target.tolist(), speed)
    assert np.array_equal(made.angles[0], representable_angles(MA2000, start.tolist()))
    assert made.angles[-1] == pytest.approx(representable_angles(MA2000, target.tolist()))
    assert np.abs(np.diff(made.angles, axis=0)).max(initial=0) <= speed * PERIOD * (1 + 1e-9)
    assert set(made.moving) == {joint + 1 for joint in np.flatnonzero(made.postures[0] != made.postures[-1])}
