"""Reads the storages of a ROS bag with the libraries of their formats, and reports what a bag announces and lacks.

A channel of another program is never decoded, so its definitions cannot prevent reading the rest.
"""

from __future__ import annotations

import sqlite3
import struct
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import Any

import zstandard
from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, DataEnd, Message, Schema, Statistics
from mcap.stream_reader import CRCValidationError, StreamReader, breakup_chunk
from mcap.writer import MCAP0_MAGIC

from daq.contracts.documents import shown
from daq.contracts.errors import TraceError
from daq.contracts.trace_limits import TraceLimits
from daq.traces import disk
from extras.formats.bags.joint_messages import STATES

METADATA = "metadata.yaml"
LARGEST_MESSAGE = 1 << 20
"""Largest message (bytes) of joint states: for about ten thousand joints."""
ENCODINGS = "json", "protobuf"
"""Encodings of messages, other than ROS's, that are read by the names of their fields."""
JOURNALS = "-wal", "-journal"
SQLITE_MAGIC = b"SQLite format 3\0"
ROS_1_MAGIC = b"#ROSBAG V"
_DAMAGED = (McapError, ValueError, struct.error, zstandard.ZstdError, RuntimeError)
"""Errors of the library mcap, and of its decompressors, for a file that is cut off or damaged."""


@dataclass
class Contents:
    """Topics, and the messages of those with joint states.

    types:    type of the messages on each topic
    messages: time of reception (ns since 1970) and bytes of each message, by topic
    schemas:  definition of the messages on each topic of another encoding
    missing:  one line for each part that the bag announces but lacks
    ros_1:    whether messages have the layout of ROS 1
    """

    types: dict[str, str] = field(default_factory=dict)
    messages: dict[str, list[tuple[int, bytes]]] = field(default_factory=dict)
    schemas: dict[str, tuple[str, bytes]] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)
    ros_1: bool = False

    def topic(self, name: str, kind: str) -> bool:
        """Adds a topic; returns whether its messages are read."""
        self.types.setdefault(name, kind)
        if self.is_read(name):
            self.messages.setdefault(name, [])
        return self.is_read(name)

    def is_read(self, topic: str) -> bool:
        """Whether the messages on a topic contain joints, or fields in another encoding."""
        return self.types.get(topic, "").partition(" in ")[0] in STATES or self.encoding(topic) in ENCODINGS

    def encoding(self, topic: str) -> str:
        """Returns the encoding of the messages on a topic if it is not ROS's."""
        return self.types.get(topic, "").partition(" in ")[2]

    def hold(self, promised: Mapping[str, int], who: str) -> None:
        """Notes the messages that `who` announces on each topic and that have not come."""
        for topic, count in promised.items():
            there = len(self.messages.get(topic, ()))
            if self.is_read(topic) and there < count:
                self.missing.append(f"{who} announces {count} messages on {_text(topic)}, but there are {there}")


def contents(path: Path, limits: TraceLimits) -> Contents:
    """Returns the content of a bag, with times of reception.

    Raises TraceError if a storage is too damaged to know what remains, a limit is exceeded, or a bag is being written;
    OSError; and for a bag of ROS 1 any exception of rosbags.
    """
    found = Contents()
    if path.is_dir():
        _folder(path, found, limits)
    else:
        _file(path, found, limits)
    for messages in found.messages.values():
        messages.sort(key=lambda message: message[0])
        if len(messages) > limits.records:
            raise TraceError(f"{path}: up to {limits.records} messages are read (traces.limits.records)")
    return found


def _folder(path: Path, found: Contents, limits: TraceLimits) -> None:
    about = _about((path / METADATA).read_bytes(), f"{path / METADATA}")
    names, mode = about.get("relative_file_paths"), str(about.get("compression_mode") or "").lower()
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise TraceError(f"{path / METADATA}: names no files (relative_file_paths)")
    topics = _topics(about)
    for name, kind, _ in topics:
        found.topic(name, kind)
    for name in names:
        file = path / PurePath(name).name
        if not file.is_file():
            found.missing.append(f"{METADATA} names {_text(file.name)}, which does not exist")
            continue
        with _plain(file, mode == "file") as plain:
            _file(plain, found, limits)
    if mode == "message":
        for messages in found.messages.values():
            messages[:] = [(received, _inflated(data, path)) for received, data in messages]
    found.hold({topic: count for topic, _, count in topics}, METADATA)


