"""Child processes of this program, and their protocol: one message per line on the child's standard input and output.
The end of its input tells the child that its parent has ended, or wants it to end."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from pydantic import BaseModel

PIECE = 1 << 16
"""Size (bytes) of a pipe's buffer on Linux: one read empties it."""


class SilentError(Exception):
    """A child sent no complete line."""


class LateError(SilentError):
    """The line did not come in time."""


class LongError(SilentError):
    """The line was too long."""


def line_of(message: BaseModel) -> bytes:
    """Encodes a message as one line."""
    return message.model_dump_json().encode() + b"\n"


class Child:
    """A running child. It has a session of its own, so Ctrl-C in the terminal reaches only its parent."""

    def __init__(
        self,
        module: str | Sequence[str],
        *arguments: str,
        complaints: int | IO[Any] | None = None,
        environment: Mapping[str, str] | None = None,
        folder: Path | None = None,
        descriptors: Sequence[int] = (),
    ) -> None:
        """Starts a module of this program, or a command.

        complaints: destination of its standard error; None for that of this process
        descriptors: descriptors that it inherits
        """
        command = [sys.executable, "-m", module] if isinstance(module, str) else [*module]
        self._process = subprocess.Popen(
            [*command, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=complaints,
            env=environment,
            cwd=folder,
            pass_fds=descriptors,
            start_new_session=True,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self.input, self.output = self._process.stdin, self._process.stdout
        self._writing = threading.Lock()

    @property
    def pid(self) -> int:
        """The process ID."""
        return self._process.pid

    @property
    def code(self) -> int | None:
        """The exit code, negative after a signal; None while the process runs."""
        return self._process.poll()

    def send(self, message: BaseModel) -> None:
        """Sends a message. It is lost if the process has ended."""
        with self._writing, suppress(OSError, ValueError):
            self.input.write(line_of(message))
            self.input.flush()

    def lines(self) -> Iterator[bytes]:
        """Yields the child's lines until it ends."""
        return iter(self.output)

    def line(self, until: float, longest: int) -> bytes:
        """Returns the next line, which must be the last. Raises LateError after `until` (s, monotonic), LongError
        beyond `longest` bytes, and SilentError if the process ends first."""
        number, found, poll = self.output.fileno(), bytearray(), select.poll()
        poll.register(number, select.POLLIN)
        while not found.endswith(b"\n"):
            if not poll.poll(max(0.0, 1e3 * (until - time.monotonic()))):
                raise LateError
            piece = os.read(number, PIECE)
            if not piece:
                raise SilentError
            found += piece
            if len(found) > longest:
                raise LongError
        return bytes(found)

    def wait(self, seconds: float | None = None) -> int | None:
        """Waits for the end, and returns the exit code; None if it has not ended within this time."""
        with suppress(subprocess.TimeoutExpired):
            return self._process.wait(seconds)
        return None

    def end_input(self) -> None:
        """Closes the child's input, a request to end."""
        with suppress(OSError):
            self.input.close()

    def terminate(self) -> None:
        """Sends SIGTERM."""
        self._process.terminate()

    def kill(self) -> None:
        """Ends the child at once. May be called from any thread."""
        with suppress(ProcessLookupError):
            self._process.kill()

    def close(self, patience: float) -> None:
        """Waits for the end, kills the child after `patience` s, and closes the streams. May be called again."""
        if self.wait(patience) is None:
            self.kill()
            self._process.wait()
        for stream in (self.input, self.output):
            with suppress(OSError):
                stream.close()


def last_words(errors: str) -> str:
    """Returns the last line that a child wrote to its standard error."""
    return (errors.strip().splitlines() or ["it said nothing"])[-1]
