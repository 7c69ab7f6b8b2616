"""One robot: its connection, its latest reports, and orders to it. Safe to use from any thread."""

from __future__ import annotations

import logging
import sys
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from daq.contracts.errors import ReachError
from daq.contracts.machine import Machine
from daq.contracts.service.robot import ConnectionState, RobotIdentity
from daq.owner.client import OwnerProcess
from daq.owner.messages import (
    Answer,
    ArmReport,
    CannotOpen,
    EventHappened,
    LiveSample,
    Open,
    Opened,
    Order,
    Progress,
    Report,
    TeachingText,
)
from daq.owner.start import start_owner
from daq.owner.stop_socket import StopAnswer
from daq.transport import PortBusyError, SerialPort, Terminal, TransportError, parse_port_url, require_same, terminal_at
from server.clock import Clock
from server.stopping.arm import Reach

OPEN_WITHIN = 60.0
"""Time (s) for a process, and a mock with its physics engine, to start on a busy computer."""
ANSWER_WITHIN = 5.0
"""Time (s) to wait for the answer to an order that moves nothing."""
ORDERS_AT_ONCE = 8
"""Most quick orders that wait for answers, so that a silent robot blocks no more of the service's threads."""
PROGRAM = (sys.executable, "-m", "server.owner")
log = logging.getLogger("server.robot")
T = TypeVar("T")


def _start_owner(opening: Open, report: Callable[[Report], None], ended: Callable[[str], None]) -> OwnerProcess:
    return OwnerProcess(opening, report, ended, start_owner(PROGRAM))


@dataclass(frozen=True)
class RobotPlace:
    """A robot's name, port, machine and folder of traces."""

    name: str
    url: str
    machine: Machine
    folder: Path
    memory_map: str | None = None


@dataclass(frozen=True)
class Seen:
    """A report and when it arrived (s, monotonic)."""

    report: Any
    at: float


