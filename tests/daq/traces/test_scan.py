"""A walk through a file: limits that are met to the byte, checksums, and what may come once only."""

from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.opcode import Opcode

from daq.contracts.errors import TraceError
from daq.contracts.trace_limits import TraceLimits
from daq.traces.reader import read_trace
from daq.traces.scan import scan
from tests.daq.traces.damaged_traces import HEAD, JOINTS, originals, records


@pytest.fixture(scope="module")
def data() -> bytes:
    """A finished trace with attachments."""
    (found,) = (one.data for one in originals() if one.kind == "finished")
    return found


def bodies(data: bytes, opcode: int) -> list[bytes]:
    """Content of every record of a kind."""
    return [data[begin + HEAD : end] for found, begin, end in records(data) if found == opcode]


LARGEST: dict[str, Callable[[bytes], int]] = {
    "file_bytes": len,
    "records": lambda data: sum(
        len(list(records(part))) for part in (data, *(bytes(8) + c for c in scan(data, "").chunks))
    ),
    "chunk_bytes": lambda data: max(map(len, scan(data, "").chunks)),
    "total_bytes": lambda data: sum(map(len, scan(data, "").chunks)),
    "metadata_bytes": lambda data: max(map(len, bodies(data, Opcode.METADATA))),
    "attachments": lambda data: len(bodies(data, Opcode.ATTACHMENT)),
    "attachment_bytes": lambda data: sum(map(len, bodies(data, Opcode.ATTACHMENT))),
    "events": lambda _: 1,
    "joints": lambda _: len(JOINTS),
}
"""How much of everything a file holds."""


@pytest.mark.parametrize("name", LARGEST)
def test_a_file_that_holds_as_much_as_is_allowed_is_read_and_one_that_holds_one_more_is_not(
    tmp_path: Path, data: bytes, name: str
) -> None:
    path, most = tmp_path / "a.mcap", LARGEST[name](data)
    path.write_bytes(data)
    assert read_trace(path, TraceLimits(**{name: most})).record.outcome == "complete"
    with pytest.raises(TraceError, match=rf"\(traces\.limits\.{name}\)"):
        read_trace(path, TraceLimits(**{name: most - 1}))


def changed(data: bytes, opcode: int, offset: int, value: bytes) -> bytes:
    """The file with other bytes in the last record of a kind; negative offsets count from the record's end."""
    begin, end = [(begin + HEAD, end) for found, begin, end in records(data) if found == opcode][-1]
    at = (begin if offset >= 0 else end) + offset
    return data[:at] + value + data[at + len(value) :]


@pytest.mark.parametrize(
    ("opcode", "offset", "says"),
    [
        (Opcode.HEADER, 8, "the data section does not match its checksum"),
        (Opcode.CHUNK_INDEX, 0, "the index does not match its checksum"),
        (Opcode.STATISTICS, 0, "the index does not match its checksum"),
        (Opcode.FOOTER, -1, "the index does not match its checksum"),
        (Opcode.ATTACHMENT, -5, "an attachment does not match its checksum"),
    ],
)
def test_a_changed_byte_is_damage_by_the_checksum_over_it(data: bytes, opcode: int, offset: int, says: str) -> None:
    assert scan(data, "a").damage is None
    assert scan(changed(data, opcode, offset, b"\xee"), "a").damage == f"a record cannot be read ({says})"


def test_a_checksum_of_zero_was_not_formed_and_is_not_held_against_the_file(data: bytes) -> None:
    plain = changed(data, Opcode.FOOTER, -4, bytes(4))
    assert scan(plain, "a").damage is None
    assert scan(changed(plain, Opcode.CHUNK_INDEX, 0, b"\xee"), "a").damage is None


def test_metadata_of_one_name_come_once(data: bytes) -> None:
    begin, end = next((begin, end) for opcode, begin, end in records(data) if opcode == Opcode.METADATA)
    twice = scan(data[:end] + data[begin:end] + data[end:], "a")
    assert twice.damage == "a record cannot be read (the metadata 'daq.record' come twice)"
    assert (twice.good_bytes, len(twice.metadata)) == (end, 1)


@pytest.mark.parametrize(("opcode", "kind", "name_at"), [(Opcode.SCHEMA, "schema", 6), (Opcode.CHANNEL, "channel", 8)])
def test_a_definition_may_be_repeated_and_not_changed(data: bytes, opcode: int, kind: str, name_at: int) -> None:
    begin, end = next((begin, end) for found, begin, end in records(data) if found == opcode)
    again = data[begin:end]
    assert scan(data[:end] + again, "a").damage == "it ends before its last record"
    place = HEAD + name_at
    other = again[:place] + b"x" + again[place + 1 :]
    assert f"{kind} 1 is defined twice, and differently" in (scan(data[:end] + other, "a").damage or "")
