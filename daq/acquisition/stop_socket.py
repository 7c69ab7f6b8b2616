"""Stop from another terminal: a local socket beside every process that owns a robot's port.

A client connects, and is answered with one JSON line (`StopAnswer`). There is nothing to send and nothing to confirm:
connecting is the request. The socket lies in a folder that belongs to the user, one file a process, so `daq stop`
needs no configuration to find every robot that this user is moving.
"""

from __future__ import annotations

import contextlib
import os
import socket
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from daq.contracts.errors import ReachError

FOLDER_VARIABLE = "DAQ_RUNTIME_FOLDER"
ANSWER_TIMEOUT = 1.0
"""Seconds after which an unanswered stop is reported as not delivered."""


class StopAnswer(BaseModel):
    """What became of a stop: `delivered` to the controller, `confirmed` by it, frozen at `tick` and `postures`."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    robot: str
    delivered: bool
    confirmed: bool
    tick: int | None = None
    postures: tuple[int, ...] = ()
    text: str = ""


@dataclass(frozen=True)
class StopAttempt:
    """One socket that was asked, and its answer (None: nobody answered in time)."""

    path: Path
    answer: StopAnswer | None
    seconds: float


def runtime_folder() -> Path:
    """Folder of the stop sockets: DAQ_RUNTIME_FOLDER, else the session's own, else one of this user's under /tmp."""
    if FOLDER_VARIABLE in os.environ:
        return Path(os.environ[FOLDER_VARIABLE])
    session = os.environ.get("XDG_RUNTIME_DIR")
    if session and Path(session).is_dir():
        return Path(session) / "ma2000-daq"
    return Path(tempfile.gettempdir()) / f"ma2000-daq-{os.getuid()}"


def _own_folder() -> Path:
    """The folder, made if need be. Raises ReachError when it is another user's: /tmp belongs to everyone."""
    folder = runtime_folder()
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    if FOLDER_VARIABLE not in os.environ and folder.stat().st_uid != os.getuid():
        raise ReachError(f"stop socket folder {folder} belongs to another user: set {FOLDER_VARIABLE}")
    return folder


@contextlib.contextmanager
def stop_listener(robot: str) -> Iterator[socket.socket]:
    """A listening socket for stop requests of one robot, removed at the end. Raises ReachError when it cannot be made:
    a robot that cannot be stopped from outside is not moved."""
    path = runtime_folder() / f"{robot}-{os.getpid()}.sock"
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        try:
            _own_folder()
            path.unlink(missing_ok=True)
            listener.bind(str(path))
            listener.listen(16)
        except OSError as error:
            raise ReachError(f"stop socket {path}: cannot be made: {error}; set {FOLDER_VARIABLE}") from error
        yield listener
    finally:
        listener.close()
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)


def request_stop(robot: str | None = None) -> list[StopAttempt]:
    """Stops every robot that this user's processes are moving (or the one named). Never waits over a second for each.

    Sockets whose process is gone are removed and not counted.
    """
    pattern = f"{robot or '*'}-*.sock"
    asked: list[tuple[Path, socket.socket, float]] = []
    for path in sorted(runtime_folder().glob(pattern)):
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        connection.settimeout(ANSWER_TIMEOUT)
        begun = time.monotonic()
        try:
            connection.connect(str(path))
        except ConnectionRefusedError:
            connection.close()
            path.unlink(missing_ok=True)
            continue
        except OSError:
            connection.close()
            asked.append((path, connection, begun))
            continue
        asked.append((path, connection, begun))
    return [StopAttempt(path, _answer(connection), time.monotonic() - begun) for path, connection, begun in asked]


def _answer(connection: socket.socket) -> StopAnswer | None:
    received = b""
    try:
        with connection:
            while piece := connection.recv(4096):
                received += piece
        return StopAnswer.model_validate_json(received)
    except (OSError, ValidationError):
        return None
