"""Lead by the nose: limp while led, recorded, and stiff again without a jerk."""

import math
from collections.abc import Mapping

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.runner.arm_control import StoppedError
from daq.teaching.arm import TeachingError
from daq.teaching.lead import lead_by_nose
from daq.teaching.recording import RecordedPath
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


def test_the_path_is_where_the_hand_led_the_arm() -> None:
    path = led(StandIn(waving))
    assert path.joints == (1, 3)
    ticks = np.rint(np.array(path.times) / 0.02).astype(int) + 2  # tick 1 was for the first set points
    expected = [list(waving(int(tick)).values()) for tick in ticks]
    assert np.array(path.positions) == pytest.approx(np.array(expected), abs=0.0006)


def test_gains_are_zero_while_led_and_what_they_were_afterwards() -> None:
    arm = StandIn(waving)
    arm.gain[3] = (5, 1, 2)
    led(arm)
    limp = [entry for entry in arm.log if entry.startswith("gains")]
    assert limp == ["gains 1 0", "gains 3 0", "gains 1 2", "gains 3 5"]
    assert arm.gain[3] == (5, 1, 2)
    assert arm.gain[2] == (2, 0, 0)


def test_nothing_pulls_when_the_gains_come_back() -> None:
    arm = StandIn(waving)
    led(arm)
    before = arm.position.copy()
    for joint, own in enumerate(CALIBRATIONS, start=1):
        error = (own.posture_to_rad(arm.postures[joint - 1]) - before[joint - 1]) / own.rad_per_count
        assert abs(error) <= 8
    for _ in range(10):
        arm.next_sample()
    assert arm.position == pytest.approx(before, abs=0.004)


def test_gains_wait_until_the_hand_keeps_still() -> None:
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


def test_an_arm_that_never_comes_to_rest_stays_limp_and_says_so() -> None:
    arm = StandIn(lambda tick: {1: REST[0] + 0.2 * math.sin(tick)})
    with pytest.raises(TeachingError, match=r"did not come to rest within 10 s\. JOINTS 1 ARE LIMP"):
        led(arm, joints=(1,), periods=100)
    assert arm.gain[1] == (0, 0, 0)


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


def test_gains_do_not_come_back_on_samples_that_are_too_old() -> None:
    arm = StandIn(waving)
    arm.lateness = 0.1
    with pytest.raises(TeachingError, match="did not come to rest"):
        led(arm)
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


def test_a_lost_link_says_that_the_joints_may_be_limp() -> None:
    arm = StandIn(waving)
    arm.broken_from = 50
    with pytest.raises(TeachingError, match=r"the link is lost\. JOINTS 1, 3 ARE LIMP"):
        led(arm)


@pytest.mark.parametrize("joints", [(), (7,)])
def test_joints_that_are_not_sampled_cannot_be_led(joints: tuple[int, ...]) -> None:
    arm = StandIn()
    with pytest.raises(SpecError, match="those sampled are"):
        led(arm, joints=joints)
    assert arm.log == []


def test_one_sample_is_no_path_and_leaves_the_gains_as_they_were() -> None:
    arm = StandIn(waving)
    with pytest.raises(TeachingError, match="1 samples are no path"):
        led(arm, periods=2)
    assert arm.gain[1] == (2, 0, 0)
