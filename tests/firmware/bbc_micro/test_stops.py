"""A stop of the image freezes the posture of now, and is answered, whatever the memory and the bus do."""

from collections.abc import Callable
from itertools import count, pairwise
from typing import Any

import pytest

from tests.firmware.bbc_micro import needs

needs.require()

from firmware_protocol import commands as c  # noqa: E402
from firmware_protocol.framing import FrameDecoder, encode_frame  # noqa: E402
from firmware_protocol.memory_map import default_memory_map  # noqa: E402
from firmware_protocol.message import Request, Stamp  # noqa: E402
from firmware_protocol.session import parse_reply, to_frame  # noqa: E402
from firmware_protocol.units import counts_to_posture  # noqa: E402
from tests.firmware.bbc_micro.built import machine  # noqa: E402

MAP = default_memory_map()
POSITION_LOW, POSITION_HIGH = MAP["position"].low, MAP["position"].high or ()
POWER_OF_JOINT_6 = MAP["power"].low[5]
ANSWERED_US = 12_000
"""docs/bbc-micro.md: a stop that reads the posture four times."""
RESTING = (500, 333, 500, 500, 500, 500)
"""Posture of the mock's arm, within two units."""
PERIOD_US = 20_000

Bus = Callable[[int, int], int]


class Host:
    """A host at an image that has been started; its arm has been released."""

    def __init__(self) -> None:
        self.bbc = machine()
        self._sequence = 0
        self._stamp = Stamp(0, 0)
        self.took_us = 0
        self.run(60_000)
        self._stamp = Stamp(self.ask(c.Hello(c.PROTOCOL_VERSION, 77)).session, 0)
        self.release()
        self.run(5 * PERIOD_US)

    def run(self, us: int) -> None:
        """Lets time pass."""
        self.bbc.run_until(self.bbc.cycle + 2 * us)

    def ask(self, request: Request) -> Any:
        """The reply; its first byte is on the line `took_us` after the request's last."""
        bbc = self.bbc
        self._sequence += 1
        if request.IS_COMMAND:
            self._stamp = Stamp(self._stamp.session, self._stamp.number + 1)
        bbc.serial.sent.clear()
        arrived = bbc.serial.host_sends(encode_frame(to_frame(self._sequence, request, self._stamp)))
        decoder = FrameDecoder()
        while bbc.cycle < arrived + 2 * 100_000:
            self.run(200)
            while bbc.serial.sent:
                at, byte = bbc.serial.sent.popleft()
                for frame in decoder.feed(bytes((byte,))):
                    self.took_us = (at - arrived - len(encode_frame(frame)) * bbc.serial.byte_cycles) // 2
                    return parse_reply(frame)
        raise AssertionError(f"no reply to {request}")

    def release(self) -> None:
        """Ends the freeze that is in force."""
        assert self.ask(c.Release(self.ask(c.ReadStatus()).stop)) == c.Released()

    def stop(self) -> tuple[int, ...]:
        """The postures that a stop freezes."""
        stopped = self.ask(c.Stop())
        assert self.took_us <= ANSWERED_US
        return tuple(stopped.postures)


def flickering(address: int, bit: int = 1) -> Bus:
    """A bus on which one bit of one byte is another at every reading."""
    turns = count()
    return lambda at, value: value ^ bit * (next(turns) & 1) if at == address else value


@pytest.fixture
def host() -> Host:
    return Host()


def near(postures: tuple[int, ...], wanted: tuple[int, ...]) -> bool:
    """Whether two postures are within the noise of each other."""
    return all(abs(is_ - should) <= 2 for is_, should in zip(postures, wanted, strict=True))


def test_a_stop_takes_the_newest_snapshot_at_once(host: Host) -> None:
    assert host.bbc.variable("ring_count", 1) >= 3
    assert near(host.stop(), RESTING)
    assert host.took_us <= 5_000


def test_snapshots_that_never_become_whole_leave_no_old_posture_to_a_stop(host: Host) -> None:
    flicker = flickering(POWER_OF_JOINT_6)
    host.bbc.on_the_bus = lambda at, value: flicker(at, value) ^ (4 if at == POSITION_HIGH[1] else 0)
    host.run(20 * PERIOD_US)
    postures = host.stop()
    assert abs(postures[1] - RESTING[1]) in range(248, 253), "1024 counts from where the last snapshot has it"


@pytest.mark.parametrize("bit", [1, 0x80])
def test_a_bit_that_flickers_in_a_position_cannot_hold_a_stop_up(host: Host, bit: int) -> None:
    host.bbc.on_the_bus = flickering(POSITION_LOW[0], bit)
    before = RESTING
    for moment in range(12):  # the arm goes to what each stop freezes, and creeps under its weight
        host.run(2 * PERIOD_US + 1_700 * moment)
        postures = host.stop()
        assert abs(postures[0] - before[0]) <= 2 + bit // 2
        assert near((before[0], *postures[1:]), before)
        before = postures
        host.release()


def test_a_joint_is_frozen_at_what_two_readings_agreed_on_last(host: Host) -> None:
    host.bbc.on_the_bus = flickering(POWER_OF_JOINT_6)
    host.run(5 * PERIOD_US)
    held = host.stop()
    host.release()
    readings = {POSITION_HIGH[0]: (2, 4, 6, 10), POSITION_HIGH[3]: (4, 4, 6, 10)}  # joint 1 never agrees, 4 at first
    begins = host.bbc.variable("stop", 4)
    turns = {address: count() for address in readings}

    def bus(address: int, value: int) -> int:
        if address in readings and host.bbc.variable("stop", 4) != begins:
            return readings[address][min(next(turns[address]), 3)]
        return value

    host.bbc.on_the_bus = lambda address, value: bus(address, value ^ (address == POWER_OF_JOINT_6 and next(odd) & 1))
    odd = count()
    host.run(5 * PERIOD_US)
    first, second, third, fourth, *others = host.stop()
    assert counts_to_posture(10 * 256) <= first <= counts_to_posture(11 * 256)
    assert counts_to_posture(4 * 256) <= fourth <= counts_to_posture(5 * 256)
    assert near((second, third, *others), (*held[1:3], *held[4:]))


def test_a_stop_of_a_board_without_supply_writes_nothing(host: Host) -> None:
    host.bbc.on_the_bus = lambda _at, _value: 0
    host.run(3 * PERIOD_US)
    assert host.stop() == (0,) * 6


def test_a_period_that_cannot_be_read_costs_that_sample_and_no_other(host: Host) -> None:
    seen = host.ask(c.Sample(c.AFTER_NEWEST, 1)).tick
    host.run(6 * PERIOD_US)
    host.bbc.on_the_bus = flickering(POWER_OF_JOINT_6)
    host.run(2 * PERIOD_US)
    host.bbc.on_the_bus = lambda _address, value: value
    host.run(6 * PERIOD_US)
    ticks = [seen]
    while len(ticks) < 12:
        ticks.append(host.ask(c.Sample(ticks[-1], 1)).tick)
    gaps = sorted(later - earlier for earlier, later in pairwise(ticks))
    assert gaps[:-1] == [1] * 10
    assert gaps[-1] in (2, 3)
