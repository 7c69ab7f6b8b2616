"""Readings through the documented addresses: whole or not at all, and never what the host's map leaves out."""

from collections.abc import Callable, Iterable, Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.driver import Controller
from daq.driver.double_read import MOST_READINGS, SETTLING_S, DoubleReader, Span, spans
from daq.link import Link, LinkError, RequestRefusedError
from firmware_protocol.commands import Block, ReadBlock, Refusal
from firmware_protocol.memory_map import MemoryMap, default_memory_map
from firmware_protocol.message import Request
from tests.control_port import told_by
from tests.daq.driver.memory_board import PERIOD_S, MemoryBoard
from tests.daq.link.scripted import ScriptedChannel, ScriptedEndpoint, frame_of


class ChannelClock:
    """The scripted channel's clock as the driver wants it."""

    def __init__(self, channel: ScriptedChannel) -> None:
        self._channel = channel

    def now(self) -> float:
        return self._channel.time

    def sleep_until(self, time_s: float) -> None:
        self._channel.time = max(self._channel.time, time_s)


def reader_of(board: MemoryBoard) -> tuple[DoubleReader, Link, ScriptedChannel]:
    channel = ScriptedChannel(board.answer)
    board.now = channel.now
    link = Link(ScriptedEndpoint([channel]), now=channel.now)
    return DoubleReader(link, board.memory_map, ChannelClock(channel), PERIOD_S), link, channel


def counting(period: int) -> list[tuple[int, int, int]]:
    """Positions that differ in both bytes from one period to the next, as do errors and powers."""
    value = period * 0x101 % 0x1000
    return [(value, period % 128 - 64, period % 128)] * 6


def test_a_reading_is_one_request_for_documented_positions_and_for_all_values() -> None:
    register = default_memory_map()["position"]
    assert register.high is not None
    assert spans([*register.low[:3], *register.high[:3]]) == (Span(0xFC20, 11),)
    memory_map = default_memory_map()
    wanted = [address for name in ("position", "error", "power") for address in memory_map[name].addresses]
    assert spans(wanted) == (Span(0xFC20, 38),)


@given(st.sets(st.integers(0, 0xFFFF), min_size=1, max_size=40))
def test_spans_cover_every_address_in_order_without_reading_past_it(addresses: set[int]) -> None:
    found = spans(sorted(addresses))
    covered = [address for span in found for address in range(span.start, span.start + span.count)]
    assert addresses <= set(covered)
    assert covered == sorted(set(covered))
    assert all(span.count <= 48 and {span.start, span.start + span.count - 1} <= addresses for span in found)


