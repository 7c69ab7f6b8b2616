"""The link to a controller: sends requests, receives replies, and repeats whatever was lost or damaged."""

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
from daq.link.driver_line import driver_line
from daq.link.errors import LinkError, LinkLostError, RequestRefusedError
from daq.link.timed_exchange import TimedExchange
from daq.link.timing import CLEAN_TRANSACTIONS, LinkTiming
from daq.link.turn_exchange import TurnExchange
from daq.transport import DriverPort, Endpoint, ReconnectDelay, TransportError, open_endpoint, parse_port_url
from firmware_protocol.commands import (
    PROTOCOL_VERSION,
    Advance,
    Advanced,
    ExplainedRefusal,
    Hello,
    HelloReply,
    Refused,
    Stop,
    Stopped,
)
from firmware_protocol.dialect import FramedDialect, LinkDialect
from firmware_protocol.message import Reply, Request

R = TypeVar("R", bound=Reply)


class LinkState(StrEnum):
    """Quality of the connection to the controller."""

    CONNECTED = "connected"
    DEGRADED = "degraded"
    """Requests had to be repeated recently."""
    LOST = "lost"
    """The channel has ended, or the last request was never answered."""


class Wait(Protocol):
    """Waiting function of `reconnect`; `threading.Event` has it."""

    def wait(self, timeout: float) -> bool:
        """Waits `timeout` s; True ends the attempts."""
        ...


class Link:
    """Transactions with one controller, from any thread.

    Requests that are written together are answered in order and take one round trip. A request is repeated under its
    number until it is answered. Once its repetitions are used up, the link is lost. `stop` overtakes every request that
    is not yet written.

    `scale`: properties of the machine that the dialect knows. `chance`: source of the first sequence number and, except
    in lock-step, of the nonces of `Hello`.
    """

    def __init__(
        self,
        endpoint: Endpoint,
        dialect: LinkDialect | None = None,
        now: Callable[[], float] = time.monotonic,
        chance: Random | None = None,
    ) -> None:
        # In lock-step, runs are reproducible to the bit.
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
        """Opens a link to the controller at a port URL, in the dialect that the URL names. Sends nothing. Raises
        TransportError."""
        port = parse_port_url(url)
        if isinstance(port, DriverPort):
            line = driver_line(url, port)
            return cls(line, line)
        dialect = dialect or dialect_of(url)
        endpoint = open_endpoint(url)
        try:
            return cls(endpoint, dialect)
        except BaseException:
            endpoint.close()
            raise

    @property
    def url(self) -> str:
        """Port URL as given by the user."""
        return self._endpoint.url

    @property
    def control(self) -> str | None:
        """URL of the mock's control port; None for all but mock://."""
        return self._endpoint.control

    @property
    def bytes_per_second(self) -> float:
        """Capacity of the line in each direction; infinite without a limit."""
        return self._endpoint.bytes_per_second

    def waited(self) -> float:
        """Time (s) for which the clock of a mock's board has stood still because the mock got no processor time; else
        0."""
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
        """All counts so far."""
        return self.tally.snapshot(self._connection.damaged)

    @property
    def complaint(self) -> str:
        """Explanation, for people, of a controller that does not respond as requested; empty if none is known."""
        return self._connection.complaint

    def mark(self) -> Mark:
        """The present counts, for `counters_since`."""
        return self.tally.mark(self._connection.damaged)

    def counters_since(self, mark: Mark) -> LinkCounters:
        """The counts since this mark."""
        return self.tally.snapshot(self._connection.damaged, mark)

    def set_period(self, period_s: float) -> None:
        """Sets the control period (s): `Sample` may wait for as long."""
        self._connection.timing = replace(self._connection.timing, period_s=period_s)

    @property
    def stops(self) -> int:
        """Number of stops written so far. Pass it as `before_stop` with a request that was checked now, so that the
        request is not written after another thread's stop."""
        return self._connection.stops

    def request(self, request: Request, reply: type[R], before_stop: int | None = None) -> R:
        """Returns the reply to one request. Raises RequestRefusedError, LinkTimeoutError, LinkLostError, ProtocolError;
        StopCameFirstError if `stops` has changed from `before_stop`."""
        (answer,) = self.exchange(request, before_stop=before_stop)
        return expect(request, answer, reply)

    def exchange(self, *requests: Request, before_stop: int | None = None) -> tuple[Reply, ...]:
        """Returns the replies to requests written together, in order; a refusal is a reply.

        Raises LinkTimeoutError if one of them is never answered, LinkLostError; ProtocolError for a wrong value;
        StopCameFirstError as `request` does.
        """
        return self.exchange_timed(*requests, before_stop=before_stop)[0]

    def exchange_timed(
        self, *requests: Request, before_stop: int | None = None
    ) -> tuple[tuple[Reply, ...], tuple[float, ...]]:
        """Like `exchange`, with the time (s) from the beginning to each reply."""
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
        """Starts a session, which every command requires. Moves nothing.

        Raises RequestRefusedError if the controller uses version 1, LinkTimeoutError, LinkLostError.
        """
        return self.request(Hello(PROTOCOL_VERSION, self._nonce()), HelloReply)

    def _nonce(self) -> int:
        """Returns a new nonce for a `Hello`. In lock-step it is the controller's time, so that runs are reproducible to
        the bit."""
        if self.lock_step:
            with contextlib.suppress(RequestRefusedError):
                return self.request(Advance(0), Advanced).time_us & 0xFFFFFFFF
        return self._chance.getrandbits(32)

    def stop(self) -> Stopped:
        """Freezes the arm. The stop is written twice, ahead of all that waits. Raises LinkTimeoutError,
        LinkLostError."""
        return self.request(Stop(), Stopped)

    def reconnect(self, wait: Wait | None = None, delay: ReconnectDelay | None = None) -> None:
        """Opens a new channel after a lost one. Repeats this until it succeeds or `wait.wait` returns True.

        Sends nothing: requests under way have failed, and only the caller may start motion again. Raises LinkLostError
        if the wait was ended.
        """
        pause = wait or threading.Event()
        self._connection.fail("connection closed in order to reconnect")
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
        """Closes the channel, and ends the mock's process if there is one. May be called twice."""
        self._connection.close()
        self._endpoint.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Link({self.url}, {self.state})"


def expect(request: Request, reply: Reply, kind: type[R]) -> R:
    """Returns `reply` with the type that answers `request`. Raises RequestRefusedError for a refusal."""
    if isinstance(reply, Refused):
        why = reply.why if isinstance(reply, ExplainedRefusal) else ""
        raise RequestRefusedError(type(request).__name__, reply.reason, why)
    assert isinstance(reply, kind)
    return reply
