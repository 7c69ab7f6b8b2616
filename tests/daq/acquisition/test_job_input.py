"""The first line is the job; what follows it is a stop."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from daq.acquisition.job_input import read_job
from daq.contracts.errors import SpecError
from daq.runner.arm_control import StoppedError
from tests.daq.acquisition.jobs import job, text_of


@contextmanager
def pipe_with(data: bytes) -> Iterator[int]:
    reader, writer = os.pipe()
    os.write(writer, data)
    os.close(writer)
    yield reader
    os.close(reader)


def test_a_job_comes_through_as_it_was(tmp_path: Path) -> None:
    sent = job(tmp_path)
    with pipe_with(text_of(sent).encode() + b"\n") as descriptor:
        assert read_job(descriptor) == sent


def test_a_stop_that_came_with_the_job_counts(tmp_path: Path) -> None:
    with pipe_with(text_of(job(tmp_path)).encode() + b"\nstop\n") as descriptor, pytest.raises(StoppedError):
        read_job(descriptor)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "ended before the job was complete"),
        (b'{"url": ', "ended before the job was complete"),
        (b"\n", "text: Invalid JSON"),
        (b"not JSON\n", "text: Invalid JSON"),
        (b'{"url": 3}\n', "url: Input should be a valid string"),
        (b"[]\n", "text: Input should be"),
    ],
)
def test_what_is_no_job_is_refused_in_one_line(data: bytes, words: str) -> None:
    with pipe_with(data) as descriptor, pytest.raises(SpecError, match=words) as caught:
        read_job(descriptor)
    assert str(caught.value).startswith("job: ")
    assert "\n" not in str(caught.value)
