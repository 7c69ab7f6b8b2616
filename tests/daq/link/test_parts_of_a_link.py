"""The parts of a link: dialects, times of replies, what is counted, and turns in lock-step."""

import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.link import LinkLostError, LinkTimeoutError, dialects
from daq.link.counters import RoundTrips, Tally
from daq.link.dialects import dialect_of
from daq.link.timing import RETRIES, LinkTiming
from daq.link.turn_exchange import MarkCounter
from daq.plugins import Plugin
from daq.transport import MockPort, SerialPort, parse_port_url
from daq.transport.url import PortUrlError
from firmware_protocol.commands import Advance, Advanced, Hello, ReadStatus, Sample, Status, Stop, Stopped
from firmware_protocol.dialect import IDLE_MARK, FramedDialect
from firmware_protocol.dynamixel.dialect import DynamixelDialect
from firmware_protocol.message import Request
from firmware_protocol.scale import LineScale
from tests.daq.link.scripted import frame_of, once_silent, says, scripted_link

MINE = """
from firmware_protocol.dialect import FramedDialect
from firmware_protocol.scale import LineScale

class Mine(FramedDialect):
    def __init__(self, ids):
        super().__init__()
        self.scale = LineScale(joints=len(ids))
"""


def test_a_url_names_the_dialect_and_its_options() -> None:
    assert isinstance(dialect_of("serial:///dev/ttyUSB0"), FramedDialect)
    assert dialect_of("mock://").scale == LineScale()
    url = "serial:///dev/ttyUSB0?baud=1000000&dialect=dynamixel&ids=5,3"
    assert parse_port_url(url) == SerialPort("/dev/ttyUSB0", 1000000, "dynamixel", (5, 3))
    dialect = dialect_of(url)
    assert isinstance(dialect, DynamixelDialect)
    assert (dialect.scale.joints, dialect.scale.set_point_units) == (2, 4096)
    port = parse_port_url("mock://?dialect=dynamixel&ids=1,2&load=0.2&baud=57600")
    assert port == MockPort(("--ids=1,2", "--load=0.2", "--torque"), 57600, dialect="dynamixel", ids=(1, 2))


def installed(folder: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    (folder / "mine_of_a_lab.py").write_text(text)
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.delitem(sys.modules, "mine_of_a_lab", raising=False)
    monkeypatch.setattr(dialects, "plugins", lambda: (Plugin(dialects={"mine": "mine_of_a_lab:Mine"}),))


def test_another_package_brings_its_own_dialect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed(tmp_path, monkeypatch, MINE)
    assert dialect_of("tcp://arm:4000?dialect=mine&ids=7,8,9").scale.joints == 3


REFUSING = "\n        from firmware_protocol.errors import ProtocolError\n        raise ProtocolError('ids: two')\n"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("import nothing_of_this_name", "dialect 'mine' (mine_of_a_lab:Mine): ModuleNotFoundError: No module named"),
        ("class Yours: pass", "dialect 'mine' (mine_of_a_lab:Mine): AttributeError: "),
        (MINE + REFUSING, "port 'tcp://arm:4000?dialect=mine': ids: two"),
    ],
    ids=["needs what is not there", "has another name", "refuses its numbers"],
)
def test_a_dialect_of_another_package_that_fails_gets_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, line: str
) -> None:
    installed(tmp_path, monkeypatch, text)
    with pytest.raises(PortUrlError) as error:
        dialect_of("tcp://arm:4000?dialect=mine")
    assert line in str(error.value)


