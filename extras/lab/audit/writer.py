"""Writes the audit log on a thread of its own, so that time-critical code never waits for a disk.

It counts repeated requests instead of writing each, so that they do not fill the disk: heartbeats, jogging, refused
requests.
"""

from __future__ import annotations

import logging
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from daq.contracts.service.audit import AuditNote
from extras.lab.audit.log import AuditLog
from server.database_errors import one_line

COUNTED_FOR = 60.0
"""Time (s) for which repeated requests are counted before a row states their number."""
MOST_KEYS = 1000
"""Most different repeated requests that are distinguished; further ones are counted together."""
Key = tuple[object, ...]


@dataclass
class _Counted:
    """Requests of one key since the last row about them, the last one's note, and the begin of counting (s)."""

    count: int
    note: AuditNote
    since: float


class Repeats:
    """Counts repeated requests. For one thread."""

    def __init__(self) -> None:
        self._counted: dict[Key, _Counted] = {}

    def take(self, note: AuditNote, now: float) -> AuditNote | None:
        """Returns the note if it is the first of its kind; otherwise counts it and returns None."""
        key = _key(note)
        known = self._counted.get(key)
        if known is None and len(self._counted) >= MOST_KEYS:
            key = (note.outcome,)
            known = self._counted.get(key)
        if known is None:
            self._counted[key] = _Counted(0, note, now)
            return note
        known.count, known.note = known.count + 1, note
        return None

    def due(self, now: float) -> list[AuditNote]:
        """Returns a note for each kind that was counted for COUNTED_FOR s. Kinds that have ended are removed."""
        found = []
        for key, counted in list(self._counted.items()):
            if now - counted.since < COUNTED_FOR:
                continue
            if counted.count:
                found.append(counted.note.model_copy(update={"count": counted.count}))
                counted.count, counted.since = 0, now
            else:
                del self._counted[key]
        return found

    def rest(self) -> list[AuditNote]:
        """Returns and removes all present counts, because the service ends."""
        counted, self._counted = self._counted, {}
        return [one.note.model_copy(update={"count": one.count}) for one in counted.values() if one.count]


def _key(note: AuditNote) -> Key:
    return note.actor, note.origin, note.action, note.robot, note.outcome, note.status


AT_ONCE = 200
"""Number of rows in one transaction."""
MOST_WAITING = 50_000
"""Most notes (about 1 kB each) that wait in memory while the database cannot be written. Further ones are only in the
service's log, and a row states their number.
"""
AGAIN_AFTER = 1.0
"""Time (s) after which a failed write is tried again."""
LOOK_EVERY = 5.0
"""Time (s) between two looks at the repeated requests."""
log = logging.getLogger("server.audit")


