"""Sessions: nothing recorded is ever new again, whatever wraps; time in lock-step has an order of its own."""

from collections.abc import Iterator
from itertools import count

from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol import commands as c
from firmware_protocol.dialect import FramedDialect
from firmware_protocol.framing import HEADER, FrameDecoder, encode_frame, unstuff
from firmware_protocol.message import Stamp
from firmware_protocol.session import UNSTAMPED, AdvanceOrder, Arrival, Session, stamp_of, to_frame

starts = st.integers(0, 0xFFFF)
numbers = st.integers(1, 0xFFFFFFFF)
nonces = st.integers(0, 0xFFFFFFFF)


def greeted(nonce: int = 5, number: int = 100) -> Session:
    session = Session()
    assert session.greet(nonce, lambda: number)
    return session


# ---- the bridge's half


@given(numbers, numbers)
def test_a_command_behind_a_later_one_is_stale_however_far(one: int, other: int) -> None:
    session = greeted()
    earlier, later = sorted((one, other))
    assert session.judge(Stamp(100, later)) is Arrival.NEW
    assert session.judge(Stamp(100, earlier)) is (Arrival.NEW if one == other else Arrival.STALE)
    assert session.judge(Stamp(100, later)) is Arrival.NEW, "a repeat is carried out again"


@given(numbers, st.integers(0, 0xFFFFFFFF))
def test_a_command_of_another_session_is_refused_and_moves_nothing(number: int, session_number: int) -> None:
    session = greeted()
    if session_number != 100:
        assert session.judge(Stamp(session_number, number)) is Arrival.FOREIGN
    assert session.judge(UNSTAMPED) is Arrival.FOREIGN
    assert session.judge(Stamp(100, 1)) is Arrival.NEW


def test_before_the_first_greeting_and_after_the_end_there_is_no_session() -> None:
    session = Session()
    assert session.judge(UNSTAMPED) is Arrival.FOREIGN
    assert session.judge(Stamp(0, 7)) is Arrival.FOREIGN
    session = greeted()
    session.end()
    assert session.judge(Stamp(100, 1)) is Arrival.FOREIGN
    assert session.greet(5, lambda: 101), "its nonce is no repeat any more"


@given(nonces, nonces, numbers)
def test_a_repeated_greeting_changes_nothing_and_another_begins_anew(one: int, other: int, number: int) -> None:
    fresh = count(1)
    session = Session()
    assert session.greet(one, lambda: next(fresh))
    session.judge(Stamp(1, number))
    assert not session.greet(one, lambda: next(fresh))
    assert session.judge(Stamp(1, number - 1)) is (Arrival.STALE)
    if one != other:
        assert session.greet(other, lambda: next(fresh))
        assert session.judge(Stamp(1, number)) is Arrival.FOREIGN
        assert session.judge(Stamp(2, 1)) is Arrival.NEW


@given(st.lists(st.tuples(st.sampled_from(["greet", "command", "replay", "end"]), st.integers(0, 50)), max_size=60))
def test_what_was_recorded_is_obeyed_only_as_a_repeat_of_the_newest_command(steps: list[tuple[str, int]]) -> None:
    fresh, nonce = count(1), count(1)
    session = Session()
    number, obeyed = 0, UNSTAMPED
    recorded: list[Stamp] = []
    for step, choice in steps:
        match step:
            case "greet":
                session.greet(next(nonce), lambda: next(fresh))
                number = 0
            case "end":
                session.end()
            case "command":
                number += 1 + choice
                stamp = Stamp(session.number, number)
                recorded.append(stamp)
                if session.judge(stamp) is Arrival.NEW:
                    obeyed = stamp
            case "replay" if recorded:
                stamp = recorded[choice % len(recorded)]
                assert session.judge(stamp) is not Arrival.NEW or stamp == obeyed


# ---- the host's half


def conversation(dialect: FramedDialect, nonce: int, session: int) -> None:
    """A greeting and its answer."""
    dialect.encode(0, c.Hello(2, nonce))
    dialect.feed(encode_frame(to_frame(0, c.HelloReply(2, 0, 20_000, 0, 1, nonce, session))))


def stamps(dialect: FramedDialect) -> Iterator[Stamp]:
    while True:
        (frame,) = FrameDecoder().feed(dialect.encode(0, c.SetGripper(1)))
        yield stamp_of(frame)


def test_commands_are_stamped_and_counted_and_none_becomes_new_again() -> None:
    # Commands are stamped with the session and counted in it
    dialect = FramedDialect()
    stamped = stamps(dialect)
    assert next(stamped) == UNSTAMPED
    conversation(dialect, 7, 70)
    assert [next(stamped) for _ in range(3)] == [Stamp(70, 1), Stamp(70, 2), Stamp(70, 3)]
    dialect.encode(5, c.ReadStatus())
    assert next(stamped) == Stamp(70, 4)
    conversation(dialect, 8, 71)
    assert next(stamped) == Stamp(71, 1)
    conversation(dialect, 8, 71)
    assert next(stamped) == Stamp(71, 2), "a repeated greeting begins nothing"
    dialect.reset()
    assert next(stamped) == UNSTAMPED, "a new connection has no session"
    # All sequence numbers come round and no command becomes new again
    dialect, session = FramedDialect(), greeted(number=70)
    conversation(dialect, 7, 70)
    request, commands = c.SetGripper(1), []
    for sequence in range(0x10000):
        line = dialect.encode(sequence, request)
        commands.append(line)
        assert session.judge(stamp_in(line)) is Arrival.NEW
    for sequence, recorded in enumerate(commands[::509]):
        assert session.judge(stamp_in(recorded)) is Arrival.STALE
        assert session.judge(stamp_in(dialect.encode(sequence, request))) is Arrival.NEW


