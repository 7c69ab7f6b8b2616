"""Stops robots from another terminal: every process that owns a port has a local stop socket.

A client connects and gets one JSON line (`StopAnswer`). It sends nothing: connecting is the request. There is one
socket file per process, in a folder that belongs to the user. So `daq stop` needs no configuration to find every robot
that this user is moving. Only the standard library is imported here, so that a stop does not wait for imports.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import stat
import time
import zlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

from daq.contracts.errors import ReachError

FOLDER_VARIABLE = "DAQ_RUNTIME_FOLDER"
APP = "ma2000-daq"
ANSWER_TIMEOUT = 1.0
"""Time (s) after which an unanswered stop is reported as not delivered."""
BACKLOG = 16


@dataclass(frozen=True, kw_only=True)
class StopAnswer:
    """Result of a stop: whether it was `delivered` to the controller and `confirmed` by it; `tick` and `postures` of
    the freeze."""

    robot: str
    port: str = ""
    delivered: bool
    confirmed: bool
    tick: int | None = None
    postures: tuple[int, ...] = ()
    text: str = ""

    def as_data(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return asdict(self)

    def to_json(self) -> bytes:
        """The answer as one line of JSON, as sent through the socket."""
        return json.dumps(self.as_data()).encode() + b"\n"

    @classmethod
    def from_json(cls, line: bytes) -> Self:
        """Inverse of `to_json`. Raises ValueError for any other line."""
        return cls.from_data(json.loads(line))

    @classmethod
    def from_data(cls, data: dict[str, Any]) -> Self:
        """Inverse of `as_data`. Raises ValueError for any other data."""
        try:
            return cls(**(data | {"postures": tuple(data["postures"])}))
        except (TypeError, KeyError) as error:
            raise ValueError(f"not the answer to a stop: {data!r:.80}") from error


@dataclass(frozen=True)
class StopAttempt:
    """A stop request to one process, and the answer; None if it did not answer in time."""

    path: Path
    answer: StopAnswer | None
    seconds: float

    @property
    def robot(self) -> str:
        """The robot's name, taken from the name of the socket, so that it is known without an answer."""
        return self.path.stem.rpartition("-")[0]


def runtime_folders() -> list[Path]:
    """Folders of stop sockets. New sockets are made in the first: DAQ_RUNTIME_FOLDER if it is set, else the session's
    own folder, else a folder of this user among the temporary files.

    `daq stop` searches all of them: a terminal may lack a variable that another one has, and a folder may be removed
    while a robot moves. The second folder of DAQ_RUNTIME_FOLDER is used for that variable's value alone.
    """
    # Not `tempfile`, which first writes a file: a stop must work on a full disk.
    temporary = Path(os.environ.get("TMPDIR") or "/tmp") / f"{APP}-{os.getuid()}"
    if own := os.environ.get(FOLDER_VARIABLE):
        return [Path(own), temporary.with_name(f"{temporary.name}-{zlib.crc32(os.path.abspath(own).encode()):08x}")]
    sessions = [Path("/run/user") / str(os.getuid())]
    if session := os.environ.get("XDG_RUNTIME_DIR"):
        sessions.insert(0, Path(session))
    # `os.path.isdir` returns False where `Path.is_dir` raises PermissionError.
    usable = [one for one in sessions if os.path.isdir(one) and os.access(one, os.W_OK | os.X_OK)]
    folders = [session / APP for session in usable]
    return list(dict.fromkeys([*folders, temporary]))


