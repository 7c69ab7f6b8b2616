"""What the guards say in each control period."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.limits import Limits
from daq.contracts.sample import SampleRow
from daq.safety import RestGuards, RunningGuards, Verdict
from daq.safety.findings import Finding, Watched
from daq.safety.guards import FollowingError
from daq.trajectories.planner import plan, start_angles
from firmware_protocol.commands import StatusFlag
from firmware_protocol.units import JointCalibration
from tests.daq.safety.arms import COUNT, LIMITS, MA2000, REST, limits, row

REST_POSTURES = {1: 500, 2: 333, 3: 500}


def running(own: Limits = LIMITS, moving: tuple[int, ...] = (1, 2, 3)) -> RunningGuards:
    return RunningGuards(MA2000, own, (1, 2, 3), moving)


def test_an_arm_that_follows_is_left_alone_and_set_points_go_on_when_it_is_back() -> None:
    guards = running()
    for tick in range(5):
        verdict = guards.check(row(tick, error=(20, 50, 15)), REST_POSTURES)
        assert verdict == type(verdict)()
    guards = running()
    assert guards.check(row(0, error=(130, 0, 0)), {}).hold
    assert guards.check(row(1, error=(128, 0, 0)), {}).findings == ()
    verdict = guards.check(row(2, error=(127, 0, 0)), {})
    assert not verdict.hold
    assert [(f.kind, f.message) for f in verdict.findings] == [("resume", "set points continue after 0.04 s")]


def test_a_pause_is_counted_from_its_first_period_and_one_that_lasts_is_a_fault() -> None:
    guards = running()
    away = "is 8.6° (130 counts) from its set point; set points wait while it is more than 8.4° (127) away"
    assert guards.check(row(100, error=(0, -130, 0)), {}).findings == (Finding("pause", f"joint 2 {away}", 2),)
    assert guards.check(row(103), {}).findings[-1].message == "set points continue after 0.06 s"
    guards = running()
    verdicts = [guards.check(row(tick, error=(0, 0, 130)), {}) for tick in range(27)]
    assert [bool(verdict.trips) for verdict in verdicts] == [False] * 26 + [True]
    assert all(verdict.hold for verdict in verdicts)
    (trip,) = verdicts[-1].trips
    assert trip.startswith(
        "something blocks joint 3, or its drive or sensor has failed: it is 8.6° from its set point, "
    )
    assert trip.endswith(" from its set point, over 8.4° for 0.52 s (allowed: 0.5 s)")
    guards = running()
    for tick in range(100):
        assert not guards.check(row(tick, error=(130 if tick % 20 else 0, 0, 0)), {}).trips


def test_set_points_keep_the_limit_s_distance_whatever_other_joints_do() -> None:
    # A joint of 4 rad has 1024 counts a rad, so that nothing is rounded here
    watched = Watched(MA2000, (1,), (JointCalibration(1, 4.0, 0.0),), 0.02, Limits(following_error_counts=127))
    for counts, held in ((127, False), (128, True), (-127, False), (-128, True)):
        at = 2.0 - counts / 1024
        sample = SampleRow(0, 0.0, 0.0, (at,), (at,), (0.0,), (0.0,), (0,), 0)
        verdict = FollowingError(watched).check(sample, {1: 500})
        assert verdict.hold is held
        assert [f.joint for f in verdict.findings] == [1] * held
    sliding = MA2000.joint(1).model_copy(update={"kind": "prismatic"})
    watched = replace(watched, machine=MA2000.model_copy(update={"joints": (sliding, *MA2000.joints[1:])}))
    (finding,) = FollowingError(watched).check(sample, {1: 500}).findings
    assert finding.message.startswith("joint 1 is 125.0 mm (128 counts) from its next set point"), "its m are mm"
    verdict = running().check(row(0), {2: REST_POSTURES[2] + 40, 3: 500})
    (finding,) = verdict.findings
    assert verdict.hold
    assert (finding.kind, finding.joint) == ("pause", 2)
    assert finding.message.startswith("joint 2 is 10.7° (16")
    (missed,) = running().check(row(4), {}, expected={3: 510}).findings
    assert missed.message == "joint 3: tick 4 took posture 500, sent was 510"


def test_a_run_of_missed_set_points_begins_anew_and_is_shorter_on_a_slow_line() -> None:
    guards = running()
    missed = [True] * 10 + [False] + [True] * 11
    trips = [
        guards.check(row(tick, status=StatusFlag.SET_POINT_MISSED if one else 0), {}).trips
        for tick, one in enumerate(missed)
    ]
    assert [tick for tick, trip in enumerate(trips) if trip] == [21]
    assert trips[21] == ("11 set points missed in a row, allowed are 10",)
    assert guards.missed_set_points.missed == 21
    guards = RunningGuards(MA2000, LIMITS, (1, 2, 3), (1, 2, 3), every=5)
    missed = StatusFlag.SET_POINT_MISSED.value
    trips = [bool(guards.check(row(tick, status=missed), {}).trips) for tick in range(0, 20, 5)]
    assert trips == [False, False, True, True]


def test_limits_that_are_not_set_pause_and_end_nothing() -> None:
    guards = running(limits(following_error_time=None))
    assert not any(guards.check(row(tick, error=(130, 0, 0)), {}).trips for tick in range(1000))
    assert not running(limits(following_error_counts=None)).check(row(0, error=(2000, 0, 0)), REST_POSTURES).hold


@given(st.integers(0, 999), st.integers(-400, 400))
def test_no_set_point_is_sent_that_is_further_from_the_arm_than_the_limit(posture: int, position: int) -> None:
    """Whatever happens to host or cable then, the arm stops within the limit of where it is."""
    verdict = running().check(row(0, error=(0, 0, 0), position=(position, 0, 0)), {1: posture})
    away = (posture - 500) * 4096 / 1000 - position
    assert verdict.hold is (abs(away) > 127)


def test_a_stuck_joint_ends_in_a_fault_though_its_error_never_passes_the_limit() -> None:
    guards = running()
    trips: list[str] = []
    posture, tick = 500, 0
    while not trips and tick < 200:
        verdict = guards.check(row(tick, error=((posture - 500) * 4.096, 0, 0), position=(0, 0, 0)), {1: posture + 2})
        posture += 0 if verdict.hold else 2
        trips += verdict.trips
        tick += 1
    assert posture == 530
    assert "joint 1, or its drive or sensor has failed: it is 8.6° from its next set point" in trips[0]


def lagging_arm(rate: float) -> tuple[int, bool]:
    """Plays the default ramp to an arm that closes `rate` of its error each period; (periods, ever held)."""
    spec = ExperimentSpec()
    ramp = plan(spec, MA2000, start_angles(spec, MA2000))
    guards, held = running(), False
    arm = ramp.angles[0, :3].copy()
    index = periods = 0
    while index < len(ramp) - 1:
        error = ramp.angles[index, :3] - arm
        sample = row(periods, error=tuple(error / COUNT), position=tuple((arm - REST[:3]) / COUNT))
        planned = {joint: int(ramp.postures[index + 1, joint - 1]) for joint in (1, 2, 3)}
        verdict = guards.check(sample, planned)
        assert not verdict.trips
        held |= verdict.hold
        index += 0 if verdict.hold else 1
        arm += rate * error
        periods += 1
    return periods, held


def test_the_default_ramp_passes_and_a_slow_arm_makes_the_plan_wait() -> None:
    periods, held = lagging_arm(rate=0.2)  # settles at (1/0.2) · 10 counts behind
    assert not held
    assert periods == 158
    periods, held = lagging_arm(rate=0.05)
    assert held
    assert periods > 158


@pytest.mark.parametrize(
    ("ticks", "trips"),
    [
        ((5, 6, 7), ()),
        ((5, 5), ("stale sample: tick 5 came twice",)),
        ((5, 3), ("the board has restarted: tick 3 after 5",)),
        ((5, 9), ()),
        ((5, 15), ()),
        ((5, 16), ("10 control periods between ticks 5 and 16 have no sample; allowed are gaps up to 0.2 s",)),
    ],
)
def test_ticks_must_go_on(ticks: tuple[int, ...], trips: tuple[str, ...]) -> None:
    guards = running()
    verdicts = [guards.check(row(tick), {}) for tick in ticks]
    assert sum((verdict.trips for verdict in verdicts), ()) == trips


def test_missing_control_periods_are_reported() -> None:
    guards = running()
    guards.check(row(5), {})
    (finding,) = guards.check(row(9), {}).findings
    assert (finding.kind, finding.message) == ("missing", "3 control periods between ticks 5 and 9 have no sample")
    guards = RunningGuards(MA2000, LIMITS, (1, 2, 3), (1, 2, 3), every=3)
    assert guards.check(row(10), {}) == guards.check(row(13), {}) == Verdict()
    (finding,) = guards.check(row(19), {}).findings
    assert finding.message == "ticks 13 and 19 are 6 control periods apart, 3 were requested"
    guards = running()
    guards.check(row(5), {})
    guards.check(row(15), {})
    assert guards.check(row(16), {}) == Verdict()
    (trip,) = guards.check(row(16), {}).trips
    assert trip == "stale sample: tick 16 came twice"


def test_a_board_that_restarted_or_was_frozen_stops_the_run() -> None:
    assert running().check(row(7, status=StatusFlag.RESTARTED), {}).trips == ("the board has restarted: tick 7",)
    verdict = running().check(row(7, status=StatusFlag.FROZEN), {})
    assert verdict.stop == "on the board, at tick 7"
    assert not verdict.trips


def test_joints_at_rest_must_stay_where_they_are_unless_they_are_led() -> None:
    guards = running(moving=(1,))
    assert not guards.check(row(0, error=(100, 40, 0)), {}).trips
    assert guards.check(row(1, error=(100, -41, 0)), {}).trips == (
        "joint 2: unexpected motion, 41 ADC counts from its set point, allowed are ±40",
    )
    guards = RestGuards(MA2000, LIMITS, (1, 2, 3))
    assert not guards.check(row(0, position=(300, 0, 0))).trips
    assert not guards.check(row(1, position=(340, 0, 0))).trips
    assert guards.check(row(2, position=(341, 0, 0))).trips == (
        "joint 1: unexpected motion, 41 ADC counts from where it was, allowed are ±40",
    )
    guards = RestGuards(MA2000, LIMITS, (1, 2, 3), led=(1,))
    guards.check(row(0))
    assert not guards.check(row(1, position=(500, 0, 0))).trips
    # The tests above count from the rest posture, which lies on a posture for joints 1 and 3
    assert MA2000.calibration(1).posture_to_rad(500) == pytest.approx(math.pi)
    assert np.isfinite(REST).all()


def test_what_several_guards_find_is_all_told_once() -> None:
    verdict = running(moving=(1, 2)).check(row(0, error=(130, 0, 50), status=5), {}, expected={1: 600})
    assert verdict.hold
    assert verdict.stop == "on the board, at tick 0"
    assert [finding.kind for finding in verdict.findings] == ["pause", "missed_set_point"]
    assert [trip.partition(",")[0] for trip in verdict.trips] == ["joint 3: unexpected motion"]
    one = Verdict(hold=True, stop="first", trips=("a",), findings=(Finding("note", "x"),))
    other = Verdict(stop="second", trips=("b",), findings=(Finding("note", "y"),))
    assert one | other == Verdict(True, "first", ("a", "b"), (Finding("note", "x"), Finding("note", "y")))
    assert other | one == Verdict(True, "second", ("b", "a"), (Finding("note", "y"), Finding("note", "x")))
    assert (one | Verdict(), Verdict() | one) == (one, one)


def test_a_missed_set_point_is_told_with_what_was_sent_and_what_was_taken() -> None:
    start = {1: 500}
    guards = running()
    assert not guards.check(row(0), start, expected=start).findings
    (finding,) = guards.check(row(1), start, expected={1: 502}).findings
    assert finding.message == "joint 1: tick 1 took posture 500, sent was 502"
    (finding,) = running().check(row(9, status=StatusFlag.SET_POINT_MISSED), {}).findings
    assert finding.message == "tick 9: the controller could not read its set points: the host had the memory"


@given(st.lists(st.tuples(st.integers(-300, 300), st.integers(400, 600)), max_size=60))
def test_guards_never_raise_and_never_release_what_they_should_hold(seen: list[tuple[int, int]]) -> None:
    guards = running()
    for tick, (error, posture) in enumerate(seen):
        verdict = guards.check(row(tick, error=(error, 0, 0)), {1: posture})
        ahead = (posture - 500) * 4.096 + error
        assert verdict.hold is (abs(error) > 127 or abs(ahead) > 127 + 1e-9)


@pytest.mark.parametrize(("every", "gap", "trips"), [(1, 10, False), (1, 11, True), (5, 15, False), (5, 16, True)])
def test_silence_is_ten_periods_or_three_samples_on_a_slow_line(every: int, gap: int, trips: bool) -> None:
    guards = RunningGuards(MA2000, LIMITS, (1, 2, 3), (1, 2, 3), every)
    guards.check(row(1), {})
    assert bool(guards.check(row(1 + gap), {}).trips) is trips
