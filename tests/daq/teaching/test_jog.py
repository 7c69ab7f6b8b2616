"""Drive-through: motion while a key is held, within every limit."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.contracts.errors import SpecError
from daq.contracts.sample import SampleRow
from daq.runner.arm_control import StoppedError
from daq.teaching.arm import TeachingError
from daq.teaching.jog import (
    DEAD_MAN,
    JOG_SPEED,
    SLIDE_JOG_SPEED,
    JogCommand,
    Jogger,
    jog,
    require_step_speed,
    top_speed,
)
from daq_cli.robot.pendant import Pendant
from tests.daq.sliding_axis import slide_and_turn
from tests.daq.teaching.stand_in import CALIBRATIONS, MA2000, PERIOD, REST, StandIn

LIMITS = MA2000.limits


def driven(arm: StandIn, velocities: dict[int, float], held_until: int, periods: int) -> list[str]:
    """Jogs with a key held down for the first `held_until` periods; what the operator was told."""
    told: list[str] = []

    def commands(_row: SampleRow) -> JogCommand:
        return JogCommand(velocities, min(arm.tick, held_until) * PERIOD)

    jog(arm, MA2000, LIMITS, commands, arm.run_for(periods), told.append)
    return told


@pytest.mark.parametrize("every", [2, 8])
def test_a_joint_has_its_speed_however_far_samples_are_apart(every: int) -> None:
    arm = StandIn(every=every)
    driven(arm, {1: 0.2, 3: -0.1}, held_until=160, periods=160)
    time = (160 - every) * PERIOD  # the last step has just been sent
    assert arm.position[0] - REST[0] == pytest.approx(0.2 * time, abs=0.02)
    assert arm.position[2] - REST[2] == pytest.approx(-0.1 * time, abs=0.02)


@pytest.mark.parametrize("every", [2, 8])
def test_a_jog_with_samples_far_apart_goes_to_the_limit_and_no_further(every: int) -> None:
    arm = StandIn(every=every)
    told = driven(arm, {4: JOG_SPEED}, held_until=560, periods=560)
    assert arm.position[3] == pytest.approx(1.56, abs=0.01)
    assert len(told) == 1


def test_it_stops_with_its_key_and_by_a_stop_from_elsewhere() -> None:
    arm = StandIn()
    driven(arm, {1: 0.2}, held_until=50, periods=200)
    assert arm.position[0] - REST[0] <= 0.2 * (50 * PERIOD + DEAD_MAN) + 0.01
    assert arm.position[0] - REST[0] >= 0.2 * 50 * PERIOD
    arm = StandIn()
    arm.frozen = True
    with pytest.raises(StoppedError, match="stopped: on the board, at tick 1"):
        driven(arm, {1: 0.1}, held_until=10, periods=10)
    assert arm.log == ["stop"]
    with pytest.raises(SpecError, match="all of 1 to 6 are needed"):
        Jogger(MA2000, LIMITS, (1, 2, 3))


def test_a_speed_is_kept_across_gaps_and_never_runs_ahead_of_the_arm() -> None:
    # At 0.02 rad/s a period is a twelfth of a posture unit: what is not yet a unit is not lost
    arm = StandIn()
    driven(arm, {1: 0.02}, held_until=500, periods=500)
    assert arm.position[0] - REST[0] == pytest.approx(0.02 * 500 * PERIOD, abs=0.01)
    # After a gap a joint goes on where it was
    arm = StandIn(every=2)
    jogger = Jogger(MA2000, LIMITS, arm.joints, every=2)
    before = jogger.step(arm.next_sample(), JogCommand({1: 0.2}, arm.tick * PERIOD))
    jogger.accept(before)
    arm.tick += 50
    after = jogger.step(arm.next_sample(), JogCommand({1: 0.2}, arm.tick * PERIOD))
    assert after.angles[1] - before.angles[1] == pytest.approx(0.2 * 2 * PERIOD)
    # Set points never run further ahead than the following error limit
    arm = StandIn()
    arm.push = {1: 0.0}
    arm.gain[1] = (0, 0, 0)  # joint 1 does not follow
    with pytest.raises(TeachingError, match=r"blocks joint 1, .* from its next set point"):
        driven(arm, {1: JOG_SPEED}, held_until=300, periods=300)
    ahead = CALIBRATIONS[0].posture_to_rad(arm.postures[0]) - arm.position[0]
    assert ahead / CALIBRATIONS[0].rad_per_count <= 127
    assert arm.log[-1] == "stop"


def test_it_goes_to_the_limit_or_the_floor_and_no_further_and_says_so_once() -> None:
    arm = StandIn()
    told = driven(arm, {4: JOG_SPEED}, held_until=500, periods=500)
    assert arm.position[3] == pytest.approx(1.56, abs=0.01)
    assert len(told) == 1
    assert told[0].startswith("joint 4: 89.")
    assert "allowed are -89.38° to 89.38°" in told[0]
    # Limits give way to rounding by half a posture unit; not by half a unit again and again
    arm = StandIn()
    arm.place(4, CALIBRATIONS[3].posture_to_rad(990))
    driven(arm, {4: 0.02}, held_until=400, periods=400)
    assert arm.postures[3] == round((1.56 - CALIBRATIONS[3].angle_at_zero_rad) / CALIBRATIONS[3].rad_per_posture_unit)
    arm = StandIn()
    told = driven(arm, {2: -JOG_SPEED}, held_until=400, periods=400)
    assert "height of -30" in told[0]
    assert arm.position[1] == pytest.approx(-math.asin(0.30 / (0.285755 + 0.16841)), abs=0.02)


@pytest.mark.parametrize("upwards", [True, False], ids=["up", "down"])
@pytest.mark.parametrize("joint", StandIn.joints)
@given(speed=st.floats(0.05, JOG_SPEED), others=st.dictionaries(st.integers(1, 6), st.floats(-JOG_SPEED, JOG_SPEED)))
@settings(max_examples=5)
def test_no_key_drives_an_arm_beyond_limits(joint: int, upwards: bool, speed: float, others: dict[int, float]) -> None:
    """Two seconds from a tenth of a radian inside each joint's limit, towards it, while others move as they like."""
    own = LIMITS.joint(joint)
    assert own.low is not None
    assert own.high is not None
    arm = StandIn()
    arm.place(joint, own.high - 0.1 if upwards else own.low + 0.1)
    begun = arm.postures[joint - 1]
    jogger = Jogger(MA2000, LIMITS, StandIn.joints)
    arm.running = True
    velocities = others | {joint: speed if upwards else -speed}
    for _ in range(100):
        row = arm.next_sample()
        step = jogger.step(row, JogCommand(velocities, row.host_time))
        arm.set_points(step.postures)
        jogger.accept(step)
    assert others or arm.postures[joint - 1] != begun, "nothing but the floor holds it at once"
    for number, posture in enumerate(arm.postures, start=1):
        own = LIMITS.joint(number)
        angle = CALIBRATIONS[number - 1].posture_to_rad(posture)
        assert own.low is not None
        assert own.high is not None
        assert own.low - 0.005 <= angle <= own.high + 0.005


