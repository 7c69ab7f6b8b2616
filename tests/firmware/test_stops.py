"""The core in C: stops freeze the posture of now, and every vector of vectors.json is true."""

import json
from collections.abc import Callable
from itertools import count, pairwise
from random import Random
from typing import Any

import pytest

from firmware_protocol import commands as c
from firmware_protocol.commands import Refusal
from firmware_protocol.framing import Frame, FrameDecoder, encode_frame
from firmware_protocol.memory_map import JOINTS
from firmware_protocol.units import counts_to_posture
from tests.firmware.bench import Bench, partner
from tests.firmware.compiled import need
from tests.firmware.core import PeriodSource
from tests.firmware.machine import MAP, PERIOD_US, Machine, noisy, sweeping
from tests.protocol.make_vectors import FILE
from tests.protocol.play import play
from tests.protocol.second_implementation import frame_of

ANSWERED_US = 10_000
"""PROTOCOL.md, section 3: a stop whose posture has to be read."""
OF_JOINT_1 = MAP["position"].low[0]
POWER_OF_JOINT_6 = MAP["power"].low[5]


@pytest.fixture(autouse=True)
def _compiler() -> None:
    need("gcc", "make")


def moving(tick: int) -> list[int]:
    """An arm of which every joint moves on by 10 counts a period."""
    return [1000 + 10 * tick] * JOINTS


def flickering(address: int, bit: int = 1) -> Callable[[int, int], int]:
    """A bus on which one bit of one byte is another at every reading."""
    turns = count()
    return lambda at, value: value ^ bit * (next(turns) & 1) if at == address else value


def tell(machine: Machine, periods: int) -> None:
    """Periods that a wire tells the bridge, each when its results have been stored."""
    machine.run(9_000 - machine.now_us % PERIOD_US)
    for _ in range(periods):
        machine.core.period_ended()
        machine.periods(1)


def postures_now(machine: Machine, back: int = 1) -> tuple[int, ...]:
    """The posture that was stored so many periods ago."""
    return tuple(counts_to_posture(position) for position, _, _ in machine.whole[-back])


CLOCK_ROUND_US = 1 << 32


def rising(tick: int) -> list[int]:
    """An arm that moves on for 1000 periods."""
    return [min(1000 + 2 * tick, 3000)] * JOINTS


@pytest.mark.parametrize("later_us", [3 * PERIOD_US, 10_000_000])
def test_a_wire_that_has_broken_leaves_no_old_posture_to_a_stop(later_us: int) -> None:
    machine = Machine(rising, PeriodSource.TOLD)
    machine.greet()
    tell(machine, 5)
    machine.run(later_us)
    assert machine.ask(c.Stop(), ANSWERED_US).postures == postures_now(machine)


def test_a_snapshot_is_not_new_again_when_the_clock_has_gone_round() -> None:
    machine = Machine(rising, PeriodSource.TOLD)
    machine.greet()
    tell(machine, 5)
    kept_us = machine.now_us
    machine.run(3 * PERIOD_US)
    machine.shift(kept_us + CLOCK_ROUND_US - machine.now_us)
    machine.now_us = kept_us + CLOCK_ROUND_US
    machine.run(PERIOD_US)
    assert machine.ask(c.Stop(), ANSWERED_US).postures == postures_now(machine)


def test_no_old_posture_is_left_to_a_stop_by_a_flickering_power_or_told_periods() -> None:
    machine = Machine(moving)
    machine.greet()
    machine.periods(5)
    machine.on_the_bus = flickering(POWER_OF_JOINT_6)
    machine.periods(100)
    stopped = machine.ask(c.Stop(), ANSWERED_US)
    assert stopped.postures in (postures_now(machine), postures_now(machine, 2))
    machine = Machine(moving, PeriodSource.TOLD)
    machine.greet()
    tell(machine, 5)
    assert machine.ask(c.Stop(), 500).postures == postures_now(machine, 2), "told last"


@pytest.mark.parametrize("source", [PeriodSource.WATCHED, PeriodSource.UNSEEN], ids=["SAMPLE", "no SAMPLE"])
@pytest.mark.parametrize("bit", [1, 0x80])
def test_a_bit_that_flickers_in_a_position_cannot_hold_a_stop_up(source: PeriodSource, bit: int) -> None:
    machine = Machine(noisy, source)
    machine.greet()
    machine.periods(5)
    machine.on_the_bus = flickering(OF_JOINT_1, bit)
    machine.periods(20)
    for moment in range(40):
        machine.run(500 * moment)
        stopped = machine.ask(c.Stop(), ANSWERED_US)
        assert all(abs(at - 500) <= 1 for at in stopped.postures[1:])
        assert abs(stopped.postures[0] - 500) <= 1 + bit // 4, "a reading that it has had"
        machine.release()


def test_of_joints_that_agree_at_some_time_the_agreed_reading_is_frozen() -> None:
    machine = Machine(noisy, PeriodSource.UNSEEN)
    machine.greet()
    machine.run(12_000)
    readings = {address: count() for address in MAP["position"].low}

    def bus(address: int, value: int) -> int:
        if address == OF_JOINT_1:
            return next(readings[address]) * 10  # never twice the same
        if address == MAP["position"].low[1]:
            return (100, 100, 200, 0)[min(next(readings[address]), 3)]
        return value

    machine.on_the_bus = bus
    stopped = machine.ask(c.Stop(), ANSWERED_US)
    assert stopped.postures[:2] == (counts_to_posture(2048 + 30), counts_to_posture(2048 + 100))


