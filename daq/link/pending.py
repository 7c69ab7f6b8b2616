"""Requests that wait for replies: assigns numbers, matches replies, drops and counts all others.

Pure bookkeeping without a clock, a lock or a channel; `Connection` guards it with its lock.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from daq.link.counters import Tally
from daq.link.timing import reply_opcode
from firmware_protocol.commands import NO_SESSION, PROTOCOL_VERSION, Hello, HelloReply, Refused
from firmware_protocol.message import Reply, Request

SEQUENCE_NUMBERS = 0x10000
REMEMBERED = 256
"""Number of answered requests that are remembered, so that a second reply counts as duplicate and not as stale."""


@dataclass(eq=False)
class Transaction:
    """One request under way: its number, how often it was written, when the last wait ends, and its reply."""

    request: Request
    sequence: int
    written: int = 0
    written_at: float = 0.0
    deadline: float = 0.0
    frame: bytes = b""
    """The bytes as first written; a repeat sends the same."""
    reply: Reply | None = None
    answered_at: float = 0.0


@dataclass
class PendingReplies:
    """The waiting transactions, by sequence number."""

    tally: Tally
    first: int = 0
    """The first sequence number."""
    _waiting: dict[int, Transaction] = field(default_factory=dict)
    _answered: deque[tuple[int, int]] = field(default_factory=lambda: deque(maxlen=REMEMBERED))
    _next: int = field(init=False)

    def __post_init__(self) -> None:
        self._next = self.first % SEQUENCE_NUMBERS

    def begin(self, request: Request) -> Transaction:
        """Starts a transaction with the next free sequence number."""
        while self._next in self._waiting:
            self._next = (self._next + 1) % SEQUENCE_NUMBERS
        transaction = Transaction(request, self._next)
        self._waiting[self._next] = transaction
        self._next = (self._next + 1) % SEQUENCE_NUMBERS
        self.tally.count("requests")
        return transaction

    def match(self, sequence: int, reply: Reply, now: float) -> Transaction | None:
        """Returns the transaction that `reply` completes. A reply without a waiting request is counted, and gives
        None."""
        transaction = self._waiting.get(sequence)
        if transaction is None or not _answers(reply, transaction.request):
            opcode = reply.opcode if isinstance(reply, Refused) else reply.OPCODE & 0x7F
            self.tally.count("duplicates" if (sequence, opcode) in self._answered else "stale")
            return None
        transaction.reply = reply
        transaction.answered_at = now
        self.forget(transaction)
        self._answered.append((sequence, transaction.request.OPCODE))
        return transaction

    def forget(self, transaction: Transaction) -> None:
        """Stops waiting for a transaction: a later reply is stale."""
        self._waiting.pop(transaction.sequence, None)


def _answers(reply: Reply, request: Request) -> bool:
    if isinstance(reply, Refused):
        return reply.opcode == request.OPCODE
    if isinstance(reply, HelloReply) and isinstance(request, Hello):
        # A replayed reply carries another nonce; a bridge of another version sends none.
        if reply.session == NO_SESSION:
            return reply.version != PROTOCOL_VERSION
        return reply.nonce == request.nonce
    return reply_opcode(request) == reply.OPCODE