@pytest.mark.parametrize(
    ("velocities", "line"),
    [
        ({1: 0.36}, "joint 1: velocity of 0.36 rad/s: allowed are up to ±0.35 rad/s"),
        ({1: math.nan}, "joint 1: velocity of nan rad/s"),
        ({7: 0.1}, "joint 7: allowed are"),
    ],
)
def test_a_command_that_cannot_be_is_refused(velocities: dict[int, float], line: str) -> None:
    arm = StandIn()
    jogger = Jogger(MA2000, LIMITS, arm.joints)
    with pytest.raises(SpecError, match=line.replace(".", r"\.")):
        jogger.step(arm.next_sample(), JogCommand(velocities, PERIOD))


def test_keys_wait_while_samples_come_late_and_the_jog_ends_if_they_stay_so() -> None:
    arm = StandIn()
    sent_late = []

    def commands(row: SampleRow) -> JogCommand:
        sent_late.append(len(arm.log) if 20 < row.tick <= 40 else None)
        arm.lateness = 0.1 if 20 <= row.tick < 40 else 0.0
        return JogCommand({1: 0.2}, row.host_time)

    jog(arm, MA2000, LIMITS, commands, arm.run_for(60), print)
    counts = {count for count in sent_late[21:40] if count is not None}
    assert len(counts) == 1
    assert arm.log.count("set points") == 40
    arm = StandIn()
    arm.lateness = 0.1
    with pytest.raises(TeachingError, match="the line too slow"):
        driven(arm, {1: 0.1}, held_until=100, periods=100)
    assert "set points" not in arm.log


def test_a_joint_that_slides_has_a_speed_of_its_own() -> None:
    machine = slide_and_turn()
    free = machine.limits.model_copy(update={"joints": ()})
    assert [top_speed(machine, free, joint) for joint in (1, 2)] == [SLIDE_JOG_SPEED, JOG_SPEED]
    assert [top_speed(machine, machine.limits, joint) for joint in (1, 2)] == [0.04, 0.2]
    row = SampleRow(0, 0.0, 0.0, (0.1, 0.5), (0.1, 0.5), (0.0, 0.0), (0.0, 0.0), (0, 0))
    with pytest.raises(SpecError, match=r"joint 1: velocity of 0\.35 m/s: allowed are up to ±0\.07 m/s"):
        Jogger(machine, free, (1, 2)).step(row, JogCommand({1: JOG_SPEED}, 0.0))
    machine = slide_and_turn()
    require_step_speed(machine, (2,), 0.25)
    require_step_speed(machine, (1, 2), SLIDE_JOG_SPEED)
    with pytest.raises(SpecError, match=r"speed = 0\.25 m/s: joint 1 is prismatic: allowed are up to 0\.07 m/s"):
        require_step_speed(machine, (2, 1), 0.25)
    machine = slide_and_turn()
    pendant = Pendant(machine, JOG_SPEED / 2)
    pendant.command("1", 0.0)
    assert (pendant.speed, pendant.speed_text) == (pytest.approx(SLIDE_JOG_SPEED / 2), "35.0 mm/s")
    pendant.command("2", 0.0)
    assert pendant.speed_text == "10.0 °/s"
