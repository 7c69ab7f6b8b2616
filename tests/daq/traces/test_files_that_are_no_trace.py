"""A file that is not what it claims gets one line: what, where."""

import io
import json
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import Writer

from daq.contracts.errors import TraceError
from daq.contracts.trace import TRACE_FORMAT
from daq.traces import layout
from daq.traces.reader import read_trace
from daq.traces.scan import scan
from tests.daq.traces.samples import record, write


def foreign(metadata: dict[str, str] | None = None, schema: str = "other", encoding: str = "json") -> bytes:
    """An MCAP file of somebody else, with or without our metadata."""
    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start()
    if metadata is not None:
        writer.add_metadata(layout.START_METADATA, metadata)
    channel = writer.register_channel("/joint/1", encoding, writer.register_schema(schema, "jsonschema", b"{}"))
    writer.add_message(channel, 1, b"{}", 1)
    writer.finish()  # type: ignore[no-untyped-call]
    return stream.getvalue()


def ours(**changes: object) -> dict[str, str]:
    fields = json.loads(record().model_dump_json()) | changes
    return {"record": json.dumps(fields), "joints": "1", "signals": "tick"}


@pytest.mark.parametrize(
    ("data", "complaint"),
    [
        (b"", "is empty"),
        (b"time,position_1\n0,0\n", "is not an MCAP file"),
        (foreign(), "is an MCAP file, but not a trace: it has no metadata 'daq.record'"),
        (foreign(ours(format=TRACE_FORMAT + 1)), f"has format {TRACE_FORMAT + 1} of a newer version"),
        (foreign({"record": "{"}), "its metadata is not that of a trace"),
        (foreign(ours()), "topic /joint/1 has schema 'other'"),
        (foreign(ours(), layout.JOINT_SCHEMA, "cdr"), "a sample does not have 76 bytes"),
    ],
)
def test_one_line_says_what_is_wrong(tmp_path: Path, data: bytes, complaint: str) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(data)
    with pytest.raises(TraceError, match=r"^[^\n]*$") as caught:
        read_trace(path)
    assert str(caught.value).startswith(str(path))
    assert complaint in str(caught.value)


def test_a_file_that_is_not_there_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(TraceError, match=r"a\.mcap: cannot be read: No such file"):
        read_trace(tmp_path / "a.mcap")
    with pytest.raises(TraceError, match="cannot be read: Is a directory"):
        read_trace(tmp_path)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return write(tmp_path_factory.mktemp("traces") / "a.mcap", 30).read_bytes()


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_a_finished_trace_that_was_cut_anywhere_is_refused(
    whole: bytes, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.mktemp("cut") / "a.mcap"
    path.write_bytes(whole[: data.draw(st.integers(0, len(whole) - 1))])
    with pytest.raises(TraceError):
        read_trace(path)


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_a_changed_byte_anywhere_is_noticed(whole: bytes, data: st.DataObject) -> None:
    changed = bytearray(whole)
    changed[data.draw(st.integers(0, len(whole) - 1))] ^= data.draw(st.integers(1, 255))
    try:
        damage = scan(bytes(changed), "a").damage
    except TraceError:
        damage = "its beginning"
    assert damage is not None


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=400))
def test_scanning_raises_nothing_but_its_own_error(tail: bytes) -> None:
    found = scan(bytes.fromhex("894d434150300d0a") + tail, "a")
    assert found.good_bytes <= 8 + len(tail)
    with pytest.raises(TraceError):
        scan(b"x" + tail, "a")
