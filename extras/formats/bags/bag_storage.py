"""Reads the storages of a ROS bag, and reports missing content by comparing each with its own index.

A channel of another program is never decoded, so its definitions cannot prevent reading the rest.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
import struct
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import Any

import zstandard
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from daq.contracts.documents import shown
from daq.contracts.errors import TraceError
from daq.contracts.trace_limits import TraceLimits
from daq.traces import disk
from daq.traces.fields import Fields, chunk_of, data_end_of
from daq.traces.inflate import inflate
from daq.traces.scan import HEAD, UNREADABLE
from extras.formats.bags.joint_messages import STATES

METADATA = "metadata.yaml"
LARGEST_MESSAGE = 1 << 20
"""Largest message (bytes) of joint states: for about ten thousand joints."""
ENCODINGS = "json", "protobuf"
"""Encodings of messages, other than ROS's, that are read by the names of their fields."""
NEVER_ENDED = "its recording was never ended, so unwritten data is missing"
JOURNALS = "-wal", "-journal"
SQLITE_MAGIC = b"SQLite format 3\0"
ROS_1_MAGIC = b"#ROSBAG V"

_JOURNAL = bytes.fromhex("d9d505f920a163d7")
"""First bytes of a rollback journal of SQLite; they are zero when its change has ended."""
_WAL_HEAD, _FRAME_HEAD = 32, 24
"""Bytes before the frames of SQLite's write-ahead log, and before the page of each (https://sqlite.org/fileformat2.html#walformat)."""
_MESSAGE = struct.Struct("<HIQQ")


@dataclass
class Contents:
    """Topics, and the messages of those with joint states.

    types:    type of the messages on each topic
    messages: time of reception (ns since 1970) and bytes of each message, by topic
    schemas:  definition of the messages on each topic of another encoding
    missing:  one line for each part that the bag announces, or once held, but lacks
    ended:    whether metadata.yaml, which a recorder writes at the end, states how many messages there are
    ros_1:    whether messages have the layout of ROS 1
    """

    types: dict[str, str] = field(default_factory=dict)
    messages: dict[str, list[tuple[int, bytes]]] = field(default_factory=dict)
    schemas: dict[str, tuple[str, bytes]] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)
    ended: bool = False
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

    def hold(self, before: Mapping[str, int], promised: Mapping[str, int], who: str) -> None:
        """Notes the messages that `who` announces on each topic and that have not come since `before`."""
        for topic, count in promised.items():
            there = len(self.messages.get(topic, ())) - before.get(topic, 0)
            if self.is_read(topic) and there < count:
                self.missing.append(f"{who} announces {count} messages on {_text(topic)}, but there are {there}")

    def counts(self) -> dict[str, int]:
        """Returns the number of messages on each topic so far."""
        return {topic: len(messages) for topic, messages in self.messages.items()}


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
    found.ended = bool(_topics(about))
    for kind in _topics(about).values():
        found.topic(*kind[:2])
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
    found.hold({}, {topic: count for topic, _, count in _topics(about).values()}, METADATA)


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


def _topics(about: dict[str, Any]) -> dict[int, tuple[str, str, int]]:
    """Returns name, type and announced number of messages of each topic; invalid entries are left out."""
    topics = {}
    entries = about.get("topics_with_message_count")
    for number, entry in enumerate(entries if isinstance(entries, list) else ()):
        with suppress(KeyError, TypeError, ValueError):
            said = entry["topic_metadata"]
            topics[number] = str(said["name"]), str(said["type"]), int(entry["message_count"])
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
            stream.seek(0)
            _Mcap(file, disk.read_at_most(stream, limits.file_bytes, str(file)), found, limits).read()
            return
    if first == SQLITE_MAGIC:
        _sqlite(file, found, limits)
    elif first.startswith(ROS_1_MAGIC):
        _ros_1(file, found)
    else:
        raise TraceError(f"{file}: is neither MCAP nor SQLite nor a bag of ROS 1, or its beginning is damaged")


def _text(text: str) -> str:
    """Returns a name from a file, short and in one line."""
    return " ".join(text.split())[:60]


# ---- MCAP


