"""One channel with its dialect: sends numbered requests, receives replies, and stores why the channel ended."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from contextlib import suppress

from daq.link.counters import Tally
from daq.link.errors import LinkLostError, StopCameFirstError
from daq.link.pending import PendingReplies, Transaction
from daq.link.timing import LinkTiming, copies_of
from daq.transport import ByteChannel, ChannelError
from firmware_protocol.commands import MoveAndSample, Sample, Stop
from firmware_protocol.dialect import LinkDialect
from firmware_protocol.message import Request


class Connection:
    """A connection, shared by all threads that use one controller.

    `changed` guards everything except writing, and is notified when a reply has come or the channel has ended. A
    dialect has a lock of its own. The write lock is held for one write only, so that a stop never waits for another
    thread's reply. Numbers are assigned under it, so requests are sent in the order of their numbers.
    """

    def __init__(
        self,
        channel: ByteChannel,
        dialect: LinkDialect,
        timing: LinkTiming,
        tally: Tally,
        now: Callable[[], float],
        first_number: int = 0,
    ) -> None:
        self.now = now
        self.timing = timing
        self.tally = tally
        self.changed = threading.Condition(threading.Lock())
        self._channel = channel
        self._dialect = dialect
        self._pending = PendingReplies(tally, first_number)
        self._write_lock = threading.Lock()
        self._dialect_lock = threading.Lock()
        self._failure: str | None = None
        self.stops = 0
        """Number of stops written so far, by all threads."""

    @property
    def damaged(self) -> int:
        """Pieces of input that are not a whole reply."""
        return self._dialect.damaged

    @property
    def description(self) -> str:
        """Names the endpoint of the channel."""
        return self._channel.description

    @property
    def complaint(self) -> str:
        """The dialect's explanation why a request has no reply; empty if there is none."""
        return self._dialect.complaint

    @property
    def failure(self) -> str | None:
        """Why the channel ended; None while it is open."""
        return self._failure

    def begin(self, requests: Sequence[Request], before_stop: int | None = None) -> list[Transaction]:
        """Writes new requests, all in one write. Raises LinkLostError; ProtocolError if a frame cannot carry a request.

        before_stop: number of stops written when these requests were allowed. Raises StopCameFirstError, and writes
            nothing, if another stop has been written since. This check is made last, under the write lock.
        """
        with self._write_lock:
            self.check()
            if before_stop is not None and before_stop != self.stops:
                raise StopCameFirstError
            self.stops += any(isinstance(request, Stop) for request in requests)
            with self.changed:
                transactions = [self._pending.begin(request) for request in requests]
            try:
                self._write(transactions)
            except BaseException:
                self.forget(transactions)
                raise
        return transactions

    def repeat(self, transactions: Sequence[Transaction], ahead: Sequence[Request] = ()) -> list[Transaction]:
        """Writes requests again under their numbers, after the new requests `ahead`, and returns the latter. Raises
        LinkLostError."""
        with self._write_lock:
            self.check()
            self.tally.count("retries", len(transactions))
            with self.changed:
                first = [self._pending.begin(request) for request in ahead]
            self._write([*first, *transactions])
        return first

    def receive(self, timeout_s: float) -> bytes:
        """Reads the bytes that have arrived and matches the replies. One thread at a time. Raises LinkLostError."""
        try:
            data = self._channel.read(timeout_s)
        except ChannelError as error:
            raise self.fail(str(error)) from error
        if data:
            with self._dialect_lock:
                replies = self._dialect.feed(data)
                answer = b"" if self._dialect.scale.half_duplex else self._dialect.answer()
            now = self.now()
            with self.changed:
                for sequence, reply in replies:
                    transaction = self._pending.match(sequence, reply, now)
                    if transaction is not None:
                        self._note_round_trip(transaction)
            if self._dialect.scale.half_duplex:
                with self._write_lock:  # a stop may have been written meanwhile, which ends the steps of a release
                    with self._dialect_lock:
                        answer = self._dialect.answer()
                    if answer:
                        self._send(answer)
            elif answer:
                with self._write_lock:
                    self._send(answer)
        return data

    def forget(self, transactions: Sequence[Transaction]) -> None:
        """Stops waiting for those transactions that still have no reply."""
        given_up = [transaction.sequence for transaction in transactions if transaction.reply is None]
        if given_up:
            with self._dialect_lock:
                for sequence in given_up:
                    self._dialect.forget(sequence)
        with self.changed:
            for transaction in transactions:
                self._pending.forget(transaction)

    def fail(self, why: str) -> LinkLostError:
        """Ends the channel and wakes every waiting thread. Returns the error to raise."""
        if self._failure is None:
            self._failure = why
        self._channel.close()
        with self.changed:
            self.changed.notify_all()
        return LinkLostError(self._failure)

    def replace(self, channel: ByteChannel) -> None:
        """Continues on a new channel after a failure, without a session. Sequence numbers continue too, so that no old
        reply is taken for a new one."""
        with self._write_lock, self.changed:
            with self._dialect_lock:
                self._dialect.reset()
            self._channel = channel
            self._failure = None

    def close(self) -> None:
        """Closes the channel for good."""
        if self._failure is None:
            with self._dialect_lock:
                last = self._dialect.farewell()
            if last:
                with self._write_lock, suppress(ChannelError):
                    self._channel.write(last)
        self.fail(f"{self.description}: closed")

    def check(self) -> None:
        """Raises LinkLostError if the channel has ended."""
        if self._failure is not None:
            raise LinkLostError(self._failure)

    def _write(self, transactions: Sequence[Transaction]) -> None:
        frames = b""
        now = self.now()
        for transaction in transactions:
            request = transaction.request
            with self._dialect_lock:
                if transaction.frame:
                    frame = self._dialect.again(request, transaction.frame)
                else:
                    frame = transaction.frame = self._dialect.encode(transaction.sequence, request)
            frames += frame * (1 if self._dialect.scale.half_duplex else copies_of(request))
            transaction.written += 1
            transaction.written_at = now
            wait = self.timing.reply_timeout_s(request, len(frames))
            transaction.deadline = now + wait + self.timing.shared_wire_s(request, self._dialect.scale)
        self._send(frames)

    def _send(self, data: bytes) -> None:
        try:
            self._channel.write(data)
        except ChannelError as error:
            raise self.fail(str(error)) from error

    def _note_round_trip(self, transaction: Transaction) -> None:
        # If a request was repeated, it is unknown which copy was answered. A sample waits for its tick.
        if (
            self.timing.measured
            and transaction.written == 1
            and not isinstance(transaction.request, Sample | MoveAndSample)
        ):
            self.tally.round_trip(transaction.answered_at - transaction.written_at)
