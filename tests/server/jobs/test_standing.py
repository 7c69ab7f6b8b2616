"""A job that gets no processor is told from one that computes for long."""

from daq.contracts.processor import ProcessorTime
from server.jobs.mailbox import Reported
from server.jobs.service import ASKED_AFTER, Standing

BEGUN = ProcessorTime(0.0, 0.0)
STARVED, BUSY = ProcessorTime(0.1, 9.0), ProcessorTime(9.0, 0.1)
NEWS = Reported(0.3, "fitting", 12)


def test_it_waits_once_its_news_are_old_and_only_while_it_gets_no_processor() -> None:
    standing = Standing(None, 0.0, BEGUN)
    standing.look(None, ASKED_AFTER - 0.1, STARVED)
    assert not standing.waits
    standing.look(None, ASKED_AFTER, STARVED)
    assert standing.waits, "also before its first news: it cannot even start"
    standing.look(NEWS, ASKED_AFTER + 1.0, STARVED)
    assert not standing.waits
    standing.look(NEWS, 3 * ASKED_AFTER, ProcessorTime(9.1, 9.1))
    assert not standing.waits, "it computes"


def test_without_the_kernels_count_nothing_is_claimed() -> None:
    standing = Standing(None, 0.0, None)
    standing.look(None, 100.0, None)
    standing.look(None, 200.0, None)
    assert not standing.waits


def test_a_worker_that_is_replaced_is_judged_anew() -> None:
    standing = Standing(NEWS, 0.0, BUSY)
    standing.look(NEWS, 5.0, None)
    standing.look(NEWS, 6.0, STARVED)
    assert (standing.since, standing.begun) == (6.0, STARVED)
