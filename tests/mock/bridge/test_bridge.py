"""What each request does, what is refused, when the bridge meets the controller; how the board follows the clock."""

from pathlib import Path
from random import Random

import pytest

from firmware_protocol import commands as c
from firmware_protocol.commands import AFTER_NEWEST, Sample, Snapshot, Stop, Stopped
from firmware_protocol.framing import Frame, encode_frame
from firmware_protocol.message import Request
from firmware_protocol.session import parse_reply, to_frame
from mock_controller.board.parameters import default_board_text
from mock_controller.bridge.bridge import WAIT_LIMIT_PERIODS, Bridge
from mock_controller.pace import LATE_US
from mock_controller.timeline import Timeline
from tests.mock.host import LockStepHost, RealTimeHost


@pytest.fixture
def host() -> LockStepHost:
    return LockStepHost()


def refusal(reply: object) -> c.Refusal:
    assert isinstance(reply, c.Refused)
    return c.Refusal(reply.reason)


def test_hello_tells_what_the_bridge_can_do_until_the_connection_ends(host: LockStepHost) -> None:
    everything = c.Capability.SAMPLE | c.Capability.COMPACT | c.Capability.LOCK_STEP | c.Capability.SIMULATED
    reply = host.ask(c.Hello(2, 77))
    assert isinstance(reply, c.HelloReply)
    assert reply == c.HelloReply(2, everything, 20_000, 64, 1, 77, reply.session)
    assert reply.session != 0
    without = LockStepHost(sample=False).ask(c.Hello(2, 78))
    assert isinstance(without, c.HelloReply)
    assert without == c.HelloReply(
        2, c.Capability.LOCK_STEP | c.Capability.SIMULATED, 20_000, 0, 1, 78, without.session
    )
    assert host.ask(c.SetGripper(1)) == c.GripperSet()
    host.pace.hang_up()
    assert refusal(host.ask(c.SetGripper(0))) is c.Refusal.BAD_SESSION


@pytest.mark.parametrize("first_number", [0xFFFFFFFF, 0])
def test_no_session_and_no_stop_has_the_number_0(host: LockStepHost, first_number: int) -> None:
    bridge = Bridge(Timeline(host.board, host.device.faults), first_number=first_number)
    numbers = set()
    for nonce in range(3):
        reply = parse_reply(bridge.receive(to_frame(0, c.Hello(2, nonce)))[0])
        assert isinstance(reply, c.HelloReply)
        bridge.receive(to_frame(0, c.Stop()))
        status = parse_reply(bridge.receive(to_frame(0, c.ReadStatus()))[0])
        assert isinstance(status, c.Status)
        numbers |= {reply.session, status.stop}
    assert len(numbers) == 6
    assert 0 not in numbers


def test_process_outputs_change_only_in_the_mask_and_inputs_are_read(host: LockStepHost) -> None:
    host.board.set_process_inputs(0b1010_0000)
    assert host.ask(c.WriteOutputs(0b0011, 0b0001)) == c.OutputsWritten()
    assert host.ask(c.WriteOutputs(0b0110, 0b0100)) == c.OutputsWritten()
    assert host.ask(c.SetGripper(1)) == c.GripperSet()
    host.ask(c.Advance(20_000))
    assert host.ask(c.ReadProcess()) == c.Process(0b1010_0000, 0b0101, 1)
    assert host.board.gripper_closed


def test_a_sample_that_waits_in_vain_is_refused(tmp_path: Path) -> None:
    slow = tmp_path / "board.toml"
    slow.write_text(default_board_text().replace("reset = { value = 100000", "reset = { value = 2000000"), "utf-8")
    host = LockStepHost(board=slow)
    host.ask(c.Advance(100_000))
    host.board.brown_out()
    assert refusal(host.ask(c.Sample(5, 1))) is c.Refusal.NOTHING_NEW
    assert host.board.time_us == 100_000 + WAIT_LIMIT_PERIODS * 20_000


@pytest.mark.parametrize(
    ("opcode", "payload", "reason"),
    [
        (0x55, b"", c.Refusal.UNKNOWN_OPCODE),
        (0x90, b"", c.Refusal.UNKNOWN_OPCODE),
        (0x02, b"\x00\xfc", c.Refusal.BAD_LENGTH),
        (0x04, b"\x01\xf4\x01", c.Refusal.BAD_LENGTH),
        (0x04, bytes(8) + b"\x01\xe8\x03", c.Refusal.BAD_VALUE),
        (0x04, bytes(8) + b"\x40\x00\x00", c.Refusal.BAD_VALUE),
        (0x07, bytes(8) + b"\x01\x15\x00\x00", c.Refusal.BAD_VALUE),
        (0x02, b"\xff\xff\x02", c.Refusal.BAD_ADDRESS),
        (0x03, bytes(8) + b"\x7f\xfc12", c.Refusal.BAD_ADDRESS),
        (0x01, b"\x02\x00", c.Refusal.BAD_LENGTH),
        (0x10, b"\x00\x00\x00\x00\x00", c.Refusal.BAD_VALUE),
    ],
)
def test_a_frame_that_is_wrong_is_refused(host: LockStepHost, opcode: int, payload: bytes, reason: c.Refusal) -> None:
    before = bytes(host.board.memory.get(0xFC00 + offset) for offset in range(0x80))
    output = host.turn(encode_frame(Frame(7, opcode, payload)))
    assert host.dialect.feed(output) == [(7, c.Refused(opcode, reason))]
    assert bytes(host.board.memory.get(0xFC00 + offset) for offset in range(0x80)) == before
    assert host.device.bridge.refused == {reason.name: 1}


