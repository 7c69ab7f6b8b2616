"""Transactions in real time: one waiting thread reads for all, and each thread repeats its own request after a
time-out."""

from __future__ import annotations

from collections.abc import Sequence

from daq.link.connection import Connection
from daq.link.errors import LinkError, LinkTimeoutError
from daq.link.pending import Transaction
from daq.transport.holders import shared_port_advice
from firmware_protocol.commands import Stop
from firmware_protocol.message import Request


class TimedExchange:
    """Lets any number of threads wait. One of them reads and passes the others their replies.

    There is no separate reading thread. A reply then wakes only the thread that waits for it, which saves a thread
    switch per round trip, and no thread is left running.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._reading = False
        self._followers = 0

    def run(self, requests: Sequence[Request], before_stop: int | None = None) -> list[Transaction]:
        """Writes `requests` together and returns once all have replies.

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
    """Returns a line about a request that was never answered."""
    name = type(transaction.request).__name__
    why = connection.complaint or "is the controller on, and are port and baud rate the right ones?"
    if not isinstance(transaction.request, Stop):  # searching for other programs takes time, which a stop does not have
        why += shared_port_advice(connection.description)
    return f"{connection.description}: no reply to {name}, asked {transaction.written} times: {why}"