def stamp_in(line: bytes) -> Stamp:
    """Read from the line's bytes, without the CRC that other tests check."""
    return Stamp.parse(unstuff(line[1:-1])[HEADER:])


def test_an_answer_of_before_begins_no_session() -> None:
    dialect = FramedDialect()
    conversation(dialect, 7, 70)
    for nonce, session in ((6, 60), (7, 61)):
        dialect.feed(encode_frame(to_frame(0, c.HelloReply(2, 0, 20_000, 0, 1, nonce, session))))
        assert next(stamps(dialect)).session == 70
    dialect = FramedDialect()
    dialect.encode(0, c.Hello(2, 7))
    dialect.reset()
    dialect.feed(encode_frame(to_frame(0, c.HelloReply(2, 0, 20_000, 0, 1, 7, 70))))
    assert next(stamps(dialect)) == UNSTAMPED
    dialect = FramedDialect()
    line = encode_frame(to_frame(3, c.HelloReply(2, 0, 20_000, 0, 1, 7, 70)))
    dialect.feed(b"x" * 100 + b"\0" + line[:8])
    dialect.reset()
    assert dialect.feed(line[8:]) == []
    assert dialect.feed(line) == [(3, c.HelloReply(2, 0, 20_000, 0, 1, 7, 70))]
    assert dialect.damaged == 2, "one piece too long to be a frame, and the rest of the one that was forgotten"


# ---- lock-step


@given(starts, st.integers(1, 100))
def test_a_late_advance_lets_no_time_pass_and_a_repeat_is_answered(start: int, later: int) -> None:
    order = AdvanceOrder()
    assert order.judge(start, c.Advance(1)) is Arrival.NEW
    assert order.judge((start + later) & 0xFFFF, c.Advance(20_000)) is Arrival.NEW
    assert order.judge((start + later) & 0xFFFF, c.Advance(20_000)) is Arrival.AGAIN
    assert order.judge(start, c.Advance(1)) is Arrival.STALE
    assert order.judge(start, c.Hello(2, 1)) is Arrival.NEW
    assert order.judge(start, c.Advance(1)) is Arrival.NEW, "a greeting forgets"


@given(starts, st.integers(0, 200_000), st.integers(50, 10_000))
def test_however_many_other_requests_come_between_the_next_advance_is_new(start: int, reads: int, stride: int) -> None:
    order = AdvanceOrder()
    order.judge(start & 0xFFFF, c.Advance(1))
    for sequence in range(start, start + reads, stride):
        assert order.judge(sequence & 0xFFFF, c.ReadStatus()) is Arrival.NEW
    assert order.judge((start + reads + 1) & 0xFFFF, c.Advance(1)) is Arrival.NEW


@given(starts)
def test_the_question_for_the_time_lets_none_pass_and_moves_nothing(start: int) -> None:
    order = AdvanceOrder()
    assert order.judge(start, c.Advance(0)) is Arrival.AGAIN
    assert order.judge(start, c.Advance(1)) is Arrival.NEW
    assert order.judge((start + 5) & 0xFFFF, c.Advance(0)) is Arrival.AGAIN
    assert order.judge((start + 1) & 0xFFFF, c.Advance(1)) is Arrival.NEW


@given(starts)
def test_half_of_the_circle_is_ahead_and_the_other_half_behind(start: int) -> None:
    for ahead, judged in (
        (1, Arrival.NEW),
        (0x8000, Arrival.NEW),
        (0x8001, Arrival.STALE),
        (0xFFFF, Arrival.STALE),
    ):
        order = AdvanceOrder()
        order.judge(start, c.Advance(1))
        assert order.judge((start + ahead) & 0xFFFF, c.Advance(1)) is judged


@given(starts)
def test_a_request_far_ahead_takes_the_last_advance_along_and_one_far_behind_does_not(start: int) -> None:
    """After a request a third of the circle ahead, an advance two thirds ahead is new; without it, it would be old."""
    for between, judged in ((0x5555, Arrival.NEW), (0xAAAA, Arrival.STALE)):
        order = AdvanceOrder()
        order.judge(start, c.Advance(1))
        assert order.judge((start + between) & 0xFFFF, c.ReadStatus()) is Arrival.NEW
        assert order.judge((start + 0x9000) & 0xFFFF, c.Advance(1)) is judged


@given(starts)
def test_the_last_advance_lags_behind_by_the_window_at_most(start: int) -> None:
    """By 16384, as the protocol says."""
    for ahead, judged in ((16384, Arrival.AGAIN), (16385, Arrival.STALE)):
        order = AdvanceOrder()
        order.judge(start, c.Advance(1))
        order.judge((start + ahead) & 0xFFFF, c.ReadStatus())
        assert order.judge(start, c.Advance(1)) is judged