def test_a_period_that_cannot_be_read_costs_that_sample_and_no_other() -> None:
    machine = Machine(sweeping)
    machine.periods(5)
    seen = machine.ask(c.Sample(c.AFTER_NEWEST, 1)).tick
    machine.periods(6)
    machine.on_the_bus = flickering(POWER_OF_JOINT_6)
    machine.periods(2)
    machine.on_the_bus = lambda _address, value: value
    machine.periods(6)
    ticks = []
    for _ in range(12):
        seen = machine.ask(c.Sample(seen, 1)).tick
        ticks.append(seen)
    assert ticks[0] == ticks[5] - 5, "from before the gap"
    gaps = sorted(later - earlier for earlier, later in pairwise(ticks))
    assert gaps[:-1] == [1] * 10
    assert gaps[-1] in (2, 3)


# ---- The core in C finds every vector of vectors.json true, and says to the byte what the second bridge says

VECTORS: dict[str, Any] = json.loads(FILE.read_text("utf-8"))
REFUSED = [vector for vector in VECTORS["refused"] if vector["direction"] == "request"]
DIALOGUES = [dialogue for dialogue in VECTORS["dialogues"] if "COMPACT" not in dialogue["needs"]]
"""The core is for lines that carry a turn in every period: it goes without the ability COMPACT."""
UNSEEN = [dialogue for dialogue in DIALOGUES if "SAMPLE" not in dialogue["needs"]]
NOT_THERE = {0x11: "UNKNOWN_OPCODE", 0x40: "NOT_CAPABLE"}
"""Requests of abilities that the core has not, and how it refuses them."""
LONGEST_PIECE = 55
"""Bytes between two zeros; the receiver drops what is longer before it looks at the stuffing."""
STATUS = frame_of(0x7777, 0x33, b"")


def answers(bench: Bench, line: bytes) -> list[Frame]:
    """The frames that the core sends to some bytes."""
    return FrameDecoder().feed(bench.receive(line))


def test_every_crc_and_every_stuffing_is_that_of_the_vectors() -> None:
    core = Bench().core
    for vector in VECTORS["crc"]:
        assert f"{core.crc_of(bytes.fromhex(vector['data'])):04x}" == vector["crc"]
    for vector in VECTORS["cobs"]:
        body, stuffed = bytes.fromhex(vector["body"]), bytes.fromhex(vector["stuffed"])
        assert core.stuff(body) == stuffed
        assert core.unstuff(stuffed) == body
    for encoded in VECTORS["cobs_broken"]:
        piece = bytes.fromhex(encoded)
        assert len(piece) > LONGEST_PIECE or core.unstuff(piece) is None


@pytest.mark.parametrize("vector", VECTORS["frames"], ids=lambda v: f"{v['message']} {v['sequence']}")
def test_every_frame_is_answered_under_its_number(vector: dict[str, Any]) -> None:
    """A request by its reply or a refusal, a reply, which no bridge is sent, as an unknown request."""
    line = bytes.fromhex(vector["frame"])
    (sent,) = FrameDecoder().feed(line)
    replies = answers(Bench(), line)
    if sent.opcode == 0x10:  # waits for a period
        assert not replies
        return
    (reply,) = replies
    assert reply.sequence == sent.sequence
    if sent.opcode >= 0x80:
        assert (reply.opcode, reply.payload) == (0xFF, bytes((sent.opcode, Refusal.UNKNOWN_OPCODE)))
    else:
        assert reply.opcode in (sent.opcode | 0x80, 0xFF)


@pytest.mark.parametrize("vector", VECTORS["damaged"], ids=lambda v: v["why"])
def test_damaged_lines_are_not_answered_and_the_next_frame_is(vector: dict[str, str]) -> None:
    bench = Bench()
    assert answers(bench, bytes.fromhex(vector["line"])) == []
    assert answers(bench, STATUS)[-1].opcode == 0xB3


@pytest.mark.parametrize("vector", REFUSED, ids=lambda v: f"{v['opcode']:02x} {v['why']}")
def test_payloads_that_must_be_refused_are_refused(vector: dict[str, Any]) -> None:
    opcode = vector["opcode"]
    (reply,) = answers(Bench(), frame_of(1, opcode, bytes.fromhex(vector["payload"])))
    wanted = NOT_THERE.get(opcode, vector["reason"])
    assert (reply.opcode, reply.payload) == (0xFF, bytes((opcode, Refusal[wanted])))


@pytest.mark.parametrize("dialogue", DIALOGUES, ids=lambda d: d["rule"])
def test_a_dialogue_goes_as_the_second_bridge_has_it_to_the_byte(dialogue: dict[str, Any]) -> None:
    bridge = partner()
    for number, step in enumerate(dialogue["steps"]):
        if "board" in step:
            bridge.happens(step["board"])
        elif "host" in step:
            bridge.send(bytes.fromhex(step["frame"]))
        else:
            assert encode_frame(bridge.reply(step["sequence"])).hex() == step["frame"], (number, step)
    assert not bridge.rest()


@pytest.mark.parametrize("dialogue", UNSEEN, ids=lambda d: d["rule"])
def test_a_bridge_that_sees_no_period_keeps_the_same_rules(dialogue: dict[str, Any]) -> None:
    chance = Random(dialogue["rule"])
    play(dialogue["steps"], partner(PeriodSource.UNSEEN), lambda: chance.getrandbits(32))
