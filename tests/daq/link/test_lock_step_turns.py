"""Turns in lock-step: what the idle mark ends, what a time-out costs, and that nothing depends on how bytes are cut."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.link import LinkLostError, LinkTimeoutError
from daq.link.timing import RETRIES
from daq.link.turn_exchange import MarkCounter
from firmware_protocol.commands import Advance, Advanced, ReadStatus, Request, Status, Stop, Stopped
from firmware_protocol.dialect import IDLE_MARK
from tests.daq.link.scripted import frame_of, once_silent, says, scripted_link

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


def test_a_controller_that_never_answers_uses_up_the_budget_at_once() -> None:
    link, channel = scripted_link(lambda _sequence, _request: [], lock_step=True)
    with pytest.raises(LinkTimeoutError, match=rf"asked {RETRIES + 1} times"):
        link.request(ReadStatus(), Status)
    assert sum(isinstance(request, Advance) for _, request in channel.asked) == RETRIES


def test_a_stop_is_two_frames_and_ends_with_two_marks() -> None:
    stopped = Stopped(7, (500,) * 6)

    link, channel = scripted_link(
        says(lambda request: stopped if isinstance(request, Stop) else STATUS), lock_step=True
    )
    assert link.stop() == stopped
    assert link.request(ReadStatus(), Status) == STATUS
    assert [type(request) for _, request in channel.asked] == [Stop, Stop, ReadStatus]
    assert link.counters.timeouts == 0


def test_silence_in_the_middle_of_a_turn_is_a_dead_process() -> None:
    link, channel = scripted_link(lambda _sequence, _request: [], lock_step=True)
    channel.marks = False
    with pytest.raises(LinkLostError, match=r"silent for 10\.0 s in the middle of a turn"):
        link.request(ReadStatus(), Status)


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


def test_an_advance_that_was_lost_is_repeated_alone() -> None:
    """A newer Advance before it would make it stale."""
    link, channel = scripted_link(once_silent(Advanced(20_000, 1)), lock_step=True)
    assert link.request(Advance(20_000), Advanced) == Advanced(20_000, 1)
    assert channel.asked == [(0, Advance(20_000))] * 2