class StopSocket:
    """A listening, non-blocking socket for stop requests of one robot. If a clean-up program removes its file, `renew`
    makes another one."""

    def __init__(self, robot: str) -> None:
        """Raises ReachError if the socket cannot be made."""
        self._name = f"{robot}-{os.getpid()}.sock"
        self.problem = ""
        """Why there is no file by which this robot can be stopped; empty if there is one."""
        self.socket, self.path, self._file = self._made(runtime_folders()[0])

    def fileno(self) -> int:
        """The descriptor, for `select`; -1 once it is closed."""
        return self.socket.fileno()

    def is_there(self) -> bool:
        """Whether the file still belongs to this socket."""
        return _file_at(self.path) == self._file

    def renew(self) -> socket.socket | None:
        """Makes another socket if the file is gone, in the first folder that works. Returns the previous socket, whose
        connected clients still wait; None if nothing has changed."""
        if self.is_there():
            self.problem = ""
            return None
        for folder in runtime_folders():
            try:
                made = self._made(folder)
            except ReachError as error:
                self.problem = str(error)
            else:
                before = self.socket
                self.socket, self.path, self._file = made
                self.problem = ""
                return before
        return None

    def close(self) -> None:
        """Closes the socket. Removes the file, unless it belongs to another socket by now."""
        if self.is_there():
            self.path.unlink(missing_ok=True)
        self.socket.close()

    def _made(self, folder: Path) -> tuple[socket.socket, Path, tuple[int, int] | None]:
        """Returns a new socket in a folder, its path, and its file as in `_file_at`. Raises ReachError."""
        path = folder / self._name
        # The file gets its name only once the socket listens. A refused connection would make clients take it for a
        # leftover of a dead process.
        beside = path.with_suffix(".new")
        made: socket.socket | None = None
        try:
            made = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            _require_own(folder)
            beside.unlink(missing_ok=True)
            made.bind(str(beside))
            made.listen(BACKLOG)
            made.setblocking(False)
            beside.rename(path)
        except (OSError, ReachError) as error:
            if made is not None:
                made.close()
            if isinstance(error, ReachError):
                raise
            reason = error.strerror or str(error)
            raise ReachError(f"stop socket {path}: cannot be made: {reason}; set {FOLDER_VARIABLE}") from error
        return made, path, _file_at(path)


@contextlib.contextmanager
def stop_listener(robot: str) -> Iterator[StopSocket]:
    """The stop socket of one robot, removed at the end.

    Raises ReachError if it cannot be made: a robot that cannot be stopped from outside must not move.
    """
    with contextlib.closing(StopSocket(robot)) as listener:
        yield listener


def request_stop(robot: str | None = None, process: int | None = None) -> list[StopAttempt]:
    """Stops every robot that this user's processes are moving, or only the robot of this name, or of this process ID.
    Waits at most 1 s for each.

    Sockets of dead processes are removed and not counted.
    """
    sent = []
    for folder in runtime_folders():
        if not _is_own(folder):
            continue
        for path in sorted(folder.glob("*.sock")):
            name, _, owner = path.stem.rpartition("-")
            if robot in (None, name) and (process is None or owner == str(process)):
                sent += _ask(path)
    attempts = []
    for path, connection, begun in sent:
        with connection:
            answer, gone = _answer(connection)
        if not gone:
            attempts.append(StopAttempt(path, answer, time.monotonic() - begun))
    return attempts


def _file_at(path: Path) -> tuple[int, int] | None:
    """Device and inode number of a file; None if it does not exist."""
    try:
        found = path.lstat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def _require_own(folder: Path) -> None:
    """Raises ReachError if the folder is not this user's. Among temporary files, it may hold another user's socket."""
    if not _is_own(folder):
        raise ReachError(
            f"stop socket folder {folder}: must belong to this user and be writable by nobody else; "
            f"set {FOLDER_VARIABLE} to one that is"
        )


def _is_own(folder: Path) -> bool:
    try:
        found = folder.lstat()
    except OSError:
        return False
    others_may_write = found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not others_may_write


def _ask(path: Path) -> list[tuple[Path, socket.socket, float]]:
    """Connects, which is the stop request. Returns an empty list if the process is gone."""
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    connection.settimeout(ANSWER_TIMEOUT)
    begun = time.monotonic()
    try:
        connection.connect(str(path))
    except (ConnectionRefusedError, FileNotFoundError):
        connection.close()
        path.unlink(missing_ok=True)
        return []
    except OSError:
        # The process exists but cannot be reached: count it as an attempt without answer.
        return [(path, connection, begun)]
    return [(path, connection, begun)]


def _answer(connection: socket.socket) -> tuple[StopAnswer | None, bool]:
    """Returns the answer, and whether the process ended without answering, so that it moves nothing any more."""
    received = b""
    try:
        while piece := connection.recv(4096):
            received += piece
    except ConnectionResetError:
        return None, True
    except OSError:
        return None, False
    if not received:
        return None, True
    try:
        return StopAnswer.from_json(received), False
    except ValueError:
        return None, False