class AuditWriter:
    """Accepts notes from any thread, without making it wait, except after the writer's end.

    Notes that cannot be written wait in memory. If they still wait when the service ends, they are saved in the file
    `kept`, and written after the next start.
    """

    def __init__(
        self, audit: AuditLog, kept: Path, clock: Callable[[], float] = time.monotonic, again_after: float = AGAIN_AFTER
    ) -> None:
        self.waiting = 0
        """Number of notes that are not yet in the database, without those that are counted."""
        self.written = 0
        """Number of rows written since the service started."""
        self.trouble = ""
        """Why rows could not be written at the last attempt; empty if they were."""
        self._audit = audit
        self._kept = kept
        self._clock = clock
        self._again_after = again_after
        self._changed = threading.Condition()
        self._notes: deque[tuple[AuditNote, Future[None] | None]] = deque()
        self._repeats = Repeats()
        self._left_out = 0
        self._closing = self._closed = False
        self._take_in()
        self._thread: threading.Thread | None = None
        """Started with the first note, so that a service that fails to start leaves no thread."""

    def note(self, note: AuditNote) -> Future[None]:
        """Adds a note. The future ends when its row is on the disk."""
        written: Future[None] = Future()
        with self._changed:
            if self._closed:
                self._keep([note.model_dump_json()], "a")
            else:
                self._put(note, written)
                self._changed.notify()
        return written

    def count(self, note: AuditNote) -> None:
        """Adds a note of a repeated request: the first has a row at once, the others are counted."""
        with self._changed:
            first = self._repeats.take(note, self._clock())
            if first is not None:
                self._put(first, None)
                self._changed.notify()

    def flush(self, within: float) -> bool:
        """Waits until all notes so far are written. Returns False if that takes more than `within` s."""
        with self._changed:
            return self._changed.wait_for(lambda: not self.waiting, within)

    def close(self, within: float) -> None:
        """Writes the remaining notes, within this time (s), and saves the rest in a file."""
        with self._changed:
            self._closing = True
            for note in self._repeats.rest():
                self._put(note, None)
            self._changed.notify()
        if self._thread is not None:
            self._thread.join(within)
        self._keep_rest()

    def _put(self, note: AuditNote, written: Future[None] | None) -> None:
        if len(self._notes) >= MOST_WAITING:
            self._left_out += 1
            log.error("audit: too many rows wait: only here: %s", note.model_dump_json(exclude_none=True))
            return
        self._notes.append((note, written))
        self.waiting = len(self._notes)
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="audit", daemon=True)
            self._thread.start()

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._notes or self._closing, LOOK_EVERY)
                for note in self._repeats.due(self._clock()):
                    self._put(note, None)
                some = [self._notes[n] for n in range(min(AT_ONCE, len(self._notes)))]
                if not some:
                    if self._closing:
                        return
                    continue
            if not self._write([note for note, _ in some]):
                with self._changed:
                    if self._changed.wait_for(lambda: self._closing, self._again_after):
                        return
                continue
            with self._changed:
                for _ in some:
                    self._notes.popleft()
                self.waiting = len(self._notes)
                if self._taken_in and not self.waiting:
                    self._forget_kept()
                self._changed.notify_all()
            for _, written in some:
                if written is not None and written.set_running_or_notify_cancel():
                    written.set_result(None)

    def _write(self, notes: Sequence[AuditNote]) -> bool:
        """Writes rows. Returns whether they are written: errors are logged once, and the rows wait."""
        left_out, many = self._left_out, list(notes)
        if left_out:
            line = f"{left_out} rows are only in the service's log: too many waited for the database"
            many.append(notes[-1].model_copy(update=_OF_SERVICE | {"action": "rows_left_out", "detail": line}))
        try:
            self._append(many)
        except Exception as error:
            if (line := one_line(error)) != self.trouble:
                log.exception("audit: %s rows are not written yet", len(notes))
            self.trouble = line
            return False
        self._left_out -= left_out
        self.trouble = ""
        return True

    def _append(self, notes: Sequence[AuditNote]) -> None:
        head = self._audit.append(notes)
        self.written += len(notes)
        log.debug("audit: %s", head)

    def _take_in(self) -> None:
        """Reads the notes that the service could not write before it ended."""
        with suppress(FileNotFoundError):
            for line in self._kept.read_text("utf-8").splitlines():
                try:
                    self._notes.append((AuditNote.model_validate_json(line), None))
                except ValidationError:  # the power failed while the line was written
                    log.warning("audit: %s: a line cannot be read: %.200s", self._kept, line)
        self._taken_in = bool(self._notes)
        if self._notes and self._write([note for note, _ in self._notes]):
            self._notes.clear()
            self._forget_kept()
        self.waiting = len(self._notes)

    def _forget_kept(self) -> None:
        """Removes the file, since its notes have rows now. If that fails, the next start writes them again."""
        self._taken_in = False
        with suppress(OSError):
            self._kept.unlink(missing_ok=True)

    def _keep_rest(self) -> None:
        with self._changed:
            self._closed = True  # from now on, the stop listener's last stops go to the file as well
            if self._notes:
                self._keep([note.model_dump_json() for note, _ in self._notes], "w")

    def _keep(self, lines: Sequence[str], mode: str) -> None:
        try:
            self._kept.parent.mkdir(parents=True, exist_ok=True)
            with self._kept.open(mode, encoding="utf-8") as stream:
                stream.writelines(f"{line}\n" for line in lines)
                stream.flush()
                os.fsync(stream.fileno())
        except OSError as error:
            for line in lines:
                log.error("audit: %s: only here: %s", error.strerror, line)  # noqa: TRY400 - the line says it all


_OF_SERVICE: dict[str, object] = {
    **dict.fromkeys(("actor", "role", "robot", "subject", "content", "request_id", "status")),
    **{"origin": "service", "request": "", "outcome": "failed", "count": 1},
}
_WITHOUT_WORDS: dict[str, object] = {
    **dict.fromkeys(("actor", "role", "robot", "subject", "content", "request_id")),
    **{"origin": "unknown", "request": "", "detail": "its words could not be written: the service's log has them"},
}
