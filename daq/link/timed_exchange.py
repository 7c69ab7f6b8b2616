"""Transactions in real time: one waiting thread reads for all, and each repeats its request after its time-out."""

from __future__ import annotations

from collections.abc import Sequence

from daq.link.connection import Connection
from daq.link.errors import LinkError, LinkTimeoutError
from daq.link.pending import Transaction
from daq.transport.holders import shared_port_advice
from firmware_protocol.commands import Request, Stop


class TimedExchange:
    """Any number of threads may wait at once. One of them reads and hands the others their replies.

    No thread of its own: a reply that comes while one thread waits wakes that thread and no other, which saves a
    change of threads a round trip, and nothing is left running.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._reading = False
        self._followers = 0

    def run(self, requests: Sequence[Request], before_stop: int | None = None) -> list[Transaction]:
        """Writes `requests` together, returns when all have replies.

        Raises LinkTimeoutError, LinkLostError, ProtocolError; StopCameFirstError as `Connection.begin` does.
        """
        transactions = self._connection.begin(requests, before_stop)
        try:
            while waiting := self._unanswered(transactions):
                now = self._connection.now()
                expired = [transaction for transaction in waiting if transaction.deadline <= now]
                if expired:
                    self._ask_again(expired)
                else:
                    self._wait(waiting, min(transaction.deadline for transaction in waiting) - now)
        except LinkError as error:
            error.sent = True
            raise
        finally:
            self._connection.forget(transactions)
        return transactions

    @staticmethod
    def _unanswered(transactions: Sequence[Transaction]) -> list[Transaction]:
        return [transaction for transaction in transactions if transaction.reply is None]

    def _wait(self, waiting: Sequence[Transaction], timeout_s: float) -> None:
        """Returns after the next arrival, or after `timeout_s`."""
        connection = self._connection
        with connection.changed:
            connection.check()
            if len(self._unanswered(waiting)) < len(waiting):
                return
            if self._reading:
                self._followers += 1
                connection.changed.wait(timeout_s)
                self._followers -= 1
                return
            self._reading = True
        try:
            connection.receive(timeout_s)
        finally:
            with connection.changed:
                self._reading = False
                if self._followers:
                    connection.changed.notify_all()

    def _ask_again(self, expired: Sequence[Transaction]) -> None:
        connection = self._connection
        connection.tally.count("timeouts", len(expired))
        for transaction in expired:
            if transaction.written > connection.timing.retries_of(transaction.request):
                raise LinkTimeoutError(no_reply(connection, transaction))
        connection.repeat(expired)


def no_reply(connection: Connection, transaction: Transaction) -> str:
    """One line about a request that was never answered."""
    name = type(transaction.request).__name__
    why = connection.complaint or "is the controller on, and are port and baud rate the right ones?"
    if not isinstance(transaction.request, Stop):  # looking for other programs takes a moment, which no stop has
        why += shared_port_advice(connection.description)
    return f"{connection.description}: no reply to {name}, asked {transaction.written} times: {why}"