class _Mcap:
    """One MCAP file, read to its end or to where it is cut off; damaged chunks are left out."""

    def __init__(self, file: Path, data: bytes, found: Contents, limits: TraceLimits) -> None:
        self._file, self._view, self._found, self._limits = file, memoryview(data), found, limits
        self._types: dict[int, str] = {}
        self._schemas: dict[int, tuple[str, bytes]] = {}
        self._topics: dict[int, str] = {}
        self._counts: Counter[int] = Counter()
        self._promised: dict[int, int] = {}
        self._inflated = self._damaged = 0
        self._loose = False

    def read(self) -> None:
        """Adds the file's content; first the definitions at its end, which survive a damaged chunk."""
        for opcode, _, body in self._records():
            if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._record(opcode, body)
        position, opcode = len(MCAP0_MAGIC), 0
        for opcode, begin, body in self._records():
            if opcode == Opcode.CHUNK:
                self._chunk(body)
            elif opcode == Opcode.DATA_END:
                self._data_end(body, begin - HEAD.size)
            elif opcode not in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._record(opcode, body)
            position = begin + len(body)
        if opcode != Opcode.FOOTER or bytes(self._view[position:]) != MCAP0_MAGIC:
            line = f"{_text(self._file.name)} ends or is damaged after byte {position} of {len(self._view)}"
            self._found.missing.append(f"{line}, as a killed recorder leaves it; nothing after that was read")
        if self._damaged:
            self._found.missing.append(f"{_text(self._file.name)}: {self._damaged} damaged parts were left out")
        for number, count in self._promised.items():
            if number in self._topics and self._counts[number] < count:
                line = f"the statistics announce {count} messages on {_text(self._topics[number])}"
                self._found.missing.append(f"{_text(self._file.name)}: {line}, but there are {self._counts[number]}")

    def _records(self) -> Iterator[tuple[int, int, memoryview]]:
        """Yields opcode, begin and content of each record, up to the footer or the end of a truncated file."""
        begin, end = len(MCAP0_MAGIC), len(self._view)
        opcode = 0
        while opcode != Opcode.FOOTER and begin + HEAD.size <= end:
            opcode, length = HEAD.unpack_from(self._view, begin)
            begin += HEAD.size
            if opcode == 0 or begin + length > end:
                return
            yield opcode, begin, self._view[begin : begin + length]
            begin += length

    def _chunk(self, body: memoryview) -> None:
        try:
            packed = chunk_of(body)
            self._require(packed.size, self._limits.chunk_bytes, "a chunk declares", "chunk_bytes")
            self._inflated += packed.size
            self._require(self._inflated, self._limits.total_bytes, "its chunks have", "total_bytes")
            chunk = memoryview(inflate(packed))
        except UNREADABLE:
            self._damaged += 1
            return
        self._loose |= packed.crc == 0
        position = 0
        while position < len(chunk):
            if len(chunk) - position < HEAD.size:
                self._damaged += 1
                return
            opcode, length = HEAD.unpack_from(chunk, position)
            begin, position = position + HEAD.size, position + HEAD.size + length
            if position > len(chunk):
                self._damaged += 1
                return
            self._record(opcode, chunk[begin:position])

    def _require(self, value: int, most: int, line: str, limit: str) -> None:
        if value > most:
            raise TraceError(f"{self._file}: {line} more than {most} bytes (traces.limits.{limit})")

    def _record(self, opcode: int, body: memoryview) -> None:
        try:
            if opcode == Opcode.MESSAGE:
                channel, _, logged, _ = _MESSAGE.unpack_from(body)
                if channel in self._topics:
                    self._counts[channel] += 1
                    data = bytes(body[_MESSAGE.size : _MESSAGE.size + LARGEST_MESSAGE + 1])
                    self._found.messages[self._topics[channel]].append((logged, data))
            elif opcode == Opcode.SCHEMA:
                fields = Fields(body)
                number, name = fields.u16(), _name(fields)
                self._types.setdefault(number, name)
                _name(fields)
                self._schemas.setdefault(number, (name, bytes(fields.raw(fields.u32()))))
            elif opcode == Opcode.CHANNEL:
                fields = Fields(body)
                number, schema, topic, encoding = fields.u16(), fields.u16(), _name(fields), _name(fields)
                kind = self._types.get(schema, "")
                if self._found.topic(topic, kind if encoding == "cdr" else f"{kind} in {encoding}"):
                    self._topics.setdefault(number, topic)
                    self._found.schemas.setdefault(topic, self._schemas.get(schema, (kind, b"")))
            elif opcode == Opcode.STATISTICS:
                fields = Fields(body)
                fields.raw(
                    8 + 2 + 4 * 4 + 8 + 8
                )  # sums over all channels, and the times of the first and the last message
                counts = fields.raw(fields.u32())
                self._promised = dict(struct.iter_unpack("<HQ", counts))
        except (ValueError, struct.error):
            self._damaged += 1

    def _data_end(self, body: memoryview, position: int) -> None:
        """Raises TraceError if the data section's checksum differs: no chunk checksum protects its content."""
        with suppress(ValueError):
            crc = data_end_of(body).data_section_crc
            if crc not in (0, zlib.crc32(self._view[:position])) and (self._loose or not self._inflated):
                raise TraceError(f"{self._file}: is damaged: the data section does not match its checksum")


def _name(fields: Fields) -> str:
    return str(fields.raw(fields.u32()), "utf-8", "replace")


# ---- SQLite


