"""A plan is judged as a whole before anything moves; every objection is one clear line."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.contracts.errors import SafetyError, SpecError
from daq.contracts.experiment import ExperimentSpec, Ramp
from daq.contracts.limits import JointLimits, Limits
from daq.contracts.machine import Machine
from daq.safety import check_move_to_start, check_plan, largest_step, unchecked
from daq.safety.planned import planned
from daq.safety.violation import TOLERANCE
from daq.trajectories.kinematics import link_ends
from daq.trajectories.move import plan_move
from daq.trajectories.planner import plan, start_angles
from daq.trajectories.set_points import make_plan
from tests.daq.safety.arms import COUNT, LIMITS, MA2000, REST, limits, plan_of
from tests.daq.sliding_axis import slide_and_turn


def test_the_default_ramp_is_allowed_and_an_experiment_outside_is_refused() -> None:
    spec = ExperimentSpec()
    assert check_plan(plan(spec, MA2000, start_angles(spec, MA2000)), MA2000, LIMITS) == []
    with pytest.raises(SafetyError, match=r"joint \d: .*°/s .*allowed are up to"):
        planned(ExperimentSpec(trajectory=Ramp(amplitude=math.radians(40), duration=0.2)), MA2000)
    spec = ExperimentSpec()
    assert np.array_equal(planned(spec, MA2000), plan(spec, MA2000, start_angles(spec, MA2000)).angles)


@pytest.mark.parametrize(
    ("joint", "target", "line"),
    [
        (2, 3.95, r"joint 2: 226\.32° at 10\.00 s: allowed are -44\.69° to 224\.60°"),
        (2, -0.8, r"joint 2: -45\.84° at 10\.00 s: allowed are -44\.69° to 224\.60°"),
        (4, 1.58, r"joint 4: 90\.53° at 10\.00 s: allowed are -89\.38° to 89\.38°"),
    ],
)
def test_an_angle_outside_a_joints_range_is_a_violation(joint: int, target: float, line: str) -> None:
    way = np.linspace(REST[joint - 1], target, 501)
    (found, *_) = [v for v in check_plan(plan_of(joint, *way), MA2000, LIMITS) if v.rule == "range"]
    assert str(found) == line.replace("\\", "")
    assert (found.joint, found.time, found.value) == (joint, pytest.approx(10.0), pytest.approx(target))


def test_range_is_that_of_set_points_from_0_to_999() -> None:
    way = np.linspace(math.pi, math.pi + math.radians(140), 1001)
    (found,) = check_plan(plan_of(1, *way), MA2000, Limits())
    assert str(found) == "joint 1: posture 1019 at 20.00 s: allowed are 0 to 999"
    (found,) = check_plan(plan_of(1, *(2 * math.pi - way)), MA2000, Limits())
    assert str(found) == "joint 1: posture -19 at 20.00 s: allowed are 0 to 999"
    unit = 1.5 * math.pi / 1000
    lowest = MA2000.calibration(1).posture_to_rad(0)
    assert check_plan(plan_of(1, lowest, lowest + 999 * unit), MA2000, Limits()) == []
    (below,) = check_plan(plan_of(1, math.pi, lowest - unit), MA2000, Limits())
    (above,) = check_plan(plan_of(1, math.pi, lowest + 1000 * unit), MA2000, Limits())
    assert [(v.rule, v.joint, v.value, v.limit) for v in (below, above)] == [
        ("posture", 1, -1, 0),
        ("posture", 1, 1000, 999),
    ]
    assert [v.time for v in (below, above)] == [0.02, 0.02]


def test_what_lies_exactly_at_a_limit_is_allowed() -> None:
    # Rest posture and limits are written in rad; set points are whole postures. Half a unit is not a
    # violation
    high = REST[0] + 0.1
    inside = limits(joints=(JointLimits(high=high),))
    assert check_plan(plan_of(1, REST[0], high + 0.002), MA2000, inside) == []
    assert [v.rule for v in check_plan(plan_of(1, REST[0], high + 0.003), MA2000, inside)] == ["range"]
    # An angle may lie half a posture unit and a rounding outside
    slack = math.pi / 1000 / 2 + 1e-9
    for joint_limits, side in ((JointLimits(high=0.0), 1), (JointLimits(low=0.0), -1)):
        own = Limits(joints=(*[JointLimits()] * 3, joint_limits))
        assert check_plan(plan_of(4, side * slack), MA2000, own) == []
        (found,) = check_plan(plan_of(4, side * math.nextafter(slack, 1)), MA2000, own)
        assert (found.rule, found.joint, found.time, found.limit) == ("range", 4, 0.0, 0.0)
        side_said = "any to 0.00°" if side > 0 else "0.00° to any"
        assert str(found).endswith(f"allowed are {side_said}")
    # The largest speed and the largest step are allowed
    own = Limits(joints=(*[JointLimits()] * 3, JointLimits(speed=0.5)), following_error_counts=112)
    change = 0.5 * 0.02 + 1e-9
    assert check_plan(plan_of(4, 0.0, change), MA2000, own) == []
    (found,) = check_plan(plan_of(4, 0.0, math.nextafter(change, 1)), MA2000, own)
    assert (found.rule, found.joint, found.time, found.limit) == ("speed", 4, 0.0, 0.5)
    step = 100 * math.pi / 4096 + 1e-9
    assert check_plan(plan_of(4, 0.0, step, jumps=True), MA2000, own) == []
    (found,) = check_plan(plan_of(4, 0.0, math.nextafter(step, 1), jumps=True), MA2000, own)
    assert (found.rule, found.joint, found.time) == ("step", 4, 0.02)
    # A link that is exactly the tolerance beyond floor or reach is allowed
    still = plan_of(2, REST[1], REST[1])
    ends = link_ends(MA2000, still.angles)
    lowest, furthest = float(ends[:, :, 2].min()), float(np.linalg.norm(ends, axis=2).max())
    floor, reach = lowest + TOLERANCE, furthest - TOLERANCE
    assert (floor - TOLERANCE, reach + TOLERANCE) == (lowest, furthest), "no rounding comes between"
    assert check_plan(still, MA2000, Limits(floor_height=floor, reach=reach)) == []
    tighter = Limits(floor_height=floor + 1e-12, reach=reach - 1e-12)
    assert [violation.rule for violation in check_plan(still, MA2000, tighter)] == ["floor", "reach"]


def test_speed_is_that_of_the_planned_angles_and_names_its_fastest_moment() -> None:
    # At 0.118 rad/s half of all periods send one unit, which would be 0.236 rad/s, and half none
    own = limits(joints=(JointLimits(speed=0.12),))
    way = REST[0] + 0.118 * 0.02 * np.arange(100)
    plan = plan_of(1, *way)
    assert np.diff(plan.postures[:, 0]).max() * 1.5 * math.pi / 1000 / 0.02 > 0.12
    assert check_plan(plan, MA2000, own) == []
    (found,) = check_plan(plan_of(1, math.pi, 3.15, 3.2, 3.21), MA2000, LIMITS)
    assert str(found).startswith("joint 1: 143.2 °/s at 0.02 s: allowed are up to 91.7 °/s")


def test_steps_are_judged_by_their_size() -> None:
    assert check_plan(plan_of(1, math.pi, math.pi + 115 * COUNT, jumps=True), MA2000, LIMITS) == []
    (found,) = check_plan(plan_of(1, math.pi, math.pi + 116 * COUNT, jumps=True), MA2000, LIMITS)
    assert str(found) == (
        "joint 1: step of 7.65° at 0.02 s: allowed are up to 7.58° (following-error limit less 12 counts)"
    )
    assert largest_step(MA2000, LIMITS, 4) == pytest.approx(largest_step(MA2000, LIMITS, 1) / 1.5)  # type: ignore[operator]
    assert largest_step(MA2000, Limits(), 1) is None
    for limit in (1, 12, 13):
        assert largest_step(MA2000, Limits(following_error_counts=limit), 4) == pytest.approx(math.pi / 4096)
    assert largest_step(MA2000, Limits(following_error_counts=14), 4) == pytest.approx(2 * math.pi / 4096)


def test_set_points_are_subdivided_where_they_are_more_than_a_degree_apart() -> None:
    """The arm reaches furthest when its forearm is straight: between these set points."""
    straight = float(np.linalg.norm(link_ends(MA2000, plan_of(3, 0.0).angles), axis=2).max())

    def passing(degrees: float) -> list[str]:
        way = plan_of(3, -math.radians(degrees) / 2, math.radians(degrees) / 2)
        return [f"{v.rule} {v.joint} {v.time:.2f}" for v in check_plan(way, MA2000, Limits(reach=straight - 1e-7))]

    assert passing(0.99) == []
    assert passing(1.01) == ["reach 3 0.01"]


def test_an_arm_outside_its_limits_may_come_back_but_not_go_further() -> None:
    near, far = math.radians(60), math.radians(30)
    reach = Limits(reach=float(np.linalg.norm(link_ends(MA2000, plan_of(3, math.radians(90)).angles), axis=2).max()))
    assert [v.rule for v in check_plan(plan_of(3, near), MA2000, reach)] == ["reach"]
    assert check_move_to_start(plan_of(3, near, math.radians(90)), MA2000, reach) == []
    assert [v.rule for v in check_move_to_start(plan_of(3, near, far), MA2000, reach)] == ["reach"]
    below = [REST[0], math.radians(-43), *REST[2:]]
    assert check_move_to_start(plan_move(MA2000, below, REST.tolist()), MA2000, LIMITS) == []
    deeper = [REST[0], math.radians(-44), *REST[2:]]
    assert check_move_to_start(plan_move(MA2000, below, deeper), MA2000, LIMITS)[0].rule == "floor"
    outside = [*REST[:3], math.radians(89.8), *REST[4:]]
    further = [*REST[:3], math.radians(89.95), *REST[4:]]
    tight = limits(joints=(*LIMITS.joints[:3], JointLimits(low=-1.5, high=1.5, speed=2.0), *LIMITS.joints[4:]))
    back = plan_move(MA2000, outside, REST.tolist())
    assert [v.rule for v in check_plan(back, MA2000, tight)] == ["range"]
    assert check_move_to_start(back, MA2000, tight) == []
    away = plan_move(MA2000, REST.tolist(), further)
    assert [v.rule for v in check_move_to_start(away, MA2000, tight)] == ["range"]


def test_a_link_below_the_floor_or_beyond_the_reach_is_a_violation() -> None:
    # A link below the floor is a violation
    way = np.linspace(REST[1], math.radians(-44), 501)
    (found,) = check_plan(plan_of(2, *way), MA2000, LIMITS)
    assert str(found) == "end of link 3: height of -315 mm at 10.00 s: allowed are -300 mm and above"
    assert (found.rule, found.joint, found.limit) == ("floor", 3, -0.3)
    assert (found.value, found.time) == (pytest.approx(-0.315, abs=5e-4), pytest.approx(10.0))
    # A link beyond the reach is a violation
    way = np.linspace(math.radians(90), 0, 501)
    assert check_plan(plan_of(3, *way), MA2000, limits(reach=0.4545)) == []
    (found,) = check_plan(plan_of(3, *way), MA2000, limits(reach=0.45))
    assert str(found) == "end of link 3: 454 mm from the base at 10.00 s: allowed are up to 450 mm"
    assert (found.rule, found.joint, found.limit) == ("reach", 3, 0.45)
    assert (found.value, found.time) == (pytest.approx(0.454, abs=5e-4), pytest.approx(10.0))
    # Both ends of this jump are above the floor; in its middle the forearm points straight down, 311 mm
    # deep
    ends = np.tile(REST, (2, 1))
    ends[:, 1] = math.radians(-30)
    ends[:, 2] = np.radians([-90, -30])
    jump = make_plan(MA2000, (3,), ends, np.array([False, True]))
    for row in (0, 1):
        assert check_plan(make_plan(MA2000, (), ends[row : row + 1]), MA2000, LIMITS) == []
    (found,) = check_plan(jump, MA2000, limits(following_error_counts=None))
    assert str(found) == "end of link 3: height of -311 mm at 0.01 s: allowed are -300 mm and above"


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_not_a_number_is_refused(bad: float) -> None:
    good = plan_of(1, math.pi, 3.15, 3.16)
    angles = good.angles.copy()
    angles[2, 4] = bad
    (found,) = check_plan(dataclasses.replace(good, angles=angles), MA2000, LIMITS)
    assert str(found) == f"joint 5: set point of {bad} rad at 0.04 s: must be finite"
    assert (found.joint, found.time) == (5, pytest.approx(0.04))
    assert check_move_to_start(dataclasses.replace(good, angles=angles), MA2000, LIMITS)[0].rule == "finite"


def test_limits_that_are_not_set_are_not_checked_and_said_to_be_so() -> None:
    assert check_plan(plan_of(1, math.pi, 3.9), MA2000, Limits()) == []
    lines = unchecked(MA2000, Limits(joints=(JointLimits(low=0, high=1, speed=1), JointLimits(low=0))))
    assert lines == [
        "joint 2: high, speed not set, not checked",
        *(f"joint {joint}: low, high, speed not set, not checked" for joint in range(3, 7)),
        "floor_height not set, not checked",
        "reach not set, not checked",
        "following_error_counts not set, not checked",
        "following_error_time not set, not checked",
    ]
    assert unchecked(MA2000, Limits())[0] == "joint 1: low, high, speed not set, not checked"
    assert unchecked(MA2000, LIMITS) == ["reach not set, not checked"]


@pytest.mark.parametrize("side", [-1, 1])
def test_an_arm_outside_its_limits_cannot_creep_further_out_by_roundings(side: int) -> None:
    own = limits(joints=(JointLimits(low=REST[0] - 0.1, high=REST[0] + 0.1, speed=2.0),))
    here = REST[0] + side * 0.2
    slack = 1.5 * math.pi / 1000 / 2
    assert check_move_to_start(plan_of(1, here, here), MA2000, own) == []
    assert check_move_to_start(plan_of(1, here, here - side * slack), MA2000, own) == []
    further = check_move_to_start(plan_of(1, here, here + side * 0.5 * slack), MA2000, own)
    assert [violation.rule for violation in further] == ["range"]


@given(st.integers(1, 6), st.lists(st.floats(-3, 3), min_size=2, max_size=8))
def test_what_passes_is_within_every_limit(joint: int, offsets: list[float]) -> None:
    plan = plan_of(joint, *(REST[joint - 1] + offset for offset in offsets))
    own = LIMITS.joint(joint)
    assert own.low is not None
    assert own.high is not None
    assert own.speed is not None
    angles = plan.angles[:, joint - 1]
    slack = abs(MA2000.calibration(joint).rad_per_posture_unit) / 2 + 1e-6
    within = bool((angles >= own.low - slack).all() and (angles <= own.high + slack).all())
    slow = bool((np.abs(np.diff(angles)) / 0.02 <= own.speed + 1e-6).all())
    sent = bool(((plan.postures >= 0) & (plan.postures <= 999)).all())
    if check_plan(plan, MA2000, LIMITS) == []:
        assert within
        assert slow
        assert sent
    if not (within and slow and sent):
        assert check_plan(plan, MA2000, LIMITS)


# ---- Experiments that are compared before any is run are planned and checked like those that are run.


# ---- Joints that slide are checked, moved and shown in metres, never in degrees.


@pytest.fixture
def machine() -> Machine:
    return slide_and_turn()


def ramp(amplitude: dict[int, float], duration: float = 2.0, repeats: int = 1) -> ExperimentSpec:
    trajectory = Ramp(amplitude=amplitude, duration=duration)
    return ExperimentSpec(trajectory=trajectory, joints=tuple(amplitude), repeats=repeats)


def violations(machine: Machine, spec: ExperimentSpec) -> list[str]:
    return [str(one) for one in check_plan(plan(spec, machine, start_angles(spec, machine)), machine, machine.limits)]


def test_refusals_are_in_the_unit_of_the_joint(machine: Machine) -> None:
    found = violations(machine, ramp({1: 0.1, 2: 0.45}, 1.0))
    assert any("joint 1: 200.00 mm" in one and "allowed are 10.00 mm to 190.00 mm" in one for one in found)
    assert any("joint 1: 100.0 mm/s" in one and "up to 40.0 mm/s" in one for one in found)
    assert any("joint 2: 54.43°" in one for one in found)
    assert not any("°" in one for one in found if one.startswith("joint 1"))
    with pytest.raises(SpecError, match=r"joint 1: start of 300\.00 mm is outside its range of 0\.00 mm to 204\.75 mm"):
        plan_move(machine, (0.3, 0.5), (0.1, 0.5))
    with pytest.raises(SpecError, match=r"half a set point \(0\.025 mm\)"):
        plan(ramp({1: 1e-5}), machine, (0.1, 0.5))


@pytest.mark.parametrize("target", [(0.18, 0.5), (0.1, 0.85), (0.18, 0.85), (0.02, 0.15)], ids=str)
def test_the_slow_move_to_a_start_keeps_each_joints_own_speed(machine: Machine, target: tuple[float, float]) -> None:
    move = plan_move(machine, (0.1, 0.5), target)
    assert check_move_to_start(move, machine, machine.limits) == []
    speeds = np.abs(np.diff(move.angles, axis=0)).max(axis=0) / move.period
    assert (speeds <= np.array([0.04, 0.2]) + 1e-6).all()
    assert (speeds / np.array([0.04, 0.2])).max() == pytest.approx(1.0, abs=0.02)


def test_the_way_back_between_repeats_keeps_them_too(machine: Machine) -> None:
    assert violations(machine, ramp({1: 0.05, 2: 0.3}, repeats=2)) == []
