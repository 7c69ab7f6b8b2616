"""Writes the audit log on a thread of its own, so that time-critical code never waits for a disk.

It counts repeated requests instead of writing each, so that they do not fill the disk: heartbeats, jogging, refused
requests.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass

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

    Notes that cannot be written wait in memory. If they still wait when the service ends, they are only in its log.
    """

    def __init__(
        self, audit: AuditLog, clock: Callable[[], float] = time.monotonic, again_after: float = AGAIN_AFTER
    ) -> None:
        self.waiting = 0
        """Number of notes that are not yet in the database, without those that are counted."""
        self.written = 0
        """Number of rows written since the service started."""
        self.trouble = ""
        """Why rows could not be written at the last attempt; empty if they were."""
        self._audit = audit
        self._clock = clock
        self._again_after = again_after
        self._changed = threading.Condition()
        self._notes: deque[tuple[AuditNote, Future[None] | None]] = deque()
        self._repeats = Repeats()
        self._left_out = 0
        self._closing = self._closed = False
        self._thread: threading.Thread | None = None
        """Started with the first note, so that a service that fails to start leaves no thread."""

    def note(self, note: AuditNote) -> Future[None]:
        """Adds a note. The future ends when its row is on the disk."""
        written: Future[None] = Future()
        with self._changed:
            if self._closed:
                _only_here(note)
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
        """Writes the remaining notes, within this time (s)."""
        with self._changed:
            self._closing = True
            for note in self._repeats.rest():
                self._put(note, None)
            self._changed.notify()
        if self._thread is not None:
            self._thread.join(within)
        with self._changed:
            self._closed = True
            for waiting, _written in self._notes:
                _only_here(waiting)

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
            self._audit.append(many)
        except Exception as error:
            if (line := one_line(error)) != self.trouble:
                log.exception("audit: %s rows are not written yet", len(notes))
            self.trouble = line
            return False
        self.written += len(many)
        self._left_out -= left_out
        self.trouble = ""
        return True


def _only_here(note: AuditNote) -> None:
    log.error("audit: the service ends: only here: %s", note.model_dump_json(exclude_none=True))


_OF_SERVICE: dict[str, object] = {
    **dict.fromkeys(("actor", "role", "robot", "subject", "content", "request_id", "status")),
    **{"origin": "service", "request": "", "outcome": "failed", "count": 1},
}