def _sqlite(file: Path, found: Contents, limits: TraceLimits) -> None:
    with TemporaryDirectory() as folder:
        path = _recovered(file, Path(folder), found)
        try:
            with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)) as database:
                database.text_factory = lambda raw: raw.decode("utf-8", "replace")
                database.execute("PRAGMA trusted_schema = OFF")
                _rows(file, database, found, limits)
        except sqlite3.Error as error:
            hint = "`sqlite3 FILE .recover` may save a part"
            raise TraceError(f"{file}: is damaged: {shown(str(error))}; {hint}") from error


def _rows(file: Path, database: sqlite3.Connection, found: Contents, limits: TraceLimits) -> None:
    """Adds the messages of a database. Raises TraceError, sqlite3.Error."""
    (sound,) = database.execute("PRAGMA quick_check(1)").fetchone()
    if sound != "ok":
        raise sqlite3.DatabaseError(sound)
    tables = {name for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    if not {"messages", "topics"} <= tables:
        raise TraceError(f"{file}: is a database of something else: it has no tables of messages and topics")
    before = found.counts()
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
    if "metadata" in tables:
        _hold_to_its_own_metadata(file, database, found, before)


def _hold_to_its_own_metadata(
    file: Path, database: sqlite3.Connection, found: Contents, before: Mapping[str, int]
) -> None:
    """Notes content that a database's own metadata announce and it lacks. Some releases of ROS leave that table
    empty."""
    row = database.execute("SELECT metadata FROM metadata ORDER BY id DESC LIMIT 1").fetchone()
    if row is None or found.ended:
        return
    with suppress(TraceError):
        about = _about(str(row[0]).encode(), file.name)
        paths = about.get("relative_file_paths")
        if isinstance(paths, list) and len(paths) > 1:
            return  # for all files of the bag together; metadata.yaml states the same
        topics = {name: count for name, _, count in _topics(about).values()}
        if not about.get("message_count") and found.counts() != before:
            found.missing.append(f"{_text(file.name)}: {NEVER_ENDED}")
        found.hold(before, topics, _text(file.name))


def _is_plain(journal: Path) -> bool:
    """Whether a journal has a valid beginning and names no other file.

    SQLite would delete the file that is named at the end of a journal of several databases.
    """
    with journal.open("rb") as stream:
        begin = stream.read(8)
        stream.seek(-min(8, stream.seek(0, os.SEEK_END)), os.SEEK_END)
        return begin in (_JOURNAL, bytes(8)) and stream.read(8) != _JOURNAL


def journals_of(file: Path) -> list[Path]:
    """Returns the non-empty SQLite journals beside a file."""
    beside = (Path(f"{file}{end}") for end in JOURNALS)
    return [one for one in beside if one.is_file() and one.stat().st_size]


def _recovered(file: Path, folder: Path, found: Contents) -> Path:
    """Returns the database with its journals applied: itself, or a copy that SQLite has recovered.

    Raises TraceError if the database is being written or a journal cannot be applied, OSError.
    """
    wal, journal = (Path(f"{file}{end}") for end in JOURNALS)
    if not (beside := journals_of(file)):
        return file
    copy = folder / "copy.db3"
    copies = {file: copy} | {one: Path(f"{copy}{one.name.removeprefix(file.name)}") for one in beside}
    states = [(one.stat().st_size, one.stat().st_mtime_ns) for one in copies]
    if journal in beside and not _is_plain(journal):
        raise TraceError(f"{file}: was left in the middle of a change, and the damaged {journal.name} cannot undo it")
    for one, target in copies.items():
        shutil.copyfile(one, target)
    if states != [(one.stat().st_size, one.stat().st_mtime_ns) for one in copies]:
        raise TraceError(f"{file}: is being written; import it when its recording has ended")
    whole = _frames(wal) if wal in beside else 0
    with closing(sqlite3.connect(copy)) as database:
        database.execute("SELECT count(*) FROM sqlite_master").fetchone()
        _, applied, _ = database.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchone()  # the others report 0 pages
        if whole > max(applied, 0):
            line = f"{whole - max(applied, 0)} of {whole} pages of {beside[0].name} are damaged or were never committed"
            found.missing.append(f"{line}; rows in them are missing")
    return copy


def _frames(wal: Path) -> int:
    """Returns the number of pages in the present generation of a write-ahead log, valid or not."""
    data = memoryview(wal.read_bytes())
    if len(data) < _WAL_HEAD:
        return 0
    page, salt = int.from_bytes(data[8:12], "big"), bytes(data[16:24])
    begins = range(_WAL_HEAD, len(data), _FRAME_HEAD + page)
    return next((n for n, at in enumerate(begins) if bytes(data[at + 8 : at + 16]) != salt), len(begins))


# ---- ROS 1


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
        found.hold({}, promised, "its index")