def _about(data: bytes, origin: str) -> dict[str, Any]:
    """Returns rosbag2's description of a bag, from YAML. Raises TraceError."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        read = YAML(typ="safe").load(data.decode("utf-8-sig"))
    except (YAMLError, ValueError, RecursionError) as error:
        raise TraceError(f"{origin}: is not YAML: {shown(str(error))}") from error
    about = read.get("rosbag2_bagfile_information", read) if isinstance(read, dict) else None
    if not isinstance(about, dict):
        raise TraceError(f"{origin}: does not describe a bag (rosbag2_bagfile_information)")
    return about


def _topics(about: dict[str, Any]) -> list[tuple[str, str, int]]:
    """Returns name, type and announced number of messages of each topic; invalid entries are left out."""
    topics = []
    entries = about.get("topics_with_message_count")
    for entry in entries if isinstance(entries, list) else ():
        with suppress(KeyError, TypeError, ValueError):
            said = entry["topic_metadata"]
            topics.append((str(said["name"]), str(said["type"]), int(entry["message_count"])))
    return topics


@contextmanager
def _plain(file: Path, compressed: bool) -> Iterator[Path]:
    """Yields the file as it is, or uncompressed in a folder that is removed."""
    if not compressed:
        yield file
        return
    with TemporaryDirectory() as folder, file.open("rb") as packed:
        plain = Path(folder) / file.stem
        with plain.open("wb") as stream:
            zstandard.ZstdDecompressor().copy_stream(packed, stream)
        yield plain


def _inflated(data: bytes, path: Path) -> bytes:
    with zstandard.ZstdDecompressor().stream_reader(data) as plain:
        found = plain.read(LARGEST_MESSAGE + 1)
    if len(found) > LARGEST_MESSAGE:
        raise TraceError(
            f"{path}: a message has more than {LARGEST_MESSAGE} bytes uncompressed, too many for joint states"
        )
    return found


def _file(file: Path, found: Contents, limits: TraceLimits) -> None:
    with disk.open_regular(file) as stream:
        first = stream.read(16)
    if first.startswith(MCAP0_MAGIC):
        _mcap(file, found, limits)
    elif first == SQLITE_MAGIC:
        _sqlite(file, found, limits)
    elif first.startswith(ROS_1_MAGIC):
        _ros_1(file, found)
    else:
        raise TraceError(f"{file}: is neither MCAP nor SQLite nor a bag of ROS 1, or its beginning is damaged")


def _text(text: str) -> str:
    """Returns a name from a file, short and in one line."""
    return " ".join(text.split())[:60]


def _mcap(file: Path, found: Contents, limits: TraceLimits) -> None:
    """Adds an MCAP file's messages, up to where it is cut off or damaged."""
    schemas: dict[int, Schema] = {}
    topics: dict[int, str] = {}
    counts: Counter[int] = Counter()
    with disk.open_regular(file) as stream:
        try:
            for record in _records(
                file,
                StreamReader(stream, emit_chunks=True, validate_crcs=True, record_size_limit=limits.file_bytes),
                limits,
            ):
                if isinstance(record, Schema):
                    schemas.setdefault(record.id, record)
                elif isinstance(record, Channel):
                    schema = schemas.get(record.schema_id) or Schema(0, b"", "", "")
                    encoded = "" if record.message_encoding == "cdr" else f" in {record.message_encoding}"
                    if found.topic(record.topic, f"{schema.name}{encoded}"):
                        topics.setdefault(record.id, record.topic)
                        found.schemas.setdefault(record.topic, (schema.name, schema.data))
                elif isinstance(record, Message) and record.channel_id in topics:
                    counts[record.channel_id] += 1
                    message = record.log_time, record.data[: LARGEST_MESSAGE + 1]
                    found.messages[topics[record.channel_id]].append(message)
                elif isinstance(record, Statistics):
                    for number, count in record.channel_message_counts.items():
                        if number in topics and counts[number] < count:
                            line = f"the statistics announce {count} messages on {_text(topics[number])}"
                            found.missing.append(f"{_text(file.name)}: {line}, but there are {counts[number]}")
        except _DAMAGED as error:
            if isinstance(error, CRCValidationError) and isinstance(error.record, DataEnd):
                raise TraceError(f"{file}: is damaged: the data section does not match its checksum") from error
            line = f"{_text(file.name)} ends or is damaged before byte {stream.tell()}"
            found.missing.append(f"{line}, as a killed recorder leaves it; nothing after that was read")


