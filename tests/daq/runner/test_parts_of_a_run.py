"""The parts of a run, without a controller: who commands the arm, samples that are too old, rows, consent, the line."""

import math
from collections.abc import Callable
from typing import Any, cast

import numpy as np
import pytest

from daq.client import Client
from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from daq.contracts.service.robot import LinkStatus, RobotIdentity
from daq.driver import BoardSnapshot, Controller, StopConfirmation
from daq.owner.seen import rates_line, with_rates
from daq.runner.arm_control import ArmControl, StoppedError, stop_line
from daq.runner.lag import OLDEST_TO_ACT_ON, Lag
from daq.runner.preparation import Consent
from daq.runner.rows import RowMaker
from daq.safety import Event, State
from firmware_protocol.commands import StatusFlag
from firmware_protocol.joints import JointReading
from tests.turned_arms import turned


class Written:
    """What went to the line, in order."""

    def __init__(self) -> None:
        self.requests: list[str] = []
        self.during_release: Callable[[], Any] = lambda: None
        self.released: int | None = None
        self.answer = StopConfirmation(sent=True, acknowledged=True, tick=7)

    def stop(self) -> StopConfirmation:
        self.requests.append("stop")
        return self.answer

    def release(self, stop: int | None = None) -> None:
        self.requests.append("release")
        self.released = stop
        self.during_release()


def make() -> tuple[ArmControl, Written]:
    written = Written()
    return ArmControl(cast(Controller, written)), written


def test_a_stop_while_the_release_is_on_its_way_is_not_undone_by_it() -> None:
    control, written = make()
    written.during_release = lambda: control.stop("now")
    control.stop("before")
    written.requests.clear()
    with pytest.raises(StoppedError, match="now"):
        control.handle(Event.RESET)
    assert written.requests == ["release", "stop", "stop"]


@pytest.mark.parametrize("step", [Event.ARM, Event.START, Event.FINISHED, Event.DISARM])
def test_after_a_stop_no_step_of_a_run_is_taken(step: Event) -> None:
    control, written = make()
    for event in (Event.ARM, Event.START):
        control.handle(event)
    control.stop("now")
    written.requests.clear()
    with pytest.raises(StoppedError, match="now"):
        control.handle(step)
    assert written.requests == []
    assert not control.may_send


def test_only_a_reset_ends_a_halt_the_one_that_it_names() -> None:
    # Only a reset ends a halt
    control, _ = make()
    control.stop("now")
    control.handle(Event.RESET)
    assert control.halted is None
    control.handle(Event.ARM)
    assert control.arm.state is State.ARMED
    # A reset ends the stop that it names
    control, written = make()
    control.stop("now")
    assert control.handle(Event.RESET, stop=7) is None
    assert written.released == 7
    # After a reset an error freezes anew
    control, written = make()
    control.stop("now")
    control.handle(Event.RESET)
    written.requests.clear()
    with pytest.raises(RuntimeError), control.frozen_on_error():
        raise RuntimeError("a bug")
    assert written.requests == ["stop"]
    assert (control.halted, control.arm.cause) == ("RuntimeError: a bug", "RuntimeError: a bug")


def test_set_points_may_be_sent_only_while_a_run_goes_on() -> None:
    control, written = make()
    assert (control.arm.state, control.halted, written.requests) == (State.IDLE, None, [])
    control, _ = make()
    seen = [control.may_send]
    for event in (Event.ARM, Event.START, Event.FINISHED):
        control.handle(event)
        seen.append(control.may_send)
    assert seen == [False, False, True, False]


def test_the_first_cause_is_kept_and_named() -> None:
    control, _ = make()
    control.stop("first")
    control.stop("second")
    assert control.halted == "first"
    control, _ = make()
    with pytest.raises(StoppedError), control.frozen_on_error():
        raise StoppedError("by anna")
    assert control.halted == "by anna"
    control, _ = make()
    control.handle(Event.TRIP, "joint 2 strayed")
    with pytest.raises(StoppedError, match=r"^the arm has been stopped: joint 2 strayed$") as caught:
        control.handle(Event.ARM)
    assert (caught.value.cause, caught.value.exit_code) == ("joint 2 strayed", 6)


