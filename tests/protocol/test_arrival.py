"""Sequence numbers: a late command never undoes a later one, and a stop is obeyed however late."""

from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.commands import Advance, Arrival, ArrivalOrder, Hello, ReadStatus, Release, Stop, WriteOutputs

starts = st.integers(0, 0xFFFF)


@given(starts, st.integers(1, 32767))
def test_a_command_behind_a_later_one_is_stale(newest: int, behind: int) -> None:
    order = ArrivalOrder()
    assert order.judge(newest, Release()) is Arrival.NEW
    assert order.judge((newest - behind) & 0xFFFF, WriteOutputs(1, 1)) is Arrival.STALE
    assert order.judge(newest, Release()) is Arrival.AGAIN


@given(starts, st.integers(1, 32768))
def test_a_command_ahead_is_new(newest: int, ahead: int) -> None:
    order = ArrivalOrder()
    order.judge(newest, Release())
    assert order.judge((newest + ahead) & 0xFFFF, Release()) is Arrival.NEW


@given(starts, st.integers(1, 32767))
def test_stop_is_obeyed_however_late_and_leaves_the_order_as_it_is(newest: int, behind: int) -> None:
    order = ArrivalOrder()
    order.judge(newest, Release())
    assert order.judge((newest - behind) & 0xFFFF, Stop()) is Arrival.NEW
    assert order.judge((newest - 1) & 0xFFFF, Release()) is Arrival.STALE


@given(starts, starts)
def test_hello_forgets(before: int, after: int) -> None:
    order = ArrivalOrder()
    order.judge(before, Release())
    order.judge(before, Advance(1))
    order.judge(0, Hello())
    assert order.judge(after, Release()) is Arrival.NEW
    assert order.judge(after, Advance(1)) is Arrival.NEW


@given(starts, st.integers(0, 200_000), st.integers(50, 10_000))
def test_however_many_reads_come_between_the_next_command_is_new(start: int, reads: int, stride: int) -> None:
    """Half a circle of reads after a command once made the next one look old: 11 minutes of sampling at 50 Hz."""
    order = ArrivalOrder()
    order.judge(start & 0xFFFF, Release())
    for sequence in range(start, start + reads, stride):
        assert order.judge(sequence & 0xFFFF, ReadStatus()) is Arrival.NEW
    assert order.judge((start + reads + 1) & 0xFFFF, Release()) is Arrival.NEW


@given(starts, st.integers(1, 100))
def test_time_has_an_order_of_its_own(start: int, later: int) -> None:
    """A host in lock-step lets time pass before it repeats a request: the repeat must not be stale for that."""
    order = ArrivalOrder()
    order.judge(start, Release())
    assert order.judge((start + 1 + later) & 0xFFFF, Advance(20_000)) is Arrival.NEW
    assert order.judge((start + 1) & 0xFFFF, WriteOutputs(1, 1)) is Arrival.NEW
    assert order.judge((start + 1 + later) & 0xFFFF, Advance(20_000)) is Arrival.AGAIN
    assert order.judge(start, Advance(20_000)) is Arrival.STALE
