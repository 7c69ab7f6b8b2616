"""Lead by the nose: limp while led, recorded, stiff again without a jerk; and what was recorded, played back."""

import math
from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from daq.contracts.errors import SpecError
from daq.runner.arm_control import StoppedError
from daq.safety import check_plan
from daq.teaching.arm import TeachingError
from daq.teaching.lead import lead_by_nose
from daq.teaching.recording import RecordedPath, playback
from daq.trajectories.planner import plan, start_angles
from tests.daq.teaching.stand_in import CALIBRATIONS, MA2000, REST, StandIn

LIMITS = MA2000.limits


def waving(tick: int) -> Mapping[int, float]:
    """A hand that waves joints 1 and 3 for 100 periods and then keeps still."""
    phase = min(tick, 100) / 100 * math.pi
    return {1: REST[0] + 0.3 * math.sin(phase), 3: REST[2] + 0.2 * (1 - math.cos(phase))}


def led(arm: StandIn, joints: tuple[int, ...] = (1, 3), periods: int = 120) -> RecordedPath:
    kept: list[RecordedPath] = []
    lead_by_nose(arm, MA2000, LIMITS, joints, arm.run_for(periods), kept.append)
    (path,) = kept
    return path


def test_the_path_is_where_the_hand_led_the_arm_with_gains_of_zero() -> None:
    path = led(StandIn(waving))
    assert path.joints == (1, 3)
    ticks = np.rint(np.array(path.times) / 0.02).astype(int) + 2  # tick 1 was for the first set points
    expected = [list(waving(int(tick)).values()) for tick in ticks]
    assert np.array(path.positions) == pytest.approx(np.array(expected), abs=0.0006)
    arm = StandIn(waving)
    arm.gain[3] = (5, 1, 2)
    led(arm)
    limp = [entry for entry in arm.log if entry.startswith("gains")]
    assert limp == ["gains 1 0", "gains 3 0", "gains 1 2", "gains 3 5"]
    assert arm.gain[3] == (5, 1, 2)
    assert arm.gain[2] == (2, 0, 0)
    arm = StandIn(waving)
    with pytest.raises(TeachingError, match="1 samples are no path"):
        led(arm, periods=2)
    assert arm.gain[1] == (2, 0, 0)


def test_nothing_pulls_when_the_gains_come_back_once_the_hand_keeps_still() -> None:
    arm = StandIn(waving)
    led(arm)
    before = arm.position.copy()
    for joint, own in enumerate(CALIBRATIONS, start=1):
        error = (own.posture_to_rad(arm.postures[joint - 1]) - before[joint - 1]) / own.rad_per_count
        assert abs(error) <= 8
    for _ in range(10):
        arm.next_sample()
    assert arm.position == pytest.approx(before, abs=0.004)

    def shaking(tick: int) -> Mapping[int, float]:
        return {1: REST[0] + 0.2 * math.sin(tick) * (tick < 300)}

    arm = StandIn(shaking)
    led(arm, joints=(1,), periods=100)
    assert arm.tick > 300
    assert arm.gain[1] == (2, 0, 0)


@pytest.mark.parametrize("speed", [0.1, 0.35], ids=["6 degrees a second", "20 degrees a second"])
def test_gains_wait_until_an_arm_that_sinks_evenly_has_stopped(speed: float) -> None:
    """Set points that follow it leave no error to be seen: it is the position that tells."""
    arm = StandIn(lambda tick: {2: REST[1] - speed * 0.02 * min(tick, 150)})
    led(arm, joints=(2,), periods=60)
    assert arm.tick > 150
    assert arm.gain[2] == (2, 0, 0)


def test_gains_do_not_come_back_without_rest_or_fresh_samples() -> None:
    arm = StandIn(lambda tick: {1: REST[0] + 0.2 * math.sin(tick)})
    with pytest.raises(TeachingError, match=r"did not come to rest within 10 s\. JOINTS 1 ARE LIMP"):
        led(arm, joints=(1,), periods=100)
    assert arm.gain[1] == (0, 0, 0)
    arm = StandIn(waving)
    arm.lateness = 0.1
    with pytest.raises(TeachingError, match="did not come to rest"):
        led(arm)
    assert arm.gain[1] == (0, 0, 0)
    arm = StandIn(waving)
    arm.broken_from = 50
    with pytest.raises(TeachingError, match=r"the link is lost\. JOINTS 1, 3 ARE LIMP"):
        led(arm)


def test_a_stop_from_elsewhere_leaves_the_joints_limp_says_so_and_keeps_the_path() -> None:
    """The board holds its set points where the stop was: stiff again, the arm would be pulled back there."""
    arm = StandIn(waving)
    arm.gain[3] = (5, 1, 2)
    original = arm.hand
    arm.hand = lambda tick: setattr(arm, "frozen", tick >= 50) or original(tick)
    kept: list[RecordedPath] = []
    with pytest.raises(StoppedError, match=r"at tick 50\. JOINTS 1, 3 ARE LIMP .* `daq gains set 1=2/0/0,3=5/1/2`"):
        lead_by_nose(arm, MA2000, LIMITS, (1, 3), arm.run_for(120), kept.append)
    assert arm.gain[1] == (0, 0, 0)
    assert [len(path.times) for path in kept] == [48]


def test_a_fault_of_the_program_freezes_before_the_path_is_kept() -> None:
    arm = StandIn(waving)

    def ended() -> bool:
        if arm.tick >= 50:
            raise ZeroDivisionError
        return False

    def keep(_path: RecordedPath) -> None:
        arm.log.append("kept")

    with pytest.raises(ZeroDivisionError):
        lead_by_nose(arm, MA2000, LIMITS, (1, 3), ended, keep)
    assert arm.log[-2:] == ["stop", "kept"]
    assert arm.gain[1] == (0, 0, 0)


def test_a_joint_that_is_not_led_must_not_move() -> None:
    arm = StandIn(waving)
    original = arm.hand

    def pushed(tick: int) -> Mapping[int, float]:
        arm.push = {2: 0.05 if tick > 50 else 0.0}
        return original(tick)

    arm.hand = pushed
    with pytest.raises(TeachingError, match="joint 2: unexpected motion"):
        led(arm)
    assert arm.log[-1] == "stop"


@pytest.mark.parametrize("joints", [(), (7,)])
def test_joints_that_are_not_sampled_cannot_be_led(joints: tuple[int, ...]) -> None:
    arm = StandIn()
    with pytest.raises(SpecError, match="those sampled are"):
        led(arm, joints=joints)
    assert arm.log == []


# ---- Recorded paths: thinning and playing back


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


def test_playback_takes_any_length_within_the_limits_and_thinning_leaves_rests_out() -> None:
    spec = playback(recorded(*(math.pi + 0.1 * math.sin(k / 200) for k in range(10_000))))
    made = plan(spec, MA2000, start_angles(spec, MA2000))
    assert made.duration > 199
    assert check_plan(made, MA2000, MA2000.limits) == []
    spec = playback(WAVE, 10)
    rules = {v.rule for v in check_plan(plan(spec, MA2000, start_angles(spec, MA2000)), MA2000, MA2000.limits)}
    assert rules == {"speed"}
    assert start_angles(playback(WAVE), MA2000) == (WAVE.positions[0][0], *REST[1:])
    assert len(recorded(*([1.0] * 1000)).thinned(0.001).times) == 2
    assert len(recorded(*np.linspace(0, 1, 1000)).thinned(0.001).times) == 2


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
