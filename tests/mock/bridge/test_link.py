"""Bytes on the line, on the board's time: line rate, damage, a Sample that waits, and Stop at any moment."""

from firmware_protocol import commands as c
from mock_controller.bridge.line import Line
from tests.mock.host import RealTimeHost


def test_bytes_follow_one_another_on_the_line() -> None:
    line = Line(115_200)
    assert line.carry(57, 1000) == 1000 + 4948
    assert line.carry(1, 1000) == 1000 + 4948 + 87
    assert line.carry(1, 100_000) == 100_087
    assert Line(None).carry(1000, 7) == 7


def test_a_round_trip_takes_both_ways_on_the_line() -> None:
    host = RealTimeHost(baud=9600)
    host.wait(1000)
    host.send(1, c.Hello(2, 5))
    ((moment, sequence, reply),) = host.wait(100_000)
    assert (sequence, type(reply)) == (1, c.HelloReply)
    assert moment == -(-14 * 10_000_000 // 9600) + -(-27 * 10_000_000 // 9600)


def test_a_sample_waits_for_its_period_while_others_are_answered() -> None:
    host = RealTimeHost()
    host.wait(7_000)
    host.send(1, c.Sample(c.AFTER_NEWEST, 1))
    host.send(2, c.ReadStatus())
    assert [(number, type(reply)) for _, number, reply in host.wait(10)] == [(2, c.Status)]
    host.send(3, c.Stop())
    answers = host.wait(1_000)
    assert [(number, type(reply)) for _, number, reply in answers] == [(3, c.Stopped)]
    assert answers[0][0] < 500
    ((moment, number, reply),) = host.wait(30_000)
    assert (number, type(reply)) == (1, c.Snapshot)
    assert moment == 26_300 - 8_010


def test_a_sample_is_answered_though_its_moment_falls_into_another_request() -> None:
    host = RealTimeHost()
    host.wait(26_100)
    host.send(1, c.Sample(c.AFTER_NEWEST, 1))
    host.send(2, c.ReadBlock(0xFC00, 48))
    answers = host.wait(1_000)
    assert sorted(number for _, number, _ in answers) == [1, 2]


def test_damage_is_counted_and_never_answered() -> None:
    host = RealTimeHost()
    frame = bytearray(host.dialect.encode(1, c.Hello(2, 5)))
    frame[4] ^= 0x10
    host.pace.receive(bytes(frame))
    host.pace.receive(b"\0" + b"x" * 500 + b"\0")
    assert host.wait(30_000) == []
    assert host.device.link.counts.damaged == 2
    host.send(2, c.Hello(2, 5))
    assert [number for _, number, _ in host.wait(100)] == [2]


def test_a_host_that_hangs_up_leaves_nothing_behind() -> None:
    host = RealTimeHost(baud=9600)
    host.send(1, c.Hello(2, 5))
    host.wait(30_000)
    host.send(2, c.Sample(c.AFTER_NEWEST, 1))
    host.pace.receive(b"\0\x09unfinished")
    host.wait(5_000)
    host.pace.hang_up()
    assert host.wait(100_000) == []
    host.send(3, c.Hello(2, 5))
    assert [number for _, number, _ in host.wait(100_000)] == [3]
    assert host.device.link.counts.damaged == 0


def test_replies_to_all_requests_in_one_write_come_in_order() -> None:
    host = RealTimeHost()
    host.pace.receive(b"".join(host.dialect.encode(number, c.ReadStatus()) for number in range(5)))
    assert [number for _, number, _ in host.wait(100)] == [0, 1, 2, 3, 4]
    assert host.device.link.counts.frames_received == 5
