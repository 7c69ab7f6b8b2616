"""Logs: readable lines in a terminal, otherwise one JSON object per line with the id of its request."""

from __future__ import annotations

import io
import json
import logging
import sys
import threading
from contextvars import ContextVar
from datetime import UTC, datetime
from types import TracebackType
from typing import TextIO

request_id: ContextVar[str | None] = ContextVar("request_id", default=None)
_printed = logging.getLogger("stderr")
_OF_EVERY_RECORD = frozenset(vars(logging.makeLogRecord({}))) | {"message", "asctime", "taskName", "color_message"}


class JsonLines(logging.Formatter):
    """Formats a record as one JSON object: at, level, logger, text, request, and the caller's extra fields."""

    def format(self, record: logging.LogRecord) -> str:
        """Returns the line."""
        line: dict[str, object] = {
            "at": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "text": record.getMessage(),
        }
        if (number := request_id.get()) is not None:
            line["request"] = number
        line |= {key: value for key, value in vars(record).items() if key not in _OF_EVERY_RECORD and value is not None}
        if record.exc_info:
            line["traceback"] = self.formatException(record.exc_info)
        return json.dumps(line, ensure_ascii=False, default=str)


class PlainLines(logging.Formatter):
    """Formats a record for a terminal. Control characters and line breaks that clients send are escaped."""

    def format(self, record: logging.LogRecord) -> str:
        """Returns the line."""
        moment = datetime.fromtimestamp(record.created).astimezone().strftime("%H:%M:%S")
        text = f"{moment} {record.levelname.lower():7} {_printable(record.getMessage())}"
        if not record.exc_info:
            return text
        return "\n".join([text, *map(_printable, self.formatException(record.exc_info).split("\n"))])


def _printable(text: str) -> str:
    """Replaces every character of `text` that is not printable by its escape."""
    return "".join(one if one.isprintable() else one.encode("unicode_escape").decode() for one in text)


class StandardError(io.TextIOBase):
    """Replaces `sys.stderr` if logs are JSON: every line printed there becomes a record."""

    encoding = "utf-8"

    def __init__(self, real: TextIO) -> None:
        self.real = real
        self._begun = ""
        self._writing = threading.local()

    def write(self, text: str) -> int:
        """Logs complete lines, and stores the rest until its end arrives. A line that cannot be logged is lost: logging
        prints its own errors here, and logging them again would never end."""
        if getattr(self._writing, "active", False):
            return len(text)
        self._writing.active = True
        try:
            *lines, self._begun = (self._begun + text).split("\n")
            for line in lines:
                if line.strip():
                    _printed.warning("%s", line.rstrip())
        finally:
            self._writing.active = False
        return len(text)

    def fileno(self) -> int:
        """Returns the descriptor of the real stream."""
        return self.real.fileno()

    def isatty(self) -> bool:
        """Always False."""
        return False

    def writable(self) -> bool:
        """Always True."""
        return True


def begin(stream: TextIO | None = None, level: int = logging.INFO) -> None:
    """Sends all logs of this process to `stream`, by default standard error. If it is not a terminal, they are JSON, as
    is everything else printed there: warnings, uncaught errors, output of libraries."""
    if stream is None:
        stream = sys.stderr.real if isinstance(sys.stderr, StandardError) else sys.stderr
    handler = logging.StreamHandler(stream)
    handler.setFormatter(PlainLines() if stream.isatty() else JsonLines())
    logging.basicConfig(level=logging.WARNING, handlers=[handler], force=True)
    for ours in ("server", "daq"):
        logging.getLogger(ours).setLevel(level)
    logging.captureWarnings(True)
    if not stream.isatty():
        sys.stderr = StandardError(stream)
        sys.excepthook = _ended_process
        threading.excepthook = _ended_thread
        sys.unraisablehook = _not_raised


def _ended_process(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    _printed.critical("this process ends: %s", error, exc_info=(kind, error, trace))


def _ended_thread(args: threading.ExceptHookArgs) -> None:
    name = args.thread.name if args.thread else "unknown"
    error = args.exc_value or args.exc_type()
    _printed.error("thread %s ended: %s", name, error, exc_info=(args.exc_type, error, args.exc_traceback))


def _not_raised(args: sys.UnraisableHookArgs) -> None:
    error = args.exc_value or args.exc_type()
    text = args.err_msg or "an error that could not be raised"
    _printed.error("%s: %s", text, error, exc_info=(args.exc_type, error, args.exc_traceback))