def test_an_error_freezes_first_and_until_it_is_confirmed() -> None:
    # An error freezes before anything else and once is enough
    control, written = make()

    def fail() -> None:
        with control.frozen_on_error(), control.frozen_on_error():
            raise RuntimeError("a bug")

    with pytest.raises(RuntimeError):
        fail()
    assert written.requests == ["stop"]
    control, written = make()
    written.answer = StopConfirmation(sent=True, acknowledged=False, problem="silence")
    with pytest.raises(RuntimeError):
        fail()
    assert written.requests == ["stop", "stop"]
    assert "NOT CONFIRMED (silence)" in control.unconfirmed
    control.handle(Event.RESET)
    assert control.unconfirmed == ""
    # What became of a freeze is the answer to what asked for it
    control, written = make()
    assert control.handle(Event.ARM) is None
    assert control.handle(Event.TRIP) is written.answer
    assert (control.halted, control.arm.cause) == ("trip", "guard tripped")
    assert control.stop("now") is written.answer
    assert control.halted == "trip"


@pytest.mark.parametrize(
    ("confirmation", "words"),
    [
        (StopConfirmation(sent=True, acknowledged=True, tick=7), "confirmed: set points are frozen since tick 7"),
        (StopConfirmation(sent=True, acknowledged=False, problem="silence"), "sent but NOT CONFIRMED (silence)"),
        (StopConfirmation(sent=False, acknowledged=False, problem="no port"), "could NOT BE DELIVERED (no port)"),
    ],
    ids=["confirmed", "sent", "not sent"],
)
def test_what_is_said_of_a_stop_is_what_is_known(confirmation: StopConfirmation, words: str) -> None:
    assert words in stop_line(confirmation)
    assert ("emergency stop" in stop_line(confirmation)) == (not confirmation.acknowledged)


# ---- On samples that are too old nothing is sent, and not for ever

PERIOD = 0.02


def test_an_old_sample_holds_the_set_points_until_samples_are_fresh() -> None:
    assert OLDEST_TO_ACT_ON == 3 * PERIOD
    verdict = Lag(PERIOD).check(1, OLDEST_TO_ACT_ON)
    assert (verdict.hold, verdict.trips, verdict.findings) == (False, (), ())
    lag = Lag(PERIOD)
    first, second = lag.check(1, 0.08), lag.check(2, 0.07)
    assert (first.hold, second.hold) == (True, True)
    assert [finding.kind for finding in (*first.findings, *second.findings)] == ["pause"]
    assert "80 ms late" in first.findings[0].message
    lag = Lag(PERIOD)
    lag.check(1, 0.08)
    verdict = lag.check(4, 0.0)
    assert not verdict.hold
    assert [finding.kind for finding in verdict.findings] == ["resume"]
    assert "0.06 s" in verdict.findings[0].message


def test_samples_that_stay_old_end_the_run_after_a_second_or_ten_samples() -> None:
    lag = Lag(PERIOD)
    last = 1 + 50  # one second
    trips = [lag.check(tick, 0.1).trips for tick in range(1, last + 2)]
    assert trips[:-1] == [()] * last
    assert "computer is too busy, or the line too slow; end other programs" in trips[-1][0]
    lag = Lag(PERIOD, every=5)
    assert not lag.check(1, 0.2).hold
    assert lag.check(6, 0.21).hold
    lag = Lag(PERIOD, every=8)
    trips = [bool(lag.check(tick, 1.0).trips) for tick in range(0, 96, 8)]
    assert trips == [False] * 11 + [True]


# ---- Counts of the board become angles and volts by the machine file's numbers

MACHINE = load_machine("ma2000")
FULL_TURN_OF_JOINT_1 = math.radians(270)


def snapshot(tick: int) -> BoardSnapshot:
    """Joint 1 in the middle of its range, 8 counts ahead of its set point."""
    readings = ((1, JointReading(500, 2056, -8, 127)), (2, JointReading(0, 0, 3, -127)), (3, JointReading(1, 2, 3, 4)))
    return BoardSnapshot(tick, 7.5, 7.4, readings, StatusFlag.FROZEN | StatusFlag.SET_POINT_MISSED, "sample")


