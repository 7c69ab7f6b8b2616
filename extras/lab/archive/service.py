"""Sends traces to the archive, fetches them on demand, and drops local copies, on two threads of its own.

Nothing else waits for the store. Transfers in progress are in memory. Archived traces are in the database, and are
entered only after they were read back and compared.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import math
import shutil
import tempfile
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from sqlalchemy.exc import SQLAlchemyError

from daq.contracts.errors import DaqError
from daq.contracts.service.archive import ArchiveStatus, TraceArchive, Transfer
from daq.traces import disk
from daq.traces.room import RESERVE
from extras.lab.archive.archived import Archived, ArchivedStore, Local
from extras.lab.archive.bucket import PIECE, ArchiveError, Bucket, Content, DamagedError, RefusedError, object_name
from extras.lab.archive.health import FIRST_PAUSE, LONGEST_PAUSE, Attempts, Health
from extras.lab.archive.settings import ArchiveSettings
from extras.lab.archive.transfers import Transfers
from server.catalogue.catalogue import UPLOAD, Catalogue
from server.clock import Clock
from server.problems import ProblemError

ROUND = 600.0
"""Time (s) between two looks for traces to send and copies to drop, in addition to those that are reported."""
SENT_A_ROUND = 200
"""Most traces that are sent before copies are dropped: at first use years of traces may wait, and the disk may be
full."""
CHECKED_LATELY = timedelta(hours=1)
"""Time for which an object that was read back is not read again before the local copy is deleted."""
RETRY_AFTER = 2
"""Time (s) after which a client may ask again for a trace that is being fetched."""
HEARD_WITHIN = 60.0
"""Time (s) for which a failed fetch answers the next request. A waiting client asks every RETRY_AFTER; a later request
starts a new attempt."""
MB = 1_000_000
log = logging.getLogger("server.archive")


@dataclass(frozen=True)
class ArchiveContext:
    """Stores, settings and callbacks of the archive of one robot.

    Args:
        tell: records an event, in one line
        fetched: called after a fetch has ended, with or without success; must not block
        count: counts a transfer: direction, result, number of bytes
        pauses: first and longest pause (s) after failures
    """

    robot: str
    settings: ArchiveSettings
    bucket: Bucket
    catalogue: Catalogue
    archived: ArchivedStore
    clock: Clock
    tell: Callable[[str], None]
    fetched: Callable[[], None] = lambda: None
    count: Callable[[str, str, int], None] = lambda _direction, _result, _size: None
    pauses: tuple[float, float] = (FIRST_PAUSE, LONGEST_PAUSE)


class ArchiveService:
    """The archive of one robot's traces. Safe to use from any thread. No public method waits for the store."""

    def __init__(self, context: ArchiveContext) -> None:
        self._context = context
        self.health = Health(context.clock, context.pauses)
        now = context.clock.monotonic
        self._sending, self._fetching = Transfers("send", now), Transfers("fetch", now)
        self._attempts = Attempts()
        self._drops: set[str] = set()
        """Traces whose local copies a user wants to drop, whatever the policy."""
        self._closing = threading.Event()
        self._work, self._asked = threading.Event(), threading.Event()
        self._local_bytes = self._archived = 0
        self._over = ""
        """Why more local traces are kept than the policy allows, in one line."""
        self._unreadable: dict[str, str] = {}
        """Traces whose files cannot be read or deleted, and why."""
        self._looked = -math.inf
        """When the last whole round ended (s, monotonic)."""
        self._threads = [
            threading.Thread(target=self._loop, args=(self._round, self._work), name="archive-send", daemon=True),
            threading.Thread(
                target=self._loop, args=(self._fetch_next, self._asked), name="archive-fetch", daemon=True
            ),
        ]

    def start(self) -> None:
        """Starts to send waiting traces."""
        for thread in self._threads:
            thread.start()

    def close(self, patience: float) -> None:
        """Ends the threads. Interrupted transfers are repeated after the next start."""
        self._closing.set()
        self._work.set()
        self._asked.set()
        for thread in self._threads:
            if thread.is_alive():
                thread.join(patience / len(self._threads))

    # ---- called by others

    def send(self, trace: str) -> None:
        """Sends a trace of the folder as soon as possible."""
        if self._sending.add(trace):
            self._work.set()

    def send_and_drop(self, trace: str, *, drop: bool) -> None:
        """Sends a trace on a user's request; with `drop`, the local copy is deleted afterwards. Raises a 404 for a
        missing trace."""
        self._context.catalogue.place_of(trace)
        if self._context.archived.get(trace) is None:
            self._sending.add(trace)
        if drop:
            self._drops.add(trace)
        self._work.set()

    def deleted(self) -> None:
        """Deletes the object of a deleted trace, too."""
        self._work.set()

    def fetch(self, trace: str) -> ProblemError:
        """Fetches a trace; returns the problem that answers requests for it meanwhile."""
        before = self._fetching.failed_since(trace, self._context.clock.monotonic() - HEARD_WITHIN)
        if before is not None:
            self._fetching.ended(trace)  # a client that asks again starts a new attempt
            return ProblemError(503, "archive", before.problem, "try again, or look into the archive")
        self.fetch_now(trace)
        said = words_of(self._fetching.of(trace))
        advice = "ask again in a moment; GET …/archive shows its progress"
        line = f"the archive has this trace, and it is being fetched: {said}"
        return ProblemError(503, "trace-in-archive", line, advice, headers={"Retry-After": str(RETRY_AFTER)})

    def fetch_now(self, trace: str) -> None:
        """Fetches a trace as soon as possible, also if that has failed before."""
        found = self._context.archived.get(trace)
        if self._fetching.add(trace, 0 if found is None else found.size):
            self._asked.set()

    def bring(self, traces: Iterable[str], since: float) -> Transfer:
        """Fetches traces. Returns their total progress, or the first failure since that time (s, monotonic).

        Earlier failures, perhaps from a full disk, are tried again.
        """
        traces = list(traces)
        for trace in traces:
            if (failed := self._fetching.failed_since(trace, since)) is not None:
                self._fetching.ended(trace)  # a client that asks again starts a new attempt
                return failed
            before = self._fetching.of(trace)
            if before is None or before.state == "failed":
                self.fetch_now(trace)
        every = [one for trace in traces if (one := self._fetching.of(trace)) is not None]
        trouble = self.health.trouble
        return Transfer(
            direction="fetch",
            state="waiting",
            done=sum(one.done for one in every),
            total=sum(one.total for one in every),
            problem="" if trouble is None else trouble.line,
        )

    def of(self, trace: str) -> TraceArchive:
        """Returns where a trace is. Raises a 404 for a missing trace."""
        path = self._context.catalogue.place_of(trace)
        found = self._context.archived.get(trace)
        return TraceArchive(
            id=trace,
            local=path.is_file(),
            archived=found.archived if found else None,
            checked=found.checked if found else None,
            size=found.size if found else None,
            sha256=found.sha256 if found else None,
            transfer=self._fetching.of(trace) or self._sending.of(trace),
        )

    def status(self) -> ArchiveStatus:
        """Returns the state that the last round found."""
        trouble, limit = self.health.trouble, self._context.settings.keep_size
        return ArchiveStatus(
            place=self._context.bucket.place,
            state="ok" if trouble is None else trouble.state,
            problem="" if trouble is None else trouble.line,
            since=None if trouble is None else trouble.since,
            next_try=None if trouble is None else self.health.wait(),
            archived=self._archived,
            waiting=len(self._sending),
            fetching=len(self._fetching),
            local_bytes=self._local_bytes,
            local_limit=None if limit is None else limit * MB,
        )

    def warnings(self, warn_at: float) -> list[str]:
        """Returns problems that will need a person soon, one line each."""
        status, found = self.status(), []
        if status.problem:
            found.append(f"{status.problem}; {status.waiting} traces wait to be sent, and stay here until then")
        # One line for all of a kind: hundreds would hide the others.
        for failing in (self._attempts.failing, self._unreadable):
            lines = list(failing.copy().values())
            found += [f"{lines[0]}; and {len(lines) - 1} other traces fail"] if len(lines) > 1 else lines
        if self._over:
            found.append(self._over)
        elif status.local_limit is not None and status.local_bytes >= warn_at * status.local_limit:
            size = f"{status.local_bytes / MB:.0f} of {status.local_limit / MB:.0f} MB"
            found.append(
                f"local traces take {size} (archive.keep_size): beyond that the oldest archived ones are dropped"
            )
        return found

    # ---- the threads

    def _loop(self, step: Callable[[], bool], wake: threading.Event) -> None:
        """Calls `step` until it has nothing to do, then waits for `wake`; after a failure, pauses as `health`
        states."""
        while not self._closing.is_set():
            wake.clear()
            pause = ROUND
            try:
                while not self._closing.is_set() and step():
                    pass
            except ArchiveError as error:
                if self.health.failed(error):
                    log.warning("%s", error)
                    self._tell(str(error))
                pause = self.health.wait()
            except (OSError, SQLAlchemyError, DaqError, ProblemError) as error:
                log.warning("archive: %s", " ".join(str(error).split())[:200])
                pause = 60.0
            except Exception:
                log.exception("archive")
                pause = 60.0
            wake.wait(pause)

    def _succeeded(self) -> None:
        self._attempts.answered()
        if self.health.succeeded():
            line = f"archive {self._context.bucket.place}: answers again"
            log.info("%s", line)
            self._tell(line)

    def _tell(self, line: str) -> None:
        with contextlib.suppress(Exception):  # the archive continues without its events
            self._context.tell(line)

    def _round(self) -> bool:
        """Deletes and sends waiting objects, and drops local copies. Returns whether more traces wait to be sent."""
        context = self._context
        if (wait := self.health.wait()) > 0 and self._closing.wait(wait):
            return False
        is_due = context.clock.monotonic() - self._looked >= ROUND
        if is_due:
            for trace in context.archived.to_send(context.robot):
                self._sending.add(trace)
            self._archived = context.archived.count(context.robot)
            self._local_bytes = context.archived.local_size(context.robot)
            self._unreadable.clear()
        self._attempts.begin()
        self._delete_gone()
        self._send_waiting()
        self._attempts.begin_step()
        self._drop_asked()
        limit = self._context.settings.keep_size
        if is_due or (limit is not None and self._local_bytes > limit * MB and not self._over):
            self._drop_by_policy()
        self._attempts.end()
        if is_due:
            self._looked = context.clock.monotonic()
        return self._sending.has_others(self._attempts.failing)

    def _delete_gone(self) -> None:
        """Deletes the objects of deleted traces. A failed deletion delays no other trace."""
        context = self._context
        self._attempts.begin_step()
        gone = context.archived.to_delete(context.robot)
        for one in sorted(gone, key=lambda one: self._attempts.is_doubtful(one.trace)):
            if self._closing.is_set() or self._attempts.is_enough:
                return
            try:
                context.bucket.remove(one.object)
            except ArchiveError as error:
                log.warning("archive: %s is not deleted yet: %s", one.object, error)
                self._attempts.failed(one.trace, error)
                continue
            context.archived.forget(one.trace)
            self._attempts.forget(one.trace)
            self._succeeded()

    def _send_waiting(self) -> None:
        """Sends waiting traces. A trace that cannot be sent goes to the end of the queue."""
        self._attempts.begin_step()
        for _ in range(SENT_A_ROUND):
            waiting = self._sending.first()
            if waiting is None or self._attempts.has_failed(waiting):
                return
            if self._closing.is_set() or self._attempts.is_enough:
                return
            try:
                self._send_one(waiting)
            except ArchiveError as error:
                self._attempts.failed(waiting, error)
            else:
                self._attempts.forget(waiting)

    def _send_one(self, trace: str) -> None:
        context = self._context
        local = context.archived.local(trace)
        if local is None or context.archived.get(trace) is not None:
            self._sending.ended(trace)
            return
        path = context.catalogue.folder / local.file
        try:
            found = _content(path)
            name = object_name(context.settings.prefix, context.robot, local.file, local.created, found.sha256)
            self._sending.moved(trace, 0, found.size)
            context.bucket.send(name, path, lambda done: self._sending.moved(trace, done, found.size))
            self._require_same(name, found)  # also if the file has changed meanwhile
        except OSError as error:
            line = f"{path.name}: cannot be read: {disk.reason(error)}"
            log.warning("archive: %s: not sent", line)
            self._unreadable[trace] = f"{line}; it is not archived: look at the disk of the traces"
            self._sending.ended(trace, line)
            return
        except ArchiveError as error:
            context.count("send", "failed", 0)
            self._sending.held_up(trace, str(error))
            raise
        now = context.clock.utc()
        context.archived.add(Archived(trace, context.robot, name, found.size, found.sha256, now, now))
        self._sending.ended(trace)
        self._unreadable.pop(trace, None)
        context.count("send", "done", found.size)
        self._archived += 1
        self._local_bytes += found.size
        self._succeeded()

    def _require_same(self, name: str, wanted: Content) -> None:
        """Reads an object back. Raises DamagedError if it differs from the file that was sent."""
        if self._context.bucket.read(name, wanted.size, lambda _piece: None) != wanted:
            line = f"archive {self._context.bucket.place}: {name}: differs from the file that was sent (SHA-256)"
            raise DamagedError(line)

    def _require_still_there(self, found: Archived, now: datetime) -> None:
        """Raises DamagedError unless the archive still has the same object; reads it back if the last time was long
        ago."""
        if now - found.checked > CHECKED_LATELY:
            self._require_same(found.object, Content(found.size, found.sha256))
            self._context.archived.note(found.trace, checked=now)
        elif self._context.bucket.size_of(found.object) != found.size:
            raise DamagedError(f"archive {self._context.bucket.place}: {found.object} has another size")

    def _fetch_next(self) -> bool:
        trace = self._fetching.first()
        if trace is None:
            return False
        context = self._context
        found = context.archived.get(trace)
        if found is None:
            self._end_fetch(trace, f"the archive does not have trace {trace} any more")
            return True
        try:
            self._fetch_one(found)
        except (DamagedError, RefusedError) as error:  # another attempt does not help
            self._end_fetch(trace, str(error))
            if isinstance(error, RefusedError):
                raise
        except ArchiveError as error:
            context.count("fetch", "failed", 0)
            self._fetching.held_up(trace, str(error))
            raise
        except OSError as error:
            self._end_fetch(trace, f"{context.catalogue.folder}: {disk.reason(error)}")
        except ProblemError as error:  # no room, or the trace has been deleted
            self._end_fetch(trace, error.detail)
        else:
            context.count("fetch", "done", found.size)
            self._fetching.ended(trace)
            self._succeeded()
            context.fetched()
        return True

    def _end_fetch(self, trace: str, problem: str) -> None:
        log.warning("archive: trace %s is not fetched: %s", trace, problem)
        self._context.count("fetch", "failed", 0)
        self._fetching.ended(trace, problem)
        self._context.fetched()

    def _fetch_one(self, wanted: Archived) -> None:
        """Fetches a trace into the folder, compared with the file that was sent. Raises ArchiveError, ProblemError,
        OSError."""
        context = self._context
        folder = context.catalogue.folder
        free = shutil.disk_usage(folder).free
        if free < wanted.size + RESERVE:
            needed = (wanted.size + RESERVE) / MB
            line = f"{folder}: {free / MB:.0f} MB are free, fetching needs {needed:.0f} MB"
            raise ProblemError(507, "no-room", line, "free some space on the disk of the traces")
        with tempfile.TemporaryDirectory(prefix=UPLOAD, dir=folder) as beside:
            part = Path(beside) / "fetched.mcap"
            # A difference may be due to the transfer: a second attempt shows.
            if not any(self._read_into(part, wanted) for _attempt in range(2)):
                line = f"archive {context.bucket.place}: {wanted.object} differs from the file that was sent (SHA-256)"
                raise DamagedError(line)
            context.catalogue.take_back(wanted.trace, part)
        context.archived.note(wanted.trace, fetched=context.clock.utc())
        self._local_bytes += wanted.size

    def _read_into(self, part: Path, wanted: Archived) -> bool:
        """Fetches an object into a file, and returns whether it is the one that was sent. Raises ArchiveError,
        OSError."""
        with part.open("wb") as stream:

            def take(piece: bytes) -> None:
                if self._closing.is_set():
                    raise ArchiveError("the service is ending")
                stream.write(piece)

            def tell(done: int) -> None:
                self._fetching.moved(wanted.trace, done, wanted.size)

            found = self._context.bucket.read(wanted.object, wanted.size, take, tell)
            disk.sync(stream)
        return found.sha256 == wanted.sha256

    # ---- local copies

    def _drop_asked(self) -> None:
        for trace in list(self._drops):
            local = self._context.archived.local(trace)
            if local is None or self._drop(local):
                self._drops.discard(trace)
            if self._attempts.is_enough:
                return

    def _drop_by_policy(self) -> None:
        """Drops local copies that are too old, then the oldest while all of them take too much space."""
        context, settings = self._context, self._context.settings
        self._over = ""
        if settings.keep_days is not None:
            old = context.clock.utc() - timedelta(days=settings.keep_days)
            self._drop_some(lambda _size: True, before=old)
            self._local_bytes = context.archived.local_size(context.robot)
        if settings.keep_size is not None and self._local_bytes > (limit := settings.keep_size * MB):
            self._drop_some(lambda size: size > limit)
            self._local_bytes = context.archived.local_size(context.robot)
            if self._local_bytes > limit and not self._attempts.has_failures:  # otherwise the store is the reason
                size = f"{self._local_bytes / MB:.0f} of {limit / MB:.0f} MB"
                why = "models and jobs refer to the others" if settings.keep_used else "the others are in use"
                self._over = f"local traces take {size} (archive.keep_size), and no more can be dropped: {why}"

    def _drop_some(self, is_wanted: Callable[[int], bool], before: datetime | None = None) -> None:
        """Drops the oldest copies while `is_wanted` of the remaining total size is true."""
        context, size = self._context, self._local_bytes
        last: Local | None = None
        while is_wanted(size) and not self._closing.is_set():
            keep_used = context.settings.keep_used
            part = context.archived.droppable(context.robot, keep_used=keep_used, before=before, after=last)
            if not part:
                return
            for local in part:
                if not is_wanted(size) or self._closing.is_set() or self._attempts.is_enough:
                    return
                size -= local.size if self._drop(local) else 0
                last = local

    def _drop(self, local: Local) -> bool:
        """Deletes a local copy, after the archive has proved that it has the same. Returns False if the copy stays for
        any reason."""
        path = self._context.catalogue.folder / local.file
        try:
            is_dropped = self._dropped(local)
        except ArchiveError as error:
            log.warning("archive: %s stays: %s", path, error)
            self._attempts.failed(local.trace, error)
            return False
        except OSError as error:
            line = f"{path.name}: cannot be dropped: {disk.reason(error)}; look at the disk of the traces"
            log.warning("archive: %s", line)
            self._unreadable[local.trace] = line
            return False
        self._attempts.forget(local.trace)
        self._unreadable.pop(local.trace, None)
        return is_dropped

    def _dropped(self, local: Local) -> bool:
        """Does this, and raises ArchiveError, OSError."""
        context = self._context
        found = context.archived.get(local.trace)
        path = context.catalogue.folder / local.file
        if found is None or not path.is_file():
            return False
        if _content(path) != Content(found.size, found.sha256):
            log.warning("archive: %s is not what was archived: it is sent again", path)
            context.archived.forget(local.trace)
            self.send(local.trace)
            return False
        now = context.clock.utc()
        try:
            self._require_still_there(found, now)
        except DamagedError as error:  # the local copy is the only one: it is sent again
            log.warning("%s", error)
            self._tell(f"{error}; the local copy stays, and is sent again")
            context.archived.forget(local.trace)
            self.send(local.trace)
            return False
        self._succeeded()
        if not context.catalogue.drop(local.trace, lambda: not context.archived.is_at_work(local.trace)):
            return False
        log.info("archive: dropped %s: the archive has it", path)
        self._local_bytes -= local.size
        return True


def words_of(transfer: Transfer | None) -> str:
    """Returns the progress of a transfer, in words."""
    if transfer is None:
        return "waiting"
    if transfer.problem:
        return transfer.problem
    return f"{transfer.done / MB:.1f} of {transfer.total / MB:.1f} MB"


def _content(path: Path) -> Content:
    """Reads a file. Raises OSError."""
    digest, size = hashlib.sha256(), 0
    with disk.open_regular(path) as stream:
        while piece := stream.read(PIECE):
            digest.update(piece)
            size += len(piece)
    return Content(size, digest.hexdigest())