def _records(file: Path, reader: StreamReader, limits: TraceLimits) -> Iterator[Any]:
    """Yields all records, those in chunks too. Raises TraceError if the chunks exceed a limit, and `_DAMAGED`."""
    total = 0
    for record in reader.records:
        if not isinstance(record, Chunk):
            yield record
            continue
        total += record.uncompressed_size
        for value, what, limit in (
            (record.uncompressed_size, "a chunk has", "chunk"),
            (total, "its chunks have", "total"),
        ):
            most = getattr(limits, f"{limit}_bytes")
            if value > most:
                raise TraceError(f"{file}: {what} more than {most} bytes (traces.limits.{limit}_bytes)")
        yield from breakup_chunk(record, validate_crc=True)


def _sqlite(file: Path, found: Contents, limits: TraceLimits) -> None:
    """Adds a database's messages. Raises TraceError for a damaged one, and for one whose last change is not in it."""
    if beside := journals_of(file):
        raise TraceError(
            f"{file}: its recording was never ended ({beside[0].name}); `sqlite3 FILE vacuum` completes it"
        )
    try:
        with closing(sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro&immutable=1", uri=True)) as database:
            database.text_factory = lambda raw: raw.decode("utf-8", "replace")
            database.execute("PRAGMA trusted_schema = OFF")
            _rows(file, database, found, limits)
    except sqlite3.Error as error:
        raise TraceError(f"{file}: is damaged: {shown(str(error))}; `sqlite3 FILE .recover` may save a part") from error


def _rows(file: Path, database: sqlite3.Connection, found: Contents, limits: TraceLimits) -> None:
    """Adds the messages of a database. Raises TraceError, sqlite3.Error."""
    (sound,) = database.execute("PRAGMA quick_check(1)").fetchone()
    if sound != "ok":
        raise sqlite3.DatabaseError(sound)
    tables = {name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    if not {"messages", "topics"} <= tables:
        raise TraceError(f"{file}: is a database of something else: it has no tables of messages and topics")
    for number, name, kind, encoding in database.execute("SELECT id, name, type, serialization_format FROM topics"):
        if not found.topic(str(name), str(kind) if encoding == "cdr" else f"{kind} in {encoding}"):
            continue
        query = "SELECT timestamp, data FROM messages WHERE topic_id = ? ORDER BY timestamp LIMIT ?"
        for received, data in database.execute(query, (number, limits.records + 1)):
            if not isinstance(received, int) or not isinstance(data, bytes):
                raise TraceError(f"{file}: a message on {_text(str(name))} is invalid: it is of another type")
            found.messages[str(name)].append((received, data[: LARGEST_MESSAGE + 1]))
    (lost,) = database.execute("SELECT count(*) FROM messages WHERE topic_id NOT IN (SELECT id FROM topics)").fetchone()
    if lost:
        found.missing.append(f"{_text(file.name)} has {lost} messages of no topic")


def journals_of(file: Path) -> list[Path]:
    """Returns the non-empty SQLite journals beside a file."""
    beside = (Path(f"{file}{end}") for end in JOURNALS)
    return [one for one in beside if one.is_file() and one.stat().st_size]


def _ros_1(file: Path, found: Contents) -> None:
    from rosbags.rosbag1 import Reader

    with Reader(file) as reader:
        found.ros_1 = True
        promised: Counter[str] = Counter()
        for connection in reader.connections:
            if found.topic(connection.topic, connection.msgtype):
                promised[connection.topic] += connection.msgcount
        wanted = [one for one in reader.connections if one.msgtype in STATES]
        for connection, received, data in reader.messages(connections=wanted) if wanted else ():
            found.messages[connection.topic].append((received, data[: LARGEST_MESSAGE + 1]))
        found.hold(promised, "its index")