def test_a_row_has_si_units_and_its_time_from_the_first() -> None:
    # A row has the chosen joints in si units
    row = RowMaker(MACHINE, (2, 1), 0.02).row(snapshot(100))
    one, scale = MACHINE.calibration(1), MACHINE.joint(1).dc_motor.scale
    middle = one.angle_at_zero_rad + one.direction * FULL_TURN_OF_JOINT_1 / 2
    count = one.direction * FULL_TURN_OF_JOINT_1 / 4096
    assert row.set_point[1] == pytest.approx(middle)
    assert row.position[1] == pytest.approx(middle + 8 * count)
    assert row.error[1] == pytest.approx(-8 * count)
    assert row.position[0] == pytest.approx(MACHINE.calibration(2).angle_at_zero_rad)
    volts = scale.full_scale_v * scale.amplifier_gain
    assert row.drive == pytest.approx((-volts, volts))
    assert row.power_raw == (-127, 127)
    assert (row.status, row.host_time, row.tick) == (5, 7.5, 100)
    # A positive power turns a joint to where its counts grow
    for sensor, gear, sign in ((False, False, 1), (True, False, -1), (False, True, -1), (True, True, 1)):
        machine = turned(MACHINE, (sensor,), (gear,))
        row = RowMaker(machine, (1,), 0.02).row(snapshot(100))
        assert row.power_raw == (127,)
        assert np.sign(row.drive[0]) == sign
        assert np.sign(row.error[0]) == (1 if sensor else -1)
    # Time is counted in periods from the first row
    rows = RowMaker(MACHINE, (1,), 0.02)
    assert [rows.row(snapshot(tick)).time for tick in (100, 101, 150)] == pytest.approx([0.0, 0.02, 1.0])
    # A joint without a motor file cannot be recorded
    with pytest.raises(SpecError):
        RowMaker(MACHINE, (7,), 0.02)


# ---- The operator's consent is True, and nothing that only counts as true


@pytest.mark.parametrize("word", [0, 1, "true", "yes", None, 1.0])
def test_what_is_like_it_is_refused_before_anything_is_asked(word: object) -> None:
    given = cast(Any, word)
    with pytest.raises(SpecError, match="moves_real_arm = "):
        Consent(given)
    with Client("http://127.0.0.1:1") as client:
        robot = client.robot("ma2000")
        for say in (lambda: robot.control(moves_real_arm=given), lambda: robot.queue.resume(moves_real_arm=given)):
            with pytest.raises(SpecError, match=r"must be True \(the operator consents\) or False"):
                say()


# ---- What the line to a controller can give, as a status has it, and as people read it

LINK = LinkStatus(state="connected", counters={"requests": 7.0}, age=0.5)


def identity(**fields: bool) -> RobotIdentity:
    return RobotIdentity.model_validate({"simulated": True, "protocol": 2, "period": 0.02, "boots": 1} | fields)


def test_one_line_tells_the_rates_and_the_stop_as_far_as_they_are_known() -> None:
    line = rates_line(with_rates(LINK, 1920.0, identity()))
    assert (
        line == "samples per second on this line: 1 joint 16.7, 3 joints 16.7, 6 joints 12.5; a stop takes up to 45 ms"
    )
    found = with_rates(LINK, 1920.0, identity(samples=False))
    assert (found.rates, found.stop_seconds) == ((), pytest.approx(66 / 1920 + 0.010))
    assert rates_line(found) == ""
    known = with_rates(LINK, 1920.0, identity())
    assert rates_line(LINK) == ""
    assert rates_line(known.model_copy(update={"stop_seconds": None})) == ""
    assert rates_line(known.model_copy(update={"rates": ()})) == ""
    found = with_rates(LINK, math.inf, identity())
    assert [(rate.every, rate.share) for rate in found.rates] == [(1, 0.0)] * 3
    assert found.stop_seconds == 0.010