@settings(max_examples=100, deadline=None)
@given(
    phase=st.floats(0.0, PERIOD_S),
    store=st.floats(0.0, 60e-6),
    byte=st.floats(1e-6, 40e-6),
    delay=st.floats(0.0, 0.004),
)
def test_no_reading_mixes_two_periods(phase: float, store: float, byte: float, delay: float) -> None:
    board = MemoryBoard(counting, phase, store, byte, delay)
    reader, _, channel = reader_of(board)
    delivered = 0
    for period in range(2, 30):
        channel.time = max(channel.time, period * PERIOD_S)
        begin = channel.time
        joints = reader.read((1, 2, 3, 4, 5, 6))
        if joints is None:
            continue
        delivered += 1
        whole = [counting(k) for k in range(int((begin - phase) // PERIOD_S) - 1, int(channel.time // PERIOD_S) + 1)]
        read = [(reading.position, reading.error, reading.power) for _, reading in joints]
        assert read in whole
    assert delivered > 20 or delay > 0.003, "two readings hardly fit in a period"


def test_a_torn_reading_is_read_again_and_a_period_s_own_readings_are_not_torn() -> None:
    # The reading begins at 40 ms + 1 ms and takes 0.76 ms; the memory changes in its middle.
    board = MemoryBoard(counting, phase_s=0.0014)
    reader, link, channel = reader_of(board)
    channel.time = 2 * PERIOD_S
    joints = reader.read((1, 2, 3, 4, 5, 6))
    assert joints is not None
    assert [(reading.position, reading.error, reading.power) for _, reading in joints] == counting(2)
    assert link.counters.torn == 1
    assert reader.disturbed
    # The memory changes between the readings of one period, not within one: nothing was torn
    reader, link, _ = reader_of_bytes([5, 5, 5, 6, 6, 7, 8, 8])
    for _ in range(2):
        assert reader.read((1, 2, 3)) is not None
    assert (link.counters.torn, reader.disturbed) == (0, True)
    assert reader.read((1, 2, 3)) is not None
    assert link.counters.torn == 1, "7 is neither of this period nor of the last"


def reader_of_bytes(values: Iterable[int]) -> tuple[DoubleReader, Link, ScriptedChannel]:
    """A reader of a memory all of whose bytes have these values, one reading after the other."""
    readings = iter(values)

    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        assert isinstance(request, ReadBlock)
        return [(0.0001, frame_of(sequence, Block(bytes([next(readings)] * request.count))))]

    channel = ScriptedChannel(answer)
    link = Link(ScriptedEndpoint([channel]), now=channel.now)
    return DoubleReader(link, default_memory_map(), ChannelClock(channel), PERIOD_S), link, channel


def test_readings_that_do_not_agree_in_time_deliver_nothing() -> None:
    # Readings that all differ deliver nothing however many there are
    reader, link, channel = reader_of_bytes(range(1, 100))
    assert reader.read((1, 2, 3)) is None
    assert reader.disturbed
    assert len(channel.asked) == MOST_READINGS
    assert link.counters.torn == MOST_READINGS - 1

    # Two slow readings, 20.45 ms apart. The first meets a change behind joint 2, the second one behind joint 1, and
    # both read 10, 10, 20, which no period holds.
    def results(period: int) -> list[tuple[int, int, int]]:
        positions = {1: (10, 10, 10), 2: (10, 20, 20), 3: (20, 10, 20)}[min(max(period, 1), 3)]
        return [(position, 0, 0) for position in positions]

    reader, link, channel = reader_of(MemoryBoard(results, phase_s=0.002025, byte_s=450e-6, delay_s=0.00135))
    channel.time = 2 * PERIOD_S
    assert reader.read((1, 2, 3)) is None
    assert link.counters.torn == 0, "nothing tells the two readings apart but the time they took"
    # A line too slow for two readings in a period delivers nothing
    reader, _, channel = reader_of(MemoryBoard(lambda _: [(2048, 0, 0)] * 6, delay_s=0.012))
    channel.time = 2 * PERIOD_S
    assert reader.read((1, 2, 3)) is None
    # The memory of a board without supply is no reading
    reader, _, channel = reader_of(MemoryBoard(lambda _: [(0, 0, 0)] * 6))
    channel.time = 2 * PERIOD_S
    assert reader.read((1, 2, 3)) is None
    # Only the two readings that agree tell whether the board has its supply
    reader, _, _ = reader_of_bytes([5, 6, 0, 0])
    assert reader.read((1, 2, 3)) is None
    reader, _, _ = reader_of_bytes([5, 0, 7, 7])
    joints = reader.read((1, 2, 3))
    assert joints is not None
    assert {reading.power for _, reading in joints} == {7}


def elsewhere() -> MemoryMap:
    """A laboratory's own map: every register moved, bytes scattered."""
    data = default_memory_map().model_dump()
    data["base"], data["size"] = 0x2000, 0x1000
    for number, register in enumerate(data["registers"].values()):
        for column in ("low", "high"):
            if register[column] is not None:
                shift = 0x100 * number + (0x80 if column == "high" else 0)
                register[column] = [0x2000 + shift + 7 * i for i in range(len(register[column]))]
    return MemoryMap.model_validate(data)


def test_another_memory_map_is_followed_and_a_set_point_is_the_one_used() -> None:
    board = MemoryBoard(counting, memory_map=elsewhere(), delay_s=0.0005)
    reader, _, channel = reader_of(board)
    channel.time = 3.2 * PERIOD_S
    joints = reader.read((1, 4))
    assert joints is not None
    assert [(joint, reading.position, reading.error, reading.power) for joint, reading in joints] == [
        (joint, *counting(3)[0]) for joint in (1, 4)
    ]
    reader, _, channel = reader_of(MemoryBoard(lambda _: [(2040, 8, 16)] * 6))
    channel.time = 2.5 * PERIOD_S
    joints = reader.read((1,))
    assert joints is not None
    assert joints[0][1].set_point == 500
    assert joints[0][1].error == pytest.approx(8)


def test_the_second_reading_begins_two_milliseconds_after_the_first_has_ended() -> None:
    moments: list[float] = []

    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        assert isinstance(request, ReadBlock)
        moments.append(channel.time)
        return [(0.0015, frame_of(sequence, Block(bytes([5] * request.count))))]

    channel = ScriptedChannel(answer)
    link = Link(ScriptedEndpoint([channel]), now=channel.now)
    reader = DoubleReader(link, default_memory_map(), ChannelClock(channel), PERIOD_S)
    assert reader.read((1, 2, 3)) is not None
    assert moments == pytest.approx([0.0, 0.0015 + 0.002])
    assert SETTLING_S == 0.002


def test_a_block_of_another_length_than_asked_for_is_no_memory() -> None:
    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        assert isinstance(request, ReadBlock)
        return [(0.0, frame_of(sequence, Block(bytes(request.count - 1))))]

    channel = ScriptedChannel(answer)
    link = Link(ScriptedEndpoint([channel]), now=channel.now)
    reader = DoubleReader(link, default_memory_map(), ChannelClock(channel), PERIOD_S)
    with pytest.raises(LinkError, match=r"block of 34 bytes from FC20, asked for 35"):
        reader.read((1, 2, 3))


@pytest.mark.parametrize(("addresses", "longest", "found"), [([1, 3], 3, 1), ([1, 4], 3, 2), ([5, 1, 2, 9, 6], 2, 3)])
def test_a_span_reaches_as_far_as_one_request(addresses: list[int], longest: int, found: int) -> None:
    assert len(spans(addresses, longest)) == found


@pytest.mark.parametrize(("position", "error", "set_point"), [(4090, 20, 999), (10, -30, 0), (4000, 95, 999)])
def test_a_set_point_beyond_the_range_is_shown_as_its_end(position: int, error: int, set_point: int) -> None:
    reader, _, channel = reader_of(MemoryBoard(lambda _: [(position, error, 0)] * 6))
    channel.time = 2.5 * PERIOD_S
    joints = reader.read((1,))
    assert joints is not None
    assert joints[0][1].set_point == set_point


# ---- What the host's own memory map leaves out is never asked for, even of a bridge that would carry it out

MOCK = "mock://?lock_step=1&seed=1"
"""Its bridge works by the map that ships, which has everything."""
GAINS, SIGNALS = ("gain_p", "gain_i", "gain_d"), ("process_outputs", "gripper")


def without(*absent: str) -> MemoryMap:
    whole = default_memory_map()
    kept = {name: register for name, register in whole.registers.items() if name not in absent}
    return MemoryMap.model_validate(dict(whole) | {"registers": kept})


@pytest.fixture
def bridge_with_everything() -> Iterator[Controller]:
    with Controller.connect(MOCK, without(*GAINS, *SIGNALS)) as controller:
        yield controller


ORDERS: dict[str, Callable[[Controller], object]] = {
    "SetGains": lambda controller: controller.set_gains(1, 7, 3, 1),
    "ReadProcess": Controller.process,
    "WriteOutputs": lambda controller: controller.write_outputs(0xFF, 0xA5),
    "SetGripper": lambda controller: controller.set_gripper(closed=True),
}


@pytest.mark.parametrize("request_name", ORDERS)
def test_what_the_map_leaves_out_is_refused_unsent(bridge_with_everything: Controller, request_name: str) -> None:
    controller = bridge_with_everything
    control = controller.link.control
    assert control is not None
    before, sent = told_by(control, "state"), controller.counters.numbers()
    with pytest.raises(RequestRefusedError, match=f"{request_name}: the memory map lacks .* not sent") as refused:
        ORDERS[request_name](controller)
    assert refused.value.reason == Refusal.NOT_CAPABLE
    after = told_by(control, "state")
    assert (after, controller.counters.numbers()) == (before, sent)


def test_gains_that_the_map_leaves_out_are_not_known_the_gripper_is(bridge_with_everything: Controller) -> None:
    sent = bridge_with_everything.counters.numbers()
    assert bridge_with_everything.gains() == {}
    assert bridge_with_everything.counters.numbers() == sent
    with Controller.connect(MOCK, without(*GAINS)) as controller:
        controller.set_gripper(closed=True)
        assert controller.process().gripper == 1
        with pytest.raises(RequestRefusedError):
            controller.set_gains(1, 7, 3, 1)
