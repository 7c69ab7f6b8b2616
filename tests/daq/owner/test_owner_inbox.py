"""The owner's inbox, through a real pipe: what a newer order does to one that still goes on."""

import os
import select
from collections.abc import Iterator
from contextlib import contextmanager

from daq.owner.guardian import CANCEL
from daq.owner.inbox import Inbox
from daq.owner.messages import Finish, HaltRun, JogBegin, JogDrive, LeadBegin, Order

WITHIN = 60.0
"""s after which a test has failed."""


@contextmanager
def inbox_told(*orders: Order) -> Iterator[tuple[Inbox, int]]:
    """That has read `orders`, and the pipe for more of them."""
    told, tell = os.pipe()
    inbox = Inbox(told)
    try:
        for order in orders:
            _say(tell, order)
        inbox.begin()
        yield inbox, tell
    finally:
        os.close(tell)
        assert inbox.closing.wait(WITHIN)
        os.close(told)


def _say(tell: int, order: Order) -> None:
    os.write(tell, order.model_dump_json().encode() + b"\n")


def _word_to_the_guardian(inbox: Inbox) -> bytes:
    """What it is told; empty for the end of its pipe."""
    ready, _, _ = select.select([inbox.guardian_end], [], [], WITHIN)
    assert ready, "nobody told the guardian anything"
    return os.read(inbox.guardian_end, 100)


def test_what_waited_behind_another_order_ends_with_the_first() -> None:
    with inbox_told(JogBegin(number=1, asked=0.0), LeadBegin(number=2, asked=0.0, joints=(1,))) as (inbox, tell):
        first, second = inbox.take(WITHIN), inbox.take(WITHIN)
        assert first is not None
        assert second is not None
        inbox.done()
        _say(tell, HaltRun())
        assert _word_to_the_guardian(inbox) == CANCEL
    with inbox_told(JogBegin(number=1, asked=0.0), LeadBegin(number=2, asked=0.0, joints=(1,))) as (inbox, _):
        assert inbox.take(WITHIN) is not None
        assert inbox.take(WITHIN) is not None
        inbox.done()
    assert _word_to_the_guardian(inbox) == b""


def test_an_order_that_waits_takes_no_end_back_and_an_overtaken_jog_drives_nothing() -> None:
    # An order that waits does not take back the end of the one before
    drive = JogDrive(velocities={1: 0.1}, said=5.0)
    with inbox_told(JogBegin(number=1, asked=0.0), drive, Finish(), LeadBegin(number=2, asked=0.0, joints=(1,))) as (
        inbox,
        _,
    ):
        assert inbox.take(WITHIN) is not None
        assert inbox.take(WITHIN) is not None
        assert inbox.finish.is_set()
        assert inbox.drive() == drive
    # A jog command that was overtaken drives nothing
    hold, late = JogDrive(velocities={}, said=5.0), JogDrive(velocities={1: 0.1}, said=4.9)
    with inbox_told(JogBegin(number=1, asked=0.0), hold, late, LeadBegin(number=2, asked=0.0, joints=(1,))) as (
        inbox,
        _,
    ):
        assert inbox.take(WITHIN) is not None
        assert inbox.take(WITHIN) is not None
        assert inbox.drive() == hold
        assert inbox.drive() is None
