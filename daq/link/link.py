"""The link to a controller: requests in, replies out, with lost or damaged bytes made good by repetition."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum
from random import Random, SystemRandom
from typing import Protocol, Self, TypeVar

from daq.link.connection import Connection
from daq.link.counters import LinkCounters, Mark, Tally
from daq.link.dialects import dialect_of
from daq.link.errors import LinkError, LinkLostError, RequestRefusedError
from daq.link.timed_exchange import TimedExchange
from daq.link.timing import CLEAN_TRANSACTIONS, LinkTiming
from daq.link.turn_exchange import TurnExchange
from daq.transport import Endpoint, ReconnectDelay, TransportError, open_endpoint
from firmware_protocol.commands import (
    PROTOCOL_VERSION,
    Advance,
    Advanced,
    ExplainedRefusal,
    Hello,
    HelloReply,
    Refused,
    Reply,
    Request,
    Stop,
    Stopped,
)
from firmware_protocol.dialect import FramedDialect, LinkDialect

R = TypeVar("R", bound=Reply)


class LinkState(StrEnum):
    """Quality of the connection to the controller."""

    CONNECTED = "connected"
    DEGRADED = "degraded"
    """Requests had to be repeated lately."""
    LOST = "lost"
    """The channel has ended, or the last request was never answered."""


class Wait(Protocol):
    """What `reconnect` waits with; `threading.Event` is one."""

    def wait(self, timeout: float) -> bool:
        """Waits; True ends the attempts."""
        ...


class Link:
    """Transactions with one controller, from any thread.

    Requests that are written together are answered in order and cost one round trip. A request is repeated with its
    number until it is answered or its budget is used up, and then the link is lost. `stop` goes ahead of everything
    that is not yet written.

    `scale` is what the line's dialect can say of its machine. `chance` draws the first sequence number and, except in
    lock-step, the nonces of `Hello`.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        dialect: LinkDialect | None = None,
        now: Callable[[], float] = time.monotonic,
        chance: Random | None = None,
    ) -> None:
        # In lock-step a run repeats to the bit.
        self._chance = chance or (Random(0) if endpoint.lock_step else SystemRandom())
        self.tally = Tally()
        self._endpoint = endpoint
        timing = LinkTiming(endpoint.bytes_per_second, measured=not endpoint.lock_step)
        dialect = dialect or FramedDialect()
        self.scale = dialect.scale
        self._connection = Connection(
            endpoint.connect(), dialect, timing, self.tally, now, self._chance.getrandbits(16)
        )
        self._exchange = TurnExchange(self._connection) if endpoint.lock_step else TimedExchange(self._connection)
        self._clean = CLEAN_TRANSACTIONS
        self._unanswered = False
        self._now = now

    @classmethod
    def open(cls, url: str, dialect: LinkDialect | None = None) -> Self:
        """A link to the controller at a port URL, in the dialect that the URL names; nothing is sent. Raises
        TransportError."""
        dialect = dialect or dialect_of(url)
        endpoint = open_endpoint(url)
        try:
            return cls(endpoint, dialect)
        except BaseException:
            endpoint.close()
            raise

    @property
    def url(self) -> str:
        """Port URL as the user wrote it."""
        return self._endpoint.url

    @property
    def control(self) -> str | None:
        """URL of the mock's control port; None for anything but mock://."""
        return self._endpoint.control

    @property
    def bytes_per_second(self) -> float:
        """Capacity of the line in each direction; infinite where nothing limits it."""
        return self._endpoint.bytes_per_second

    def waited(self) -> float:
        """Time (s) for which the clock of a mock's board has stood still, since the mock got no processor; else 0."""
        return self._endpoint.waited()

    @property
    def lock_step(self) -> bool:
        """Whether the controller's time stands still between requests."""
        return self._endpoint.lock_step

    @property
    def state(self) -> LinkState:
        """Present quality of the connection."""
        if self._connection.failure is not None or self._unanswered:
            return LinkState.LOST
        return LinkState.CONNECTED if self._clean >= CLEAN_TRANSACTIONS else LinkState.DEGRADED

    @property
    def counters(self) -> LinkCounters:
        """Everything counted so far."""
        return self.tally.snapshot(self._connection.damaged)

    @property
    def complaint(self) -> str:
        """What is known about a controller that does not do what it is asked, for people; empty where nothing is."""
        return self._connection.complaint

    def mark(self) -> Mark:
        """The counts now, for `counters_since`."""
        return self.tally.mark(self._connection.damaged)

    def counters_since(self, mark: Mark) -> LinkCounters:
        """The counts since that mark."""
        return self.tally.snapshot(self._connection.damaged, mark)

    def set_period(self, period_s: float) -> None:
        """Tells the control period, for which `Sample` may have to wait."""
        self._connection.timing = replace(self._connection.timing, period_s=period_s)

    @property
    def stops(self) -> int:
        """Stops that were written so far. What is allowed now is given this number (`before_stop`), so that it is not
        written behind a stop of another thread."""
        return self._connection.stops

    def request(self, request: Request, reply: type[R], before_stop: int | None = None) -> R:
        """The reply to one request. Raises RequestRefusedError, LinkTimeoutError, LinkLostError, ProtocolError, and
        StopCameFirstError if `before_stop` is not the number of `stops` any more."""
        (answer,) = self.exchange(request, before_stop=before_stop)
        return expect(request, answer, reply)

    def exchange(self, *requests: Request, before_stop: int | None = None) -> tuple[Reply, ...]:
        """The replies to requests written together, in their order; a refusal is a reply.

        Raises LinkTimeoutError when one of them is never answered, LinkLostError; ProtocolError for a wrong value;
        StopCameFirstError as `request` does.
        """
        return self.exchange_timed(*requests, before_stop=before_stop)[0]

    def exchange_timed(
        self, *requests: Request, before_stop: int | None = None
    ) -> tuple[tuple[Reply, ...], tuple[float, ...]]:
        """The same, with the time (s) from its begin to each reply."""
        begun = self._now()
        try:
            transactions = self._exchange.run(requests, before_stop)
        except LinkError:
            self._unanswered = True
            raise
        self._unanswered = False
        at_once = all(transaction.written == 1 for transaction in transactions)
        self._clean = self._clean + 1 if at_once else 0
        replies = tuple(transaction.reply for transaction in transactions if transaction.reply is not None)
        refused = sum(isinstance(reply, Refused) for reply in replies)
        if refused:
            self.tally.count("refused", refused)
        return replies, tuple(transaction.answered_at - begun for transaction in transactions)

    def greet(self) -> HelloReply:
        """Begins a session, without which no command is obeyed. Moves nothing.

        Raises RequestRefusedError where the controller speaks version 1, LinkTimeoutError, LinkLostError.
        """
        return self.request(Hello(PROTOCOL_VERSION, self._nonce()), HelloReply)

    def _nonce(self) -> int:
        """A different one for each `Hello`; in lock-step the controller's own time, so that a run repeats to the
        bit."""
        if self.lock_step:
            with contextlib.suppress(RequestRefusedError):
                return self.request(Advance(0), Advanced).time_us & 0xFFFFFFFF
        return self._chance.getrandbits(32)

    def stop(self) -> Stopped:
        """Freezes the arm. Written twice at once, ahead of all that waits. Raises LinkTimeoutError, LinkLostError."""
        return self.request(Stop(), Stopped)

    def reconnect(self, wait: Wait | None = None, delay: ReconnectDelay | None = None) -> None:
        """Opens a new channel after a lost one, again and again until it succeeds or `wait.wait` returns True.

        Nothing is sent over it: what was under way has failed, and only the caller may start motion again.
        Raises LinkLostError when the wait was ended.
        """
        pause = wait or threading.Event()
        self._connection.fail("connection given up in order to connect again")
        error = "not tried"
        for seconds in (delay or ReconnectDelay()).delays():
            if pause.wait(seconds):
                break
            try:
                channel = self._endpoint.connect()
            except TransportError as reason:
                error = str(reason)
                continue
            self._connection.replace(channel)
            self.tally.count("reconnections")
            self._unanswered = False
            self._clean = 0
            return
        raise LinkLostError(f"not connected again: {error}")

    def close(self) -> None:
        """Ends the channel, and the mock's process where there is one. May be called twice."""
        self._connection.close()
        self._endpoint.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Link({self.url}, {self.state})"


def expect(request: Request, reply: Reply, kind: type[R]) -> R:
    """`reply` as the kind that answers `request`. Raises RequestRefusedError for a refusal."""
    if isinstance(reply, Refused):
        why = reply.why if isinstance(reply, ExplainedRefusal) else ""
        raise RequestRefusedError(type(request).__name__, reply.reason, why)
    assert isinstance(reply, kind)
    return reply
