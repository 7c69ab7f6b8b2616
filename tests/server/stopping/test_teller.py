"""The service learns of every stop, also of those while it did not read."""

from __future__ import annotations

import logging
import os
from datetime import UTC, datetime

import pytest

from server.stopping.messages import NEWS, Stopped
from server.stopping.process import Teller


def stop(number: int) -> Stopped:
    """Returns the news of a stop, with as long a text as one can have."""
    return Stopped(
        robot="ma2000",
        text=f"{number} " + "x" * 300,
        confirmed=True,
        actor="anna",
        role="viewer",
        origin="10.0.0.7",
        address="/api/v1/robots/ma2000/stop",
        at=datetime.now(UTC),
    )


def test_stops_while_the_service_is_suspended_are_told_when_it_reads_again() -> None:
    reads, writes = os.pipe()
    teller = Teller(writes)
    for number in range(500):  # several times what the pipe holds
        teller.tell(stop(number))
    with os.fdopen(reads, "rb") as lines:
        for number in range(500):
            news = NEWS.validate_json(lines.readline())
            assert isinstance(news, Stopped)
            assert news.text.startswith(f"{number} ")
        teller.close(60)
    os.close(writes)


def test_stops_that_the_service_can_no_longer_read_are_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    reads, writes = os.pipe()
    os.close(reads)
    with caplog.at_level(logging.ERROR, "server.stop"):
        teller = Teller(writes, most_waiting=2)
        teller.tell(stop(1))
        teller.close(60)
    os.close(writes)
    assert any("only here" in record.message and '"text":"1 ' in record.message for record in caplog.records)