def test_an_advance_lets_time_pass_once(host: LockStepHost) -> None:
    assert host.ask(c.Advance(123_456), sequence=5) == c.Advanced(123_456, 7)
    assert host.ask(c.Advance(123_456), sequence=5) == c.Advanced(123_456, 7)
    assert host.ask(c.Advance(0), sequence=6) == c.Advanced(123_456, 7)
    assert host.ask(c.Advance(0), sequence=4) == c.Advanced(123_456, 7), "the time may always be asked for"
    assert refusal(host.ask(c.Advance(1), sequence=4)) is c.Refusal.STALE


# ---- A bridge that sees the period keeps clear of the controller's fetch

SIX = tuple((joint, 500) for joint in range(1, 7))


def busy(sample: bool, seed: int) -> LockStepHost:
    """A host that has accessed the memory at 400 random moments."""
    host, dice = LockStepHost(sample=sample, seed=seed), Random(seed)
    for _ in range(400):
        host.ask(c.Advance(dice.randrange(3000)))
        accesses: list[Request] = [
            c.WriteSetPoints(SIX),
            c.ReadBlock(0xFC00, 48),
            c.WriteBlock(0xFC74, b"12345678"),
            c.ReportErrorsPositionsPowers(63),
            c.SetGains(1, 2, 0, 0),
            c.Stop(),
        ]
        request = dice.choice(accesses)
        host.ask(request)
        if isinstance(request, c.Stop):
            host.release()
    return host


def test_only_a_blind_bridge_makes_the_controller_miss_set_points() -> None:
    host = busy(sample=True, seed=1)
    assert host.board.counters.periods > 30
    assert host.board.counters.set_points_missed == 0
    assert busy(sample=False, seed=1).board.counters.set_points_missed > 0


# ---- The board follows the clock, is never ahead for long, catches up, and listens meanwhile


def test_board_time_is_the_clock_and_the_loop_never_sleeps_past_what_is_due() -> None:
    host = RealTimeHost()
    for step in (1, 999, 12_345, 20_000, 3):
        host.wait(step)
    assert host.board.time_us == 33_348
    assert host.pace.lateness.late_ticks == 0
    host = RealTimeHost()
    host.wait(7_000)
    assert host.board.time_us + host.pace.timeout_s() * 1e6 == host.board.next_event_us
    host.send(1, Sample(AFTER_NEWEST, 1))
    ticks = []
    for number in range(2, 52):
        ((_, _, reply),) = host.wait(20_000)
        assert isinstance(reply, Snapshot)
        ticks.append(reply.tick)
        host.send(number, Sample(reply.tick, 1))
    assert ticks == list(range(2, 52))


def test_a_starved_process_catches_up_and_counts_what_was_late() -> None:
    host = RealTimeHost()
    host.wait(1_000)
    host.clock.now_us += 1_000_000
    host.wait(0)
    assert host.board.time_us == 1_001_000
    assert host.board.counters.periods == 51
    assert host.pace.lateness.late_ticks == 49  # the last began 1 ms ago
    assert host.pace.lateness.worst_us == 981_000


def test_one_that_waits_lets_the_board_stand_still_and_says_for_how_long() -> None:
    host = RealTimeHost(waits=True)
    host.wait(1_000)
    due = host.board.next_event_us
    host.clock.now_us += 1_000_000
    host.wait(0)
    assert host.board.time_us == due, "what was due is done, and nothing after it"
    waited = 1_001_000 - due
    assert host.pace.lateness.waited_us == waited
    host.wait(20_000)
    assert host.board.time_us == due + 20_000, "it goes on at its own pace"
    host.clock.now_us = host.pace.zero_us + host.board.next_event_us + LATE_US
    host.wait(0)
    assert host.pace.lateness.waited_us == waited, "what every process must expect is no wait"


def test_a_stop_does_not_wait_until_a_starved_process_has_caught_up() -> None:
    host = RealTimeHost()
    host.wait(1_000)
    host.clock.now_us += 10_000_000
    host.send(1, Stop())
    answered = [type(reply) for _, reply in host.dialect.feed(host.pace.work())]
    assert host.board.frozen
    assert host.board.time_us < 200_000
    answered += [type(reply) for _, _, reply in host.wait(0)]
    assert answered == [Stopped]


def test_the_moments_of_a_stop_are_recorded_and_a_missed_period_has_not_used_it() -> None:
    host = RealTimeHost()
    host.wait(30_000)
    assert host.device.bridge.stops.frozen_us is None
    host.send(1, Stop())
    host.wait(20_000)
    stops = host.device.bridge.stops
    assert (stops.count, stops.received_us, stops.frozen_us, stops.frozen_tick) == (1, 30_000, 30_120, 2)
    assert (stops.first_used_us, stops.first_used_tick) == (40_000, 3)
    host = RealTimeHost(fault=("busy_memory:start=0.035,duration=0.01",))
    host.wait(30_000)
    host.send(1, Stop())
    host.wait(60_000)
    stops = host.device.bridge.stops
    assert (stops.first_used_us, stops.first_used_tick) == (60_000, 4)
