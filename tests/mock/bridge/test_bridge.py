"""What each request does, and what is refused."""

from pathlib import Path

import pytest

from firmware_protocol import commands as c
from firmware_protocol.framing import Frame, encode_frame
from firmware_protocol.units import counts_to_posture
from mock_controller.board.parameters import default_board_text
from mock_controller.bridge.bridge import WAIT_LIMIT_PERIODS, Bridge
from mock_controller.timeline import Timeline
from tests.mock.host import LockStepHost


@pytest.fixture
def host() -> LockStepHost:
    return LockStepHost()


def refusal(reply: object) -> c.Refusal:
    assert isinstance(reply, c.Refused)
    return c.Refusal(reply.reason)


def test_hello_tells_what_the_bridge_can_do(host: LockStepHost) -> None:
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


def test_the_session_ends_with_the_connection(host: LockStepHost) -> None:
    assert host.ask(c.SetGripper(1)) == c.GripperSet()
    host.pace.hang_up()
    assert refusal(host.ask(c.SetGripper(0))) is c.Refusal.BAD_SESSION


@pytest.mark.parametrize("first_number", [0xFFFFFFFF, 0])
def test_no_session_and_no_stop_has_the_number_0(host: LockStepHost, first_number: int) -> None:
    bridge = Bridge(Timeline(host.board, host.device.faults), first_number=first_number)
    numbers = set()
    for nonce in range(3):
        reply = c.parse_reply(bridge.receive(c.to_frame(0, c.Hello(2, nonce)))[0])
        assert isinstance(reply, c.HelloReply)
        bridge.receive(c.to_frame(0, c.Stop()))
        status = c.parse_reply(bridge.receive(c.to_frame(0, c.ReadStatus()))[0])
        assert isinstance(status, c.Status)
        numbers |= {reply.session, status.stop}
    assert len(numbers) == 6
    assert 0 not in numbers


def test_set_points_are_in_the_memory_and_taken_by_the_next_period(host: LockStepHost) -> None:
    taken = host.ask(c.WriteSetPoints(((1, 520), (3, 480))))
    assert isinstance(taken, c.SetPointsTaken)
    assert host.board.memory.values("set_point")[0:3:2] == [520, 480]
    snapshot = host.ask(c.Sample(taken.tick, c.ALL_JOINTS))
    assert isinstance(snapshot, c.Snapshot)
    readings = dict(snapshot.joints)
    assert snapshot.tick == taken.tick + 1
    assert (readings[1].set_point, readings[3].set_point) == (520, 480)
    assert readings[2].set_point == host.board.memory.values("set_point")[1]


def test_bytes_that_are_poked_can_be_peeked(host: LockStepHost) -> None:
    assert host.ask(c.WriteBlock(0xFC78, b"\x01\x02\x03")) == c.BlockWritten()
    assert host.ask(c.ReadBlock(0xFC77, 5)) == c.Block(b"\x00\x01\x02\x03\x00")


@pytest.mark.parametrize("request_", [c.ReadBlock(0xFBFF, 1), c.ReadBlock(0xFC7F, 2), c.WriteBlock(0xFC7F, b"ab")])
def test_memory_ends_where_the_map_says(host: LockStepHost, request_: c.Request) -> None:
    before = host.board.time_us
    assert refusal(host.ask(request_)) is c.Refusal.BAD_ADDRESS
    assert host.board.time_us == before


def test_gains_are_written_and_reported(host: LockStepHost) -> None:
    assert host.ask(c.SetGains(2, 5, 1, 3)) == c.GainsSet()
    assert host.ask(c.ReportGains()) == c.Gains(((2, 0, 0), (5, 1, 3), *(((2, 0, 0),) * 4)))


def test_process_outputs_change_only_in_the_mask_and_inputs_are_read(host: LockStepHost) -> None:
    host.board.set_process_inputs(0b1010_0000)
    assert host.ask(c.WriteOutputs(0b0011, 0b0001)) == c.OutputsWritten()
    assert host.ask(c.WriteOutputs(0b0110, 0b0100)) == c.OutputsWritten()
    assert host.ask(c.SetGripper(1)) == c.GripperSet()
    host.ask(c.Advance(20_000))
    assert host.ask(c.ReadProcess()) == c.Process(0b1010_0000, 0b0101, 1)
    assert host.board.gripper_closed


def test_stop_freezes_the_measured_posture_and_refuses_set_points_until_release(host: LockStepHost) -> None:
    host.ask(c.WriteSetPoints(((1, 600),)))
    host.ask(c.Advance(310_000))
    stopped = host.ask(c.Stop())
    assert isinstance(stopped, c.Stopped)
    newest = host.board.snapshots.newest()
    assert newest is not None
    assert list(stopped.postures) == [counts_to_posture(counts) for counts in newest.positions]
    assert host.board.memory.values("set_point") == list(stopped.postures)
    assert refusal(host.ask(c.WriteSetPoints(((1, 600),)))) is c.Refusal.FROZEN
    assert refusal(host.ask(c.WriteBlock(0xFC00, b"\x00"))) is c.Refusal.FROZEN
    assert host.ask(c.WriteBlock(0xFC78, b"\x00")) == c.BlockWritten()
    snapshot = host.ask(c.Sample(stopped.tick, 1))
    assert isinstance(snapshot, c.Snapshot)
    assert snapshot.status & c.StatusFlag.FROZEN
    assert host.ask(c.Stop()) == stopped
    status = host.ask(c.ReadStatus())
    assert isinstance(status, c.Status)
    assert refusal(host.ask(c.Release(status.stop - 1))) is c.Refusal.OTHER_STOP
    assert host.ask(c.Release(status.stop)) == c.Released()
    assert host.ask(c.Release(status.stop)) == c.Released()
    assert isinstance(host.ask(c.WriteSetPoints(((1, 600),))), c.SetPointsTaken)


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
def test_a_whole_frame_that_is_wrong_is_refused(
    host: LockStepHost, opcode: int, payload: bytes, reason: c.Refusal
) -> None:
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
