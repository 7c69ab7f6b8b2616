"""Reports never hold up a run."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from daq.owner import speaker as module
from daq.owner.messages import REPORT, Answer
from daq.owner.speaker import Speaker

END = Answer(number=1, problem="the end", exit_code=5)


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    """Its two ends; the tests close the one that is read."""
    reader, writer = os.pipe()
    yield reader, writer
    os.close(writer)


def test_reports_come_out_in_order(pipe: tuple[int, int]) -> None:
    reader, writer = pipe
    with Speaker(writer) as speaker:
        speaker.progress(0.5, "half")
        speaker.ended(END)
    found = [REPORT.validate_json(line) for line in os.read(reader, 65536).splitlines()]
    os.close(reader)
    assert [report.kind for report in found] == ["progress", "answer"]


def test_a_reader_that_does_not_read_costs_reports_not_time(
    pipe: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    reader, writer = pipe
    monkeypatch.setattr(module, "WAITING_REPORTS", 50)
    text = "x" * 10_000
    with Speaker(writer) as speaker:
        for _ in range(200):  # 2 MB: no pipe takes that, nor do 50 waiting reports
            speaker.progress(0.5, text)
        assert speaker.untold > 0
        os.close(reader)


def test_a_reader_that_is_gone_is_no_error(pipe: tuple[int, int]) -> None:
    reader, writer = pipe
    os.close(reader)
    with Speaker(writer) as speaker:
        for _ in range(10):
            speaker.progress(0.5, "unheard")
        speaker.ended(END)
