"""The beginning and the end of a finished file are found without reading what lies between."""

from pathlib import Path

import pytest

from daq.contracts.errors import TraceError
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces.ends import first_metadata, indexed_metadata
from daq.traces.layout import END_METADATA, START_METADATA
from daq.traces.scan import UNREADABLE, scan
from tests.daq.traces.samples import write


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A finished trace."""
    return write(tmp_path / "a.mcap", notes="warm")


def test_the_index_of_a_finished_trace_leads_to_both_its_metadata(path: Path) -> None:
    with path.open("rb") as stream:
        found = indexed_metadata(stream, DEFAULT_TRACE_LIMITS)
    assert found == scan(path.read_bytes(), "a").metadata
    assert found.keys() == {START_METADATA, END_METADATA}
    assert found[END_METADATA]["samples"] == "100"


def test_a_file_without_an_end_has_no_index(path: Path) -> None:
    data = path.read_bytes()
    for kept in (0, 8, 20, 36, len(data) // 2, len(data) - 1):
        path.write_bytes(data[:kept])
        with path.open("rb") as stream, pytest.raises(UNREADABLE):
            indexed_metadata(stream, DEFAULT_TRACE_LIMITS)


def test_a_changed_byte_of_the_index_is_noticed(path: Path) -> None:
    data = path.read_bytes()
    place = data.rindex(END_METADATA.encode())  # in the index, behind the record itself
    path.write_bytes(data[:place] + b"D" + data[place + 1 :])
    with path.open("rb") as stream, pytest.raises(ValueError, match="does not match its checksum"):
        indexed_metadata(stream, DEFAULT_TRACE_LIMITS)


def test_the_first_metadata_are_those_of_the_start(path: Path) -> None:
    with path.open("rb") as stream:
        name, metadata = first_metadata(stream, DEFAULT_TRACE_LIMITS, "a")
    assert (name, metadata) == (START_METADATA, scan(path.read_bytes(), "a").metadata[START_METADATA])


def test_metadata_larger_than_allowed_are_not_read(path: Path) -> None:
    few = TraceLimits(metadata_bytes=100)
    with path.open("rb") as stream, pytest.raises(ValueError, match="more than 100 bytes"):
        indexed_metadata(stream, few)
    with path.open("rb") as stream, pytest.raises(TraceError, match="ends or is damaged before its first metadata"):
        first_metadata(stream, few, "a")