class Robot:
    """A robot, and the process that owns its port while it is connected.

    Listeners are called with every report of that process, on its thread; they must not block. start_owner: starts the
    process
    """

    def __init__(
        self, place: RobotPlace, clock: Clock, start_owner: Callable[..., OwnerProcess] = _start_owner
    ) -> None:
        self.place = place
        self.clock = clock
        self._start_owner = start_owner
        self.listeners: list[Callable[[Report], None]] = []
        self.disconnected: list[Callable[[str], None]] = []
        self.reached: list[Callable[[Reach], None]] = []
        """Called whenever the way to reach the robot changes; must not block."""
        self.experiment: str | None = None
        """The running experiment of the queue."""
        self.room_for_orders = threading.BoundedSemaphore(ORDERS_AT_ONCE)
        self._lock = threading.RLock()
        self._owner: OwnerProcess | None = None
        self._opened: Future[RobotIdentity] | None = None
        self._identity: RobotIdentity | None = None
        self.problem = ""
        """Why it is not connected."""
        self.arm_seen: Seen | None = None
        """The newest report of the arm's state."""
        self.sample: Seen | None = None
        """The newest sample."""
        self._terminal: Terminal | None = None
        """The pseudo-terminal at which it was reached, if it is a mock's."""
        self._is_unwanted = False
        """Whether somebody has asked for the end of the connection."""

    @property
    def name(self) -> str:
        """The robot's name, as in addresses, rows and files."""
        return self.place.name

    @property
    def machine(self) -> Machine:
        """The machine, with the limits of the configuration."""
        return self.place.machine

    @property
    def identity(self) -> RobotIdentity | None:
        """Properties that the controller reports; None while it is not connected."""
        return self._identity

    @property
    def arm(self) -> ArmReport | None:
        """The newest report of the arm's state."""
        return self.arm_seen.report if self.arm_seen else None

    @property
    def connection(self) -> ConnectionState:
        """The state of the connection. Does not block, since the event loop calls this."""
        owner, identity, arm = self._owner, self._identity, self.arm
        if identity is None:
            return "disconnected" if owner is None else "connecting"
        return "lost" if arm is not None and arm.link == "lost" else "connected"

    def connect(self, *, anew: bool = False, wanted: Callable[[], bool] = lambda: True) -> RobotIdentity:
        """Connects, or waits for a connection under way. Moves nothing. Raises ReachError, SpecError.

        Only with `anew`, for a person who knows what is at the port, may it use another terminal than before. `wanted`
        is called again under the lock. So a `disconnect` comes either before, and the connection is no longer wanted,
        or after, and ends the connection.
        """
        with self._lock:
            if self._owner is None:
                if not wanted():
                    raise ReachError(f"robot {self.name} was disconnected meanwhile")
                self._terminal = None if anew else self._terminal
                self.require_same_place()
                self._begin()
            opened = self._opened
        assert opened is not None
        try:
            return opened.result(OPEN_WITHIN)
        except TimeoutError:
            self.disconnect()
            raise ReachError(f"{self.place.url}: no greeting within {OPEN_WITHIN:g} s") from None

    def reach(self) -> Reach:
        """Returns how the robot can be reached for a stop."""
        owner = self._owner
        process = None if owner is None else owner.pid
        return Reach(self.name, self.place.url, process, self._terminal, self._stop_by_pipe)

    def require_same_place(self) -> None:
        """Raises ReachError if another program now has the port's number: nothing may be sent there."""
        port = parse_port_url(self.place.url)
        if isinstance(port, SerialPort):
            try:
                require_same(port.device, self._terminal)
            except TransportError as error:
                self.problem = str(error)
                raise ReachError(self.problem) from error

    def disconnect(self, patience: float = 4.0) -> bool:
        """Frees the port, after a stop of running work. Returns whether this is done within `patience` s."""
        with self._lock:  # a connection attempt may be starting its process
            owner, self._is_unwanted = self._owner, True
        return True if owner is None else owner.close(patience)

    def ask(self, kind: Callable[..., Any], **fields: object) -> Future[Answer]:
        """Sends an order to the robot's owner. Raises ReachError if the robot is not connected."""
        with self._lock:
            if self._owner is None or self._identity is None:
                raise ReachError(f"robot {self.name} is not connected")
            return self._owner.ask(kind, **fields)

    def send(self, order: Order) -> None:
        """Sends an order that has no answer. It is dropped if the robot is not connected."""
        owner = self._owner
        if owner is not None:
            owner.send(order)

    def note_stop(self) -> None:
        """Notes a stop that the board has confirmed, before the owner reports it. Does not block."""
        arm = self.arm
        if arm is not None and arm.arm not in ("stopped", "fault"):
            told = {"arm": "stopped", "cause": "a stop that the board has confirmed", "stop": None}
            stopped = arm.model_copy(update=told)
            self.arm_seen = Seen(stopped, self.clock.monotonic())

    def _stop_by_pipe(self) -> StopAnswer | None:
        owner = self._owner
        return None if owner is None else owner.stop()

    def _begin(self) -> None:
        place = self.place
        self.problem, self._is_unwanted = "", False
        self._opened = Future()
        opening = Open(
            url=place.url,
            machine=place.machine,
            limits=place.machine.limits,
            folder=place.folder,
            robot=place.name,
            memory_map=place.memory_map,
            watched=True,
            live=True,
        )
        try:
            self._owner = self._start_owner(opening, self._on_report, self._on_end)
            _notify_each(self.reached, self.reach())
        except OSError as error:  # no memory or file descriptor is left for another process
            self.problem = f"the robot's process cannot be started: {error.strerror or error}"
            raise ReachError(self.problem) from error

    def _on_report(self, report: Report) -> None:
        seen = Seen(report, self.clock.monotonic())
        match report:
            case LiveSample():
                self.sample = seen
            case ArmReport():
                self.arm_seen = seen
            case Opened():
                self._set_opened(report)
            case CannotOpen():
                self._cannot_open(report)
            case Progress() | EventHappened() | TeachingText() | _:
                pass
        _notify_each(self.listeners, report)

    def _set_opened(self, report: Opened) -> None:
        identity = report.identity
        port = parse_port_url(self.place.url)
        with self._lock:
            self._identity = identity
            self._terminal = terminal_at(port.device) if isinstance(port, SerialPort) else None
            assert self._opened is not None
            self._opened.set_result(identity)
        _notify_each(self.reached, self.reach())

    def _cannot_open(self, report: CannotOpen) -> None:
        with self._lock:
            self.problem = report.problem
            if self._opened is not None and not self._opened.done():
                error = PortBusyError(report.problem) if report.busy else ReachError(report.problem)
                self._opened.set_exception(error)

    def _on_end(self, why: str) -> None:
        with self._lock:
            was = self._identity is not None
            if self._is_unwanted and why == "exit code 0":
                why = "disconnected on request"
            elif was and not self.problem:
                self.problem = f"the connection has ended ({why})"
            self._owner = self._identity = self.arm_seen = self.sample = None
            if self._opened is not None and not self._opened.done():
                self._opened.set_exception(ReachError(self.problem or f"the robot's process ended: {why}"))
        _notify_each(self.reached, self.reach())
        _notify_each(self.disconnected, why)


def _notify_each(listeners: Iterable[Callable[[T], None]], news: T) -> None:
    """Calls all listeners; an error in one is logged and does not affect the others."""
    for listener in listeners:
        try:
            listener(news)
        except Exception:
            log.exception("a listener of the robot")
