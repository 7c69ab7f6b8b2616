"""Transactions in lock-step: host and controller take turns, independent of this machine's clocks."""

from __future__ import annotations

import re
import threading
from collections.abc import Sequence

from daq.link.connection import Connection
from daq.link.errors import LinkError, LinkTimeoutError
from daq.link.pending import Transaction
from daq.link.timed_exchange import no_reply
from daq.link.timing import LOCK_STEP_WATCHDOG_S, copies_of
from firmware_protocol.commands import Advance
from firmware_protocol.dialect import IDLE_MARK
from firmware_protocol.message import Request

_BETWEEN_ZEROS = re.compile(rb"[^\0]+")


class TurnExchange:
    """The controller answers each frame with all its replies, and then IDLE_MARK.

    A request has timed out if all frames have had their marks and it has no reply. The controller's time is then
    advanced by the wait that real time would have taken, and the request is written again. So faults cost the same time
    as in reality, and every run is reproducible to the bit. A second thread, for example with a stop, has its turn
    after the current one, at the same controller time.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._turn = threading.Lock()

    def run(self, requests: Sequence[Request], before_stop: int | None = None) -> list[Transaction]:
        """Writes `requests` together and returns once all have replies.

        Raises LinkTimeoutError, LinkLostError, ProtocolError; StopCameFirstError as `Connection.begin` does.
        """
        connection = self._connection
        with self._turn:
            transactions = connection.begin(requests, before_stop)
            try:
                self._listen(requests)
                while waiting := [transaction for transaction in transactions if transaction.reply is None]:
                    self._ask_again(waiting)
            except LinkError as error:
                error.sent = True
                raise
            finally:
                connection.forget(transactions)
        return transactions

    def _ask_again(self, waiting: Sequence[Transaction]) -> None:
        connection = self._connection
        connection.tally.count("timeouts", len(waiting))
        for transaction in waiting:
            if transaction.written > connection.timing.retries_of(transaction.request):
                raise LinkTimeoutError(no_reply(connection, transaction))
        requests = [transaction.request for transaction in waiting]
        waited_s = min(connection.timing.reply_timeout_s(request, 0) for request in requests)
        # No newer Advance may precede a repeated one: the repeat would be refused as stale.
        advances = any(isinstance(request, Advance) for request in requests)
        wait = [] if advances else [Advance(round(waited_s * 1e6))]
        passed = connection.repeat(waiting, ahead=wait)
        try:
            self._listen([*wait, *requests])
        finally:
            connection.forget(passed)

    def _listen(self, written: Sequence[Request]) -> None:
        """Reads until the last mark that the controller owes for `written`."""
        owed = sum(copies_of(request) for request in written)
        marks = MarkCounter()
        while marks.seen < owed:
            data = self._connection.receive(LOCK_STEP_WATCHDOG_S)
            if not data:
                why = f"{self._connection.description}: silent for {LOCK_STEP_WATCHDOG_S} s in the middle of a turn"
                raise self._connection.fail(why)
            marks.feed(data)


class MarkCounter:
    """Counts idle marks in a stream: a run of n zeros contains n // 4, since frames add at most two zeros to a run."""

    def __init__(self) -> None:
        self.seen = 0
        self._run = 0

    def feed(self, data: bytes) -> None:
        """Reads the next bytes; the result does not depend on how they were split."""
        pieces = _BETWEEN_ZEROS.split(data)
        for index, zeros in enumerate(pieces):
            self._run = len(zeros) if index else self._run + len(zeros)
            whole = self._run // len(IDLE_MARK)
            self.seen += whole
            self._run -= whole * len(IDLE_MARK)