@pytest.mark.parametrize(
    ("url", "line"),
    [
        ("tcp://arm:1?dialect=nobodys", "dialect 'nobodys' is unknown: dynamixel, framed"),
        ("tcp://arm:1?dialect=dynamixel", "needs the servos' IDs in the order of the joints, as in ids=1,2"),
        ("tcp://arm:1?dialect=dynamixel&ids=1,x", "ids '1,x': write whole numbers in the order of the joints"),
        ("tcp://arm:1?dialect=dynamixel&ids=1,1", "1 to 6 different ones from 0 to 252"),
        ("tcp://arm:1?dialect=dynamixel&ids=1,253", "1 to 6 different ones from 0 to 252"),
        ("mock://?dialect=dynamixel&ids=1,2&fault=flip", "unknown option 'fault'"),
    ],
)
def test_a_wrong_name_or_number_gets_one_line(url: str, line: str) -> None:
    with pytest.raises(PortUrlError) as error:
        dialect_of(url)
    assert line in str(error.value)


# ---- How long a reply may take, and how often a request is repeated: the numbers themselves

LINE = LinkTiming(bytes_per_second=11520.0, period_s=0.03)
FULL_FRAMES = 2 * 57


@pytest.mark.parametrize(
    ("request_", "beyond_the_line"), [(ReadStatus(), 0.025), (Stop(), 0.010), (Sample(7, 1), 0.025 + 0.03)]
)
def test_a_reply_may_take_its_time_on_the_line_and_a_margin_and_a_sample_a_period_more(
    request_: Request, beyond_the_line: float
) -> None:
    assert LINE.reply_timeout_s(request_, 100) == pytest.approx((100 + FULL_FRAMES) / 11520 + beyond_the_line)
    assert LinkTiming(float("inf"), 0.03).reply_timeout_s(request_, 100) == pytest.approx(beyond_the_line)


def test_times_of_replies_and_repeats_leave_room_for_a_shared_wire_and_a_stop() -> None:
    assert [LINE.retries_of(request) for request in (ReadStatus(), Hello(2, 1), Stop())] == [8, 40, 50]
    patient = LinkTiming(11520.0, retries=60)
    assert [patient.retries_of(request) for request in (ReadStatus(), Hello(2, 1), Stop())] == [60, 60, 50]
    assert LinkTiming(11520.0).period_s == 0.020
    shared = LineScale(turn_bytes=400, greeting_bytes=1000, half_duplex=True)
    line = LinkTiming(5760.0)
    assert line.shared_wire_s(ReadStatus(), shared) == pytest.approx(400 / 5760)
    assert line.shared_wire_s(Hello(2, 1), shared) == pytest.approx(1000 / 5760)
    assert line.shared_wire_s(Hello(2, 1), LineScale(turn_bytes=400)) == 0.0
    assert line.reply_timeout_s(Stop(), 30) + line.shared_wire_s(Stop(), shared) > 0.020


# ---- What is counted from a mark on, beside what is counted from the beginning


def test_a_trace_counts_what_happened_while_it_was_recorded() -> None:
    tally = Tally()
    tally.count("retries", 67)
    for _ in range(100):
        tally.round_trip(0.05)
    begun = tally.mark(damaged=3)
    assert tally.snapshot(3, begun).round_trips == RoundTrips()
    tally.count("retries", 2)
    for _ in range(10):
        tally.round_trip(0.002)
    found = tally.snapshot(4, begun)
    assert (found.retries, found.damaged, found.round_trips.count) == (2, 1, 10)
    assert found.round_trips.mean_s == pytest.approx(0.002)
    assert found.round_trips.p99_s == found.round_trips.max_s == pytest.approx(0.002, rel=0.1)
    whole = tally.snapshot(4)
    assert (whole.retries, whole.damaged, whole.round_trips.count) == (69, 4, 110)
    assert whole.round_trips.max_s == 0.05


def trips(*seconds: float) -> RoundTrips:
    """The round trips of a link that has had these."""
    tally = Tally()
    for each in seconds:
        tally.round_trip(each)
    return tally.snapshot(damaged=0).round_trips


def test_half_of_the_round_trips_are_no_longer_than_the_median_and_one_in_a_hundred_than_p99() -> None:
    found = trips(*[0.001] * 50, *[0.010] * 49, 0.1)
    assert found.count == 100
    assert found.p50_s == pytest.approx(0.001, rel=0.1)
    assert found.p99_s == pytest.approx(0.010, rel=0.1)
    assert found.max_s == 0.1
    assert found.mean_s == pytest.approx((0.05 + 0.49 + 0.1) / 100)
    assert trips(*[0.001] * 49, *[0.010] * 51).p50_s == pytest.approx(0.010, rel=0.1)
    tally = Tally()
    tally.round_trip(3.0)
    assert tally.snapshot(damaged=0).round_trips == RoundTrips(1, 3.0, 3.0, 3.0, 3.0)


# ---- Turns in lock-step: what the idle mark ends, what a time-out costs, however bytes are cut

STATUS = Status(7, 0, 1, 0, 0)


def test_a_reply_missing_at_the_mark_has_timed_out_and_the_board_is_given_the_time_of_the_wait() -> None:
    lost = iter([True])

    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        if isinstance(request, Advance):
            return [(0.0, frame_of(sequence, Advanced(0, 0)))]
        return [] if next(lost, False) else [(0.0, frame_of(sequence, STATUS))]

    link, channel = scripted_link(answer, lock_step=True)
    assert link.request(ReadStatus(), Status) == STATUS
    assert [type(request) for _, request in channel.asked] == [ReadStatus, Advance, ReadStatus]
    advance = channel.asked[1][1]
    assert isinstance(advance, Advance)
    assert advance.microseconds == pytest.approx(25_000 + 114 / 11520 * 1e6, abs=1)
    assert channel.asked[0][0] == channel.asked[2][0]
    assert channel.time == 0.0, "no clock of this machine decides anything"
    assert link.counters.round_trips.count == 0


def test_silence_ends_a_turn_or_uses_up_the_budget_at_once() -> None:
    # A controller that never answers uses up the budget at once
    link, channel = scripted_link(lambda _sequence, _request: [], lock_step=True)
    with pytest.raises(LinkTimeoutError, match=rf"asked {RETRIES + 1} times"):
        link.request(ReadStatus(), Status)
    assert sum(isinstance(request, Advance) for _, request in channel.asked) == RETRIES
    # Silence in the middle of a turn is a dead process
    link, channel = scripted_link(lambda _sequence, _request: [], lock_step=True)
    channel.marks = False
    with pytest.raises(LinkLostError, match=r"silent for 10\.0 s in the middle of a turn"):
        link.request(ReadStatus(), Status)
    # A stop is two frames and ends with two marks
    stopped = Stopped(7, (500,) * 6)

    link, channel = scripted_link(
        says(lambda request: stopped if isinstance(request, Stop) else STATUS), lock_step=True
    )
    assert link.stop() == stopped
    assert link.request(ReadStatus(), Status) == STATUS
    assert [type(request) for _, request in channel.asked] == [Stop, Stop, ReadStatus]
    assert link.counters.timeouts == 0
    # A newer Advance before it would make it stale
    link, channel = scripted_link(once_silent(Advanced(20_000, 1)), lock_step=True)
    assert link.request(Advance(20_000), Advanced) == Advanced(20_000, 1)
    assert channel.asked == [(0, Advance(20_000))] * 2


@given(
    turns=st.lists(st.lists(st.integers(0, 65535), max_size=3), min_size=1, max_size=8),
    cuts=st.lists(st.integers(1, 7), min_size=1, max_size=200),
)
def test_marks_are_counted_however_the_bytes_are_cut(turns: list[list[int]], cuts: list[int]) -> None:
    stream = b"".join(b"".join(frame_of(number, STATUS) for number in turn) + IDLE_MARK for turn in turns)
    marks = MarkCounter()
    position = index = 0
    while position < len(stream):
        size = cuts[index % len(cuts)]
        marks.feed(stream[position : position + size])
        position, index = position + size, index + 1
    assert marks.seen == len(turns)
