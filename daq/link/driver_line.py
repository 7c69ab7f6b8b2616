"""The line to a robot that a Python driver drives: one thread owns the driver, and a stop goes before all that waits.

Endpoint, dialect and channel in one: a request's "bytes" are its number, by which the thread finds it.
"""

from __future__ import annotations

import sys
import threading
import time
import zlib
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from functools import partial
from pathlib import Path
from typing import IO, Self, TypeVar

import platformdirs

from daq.contracts.file_lock import take_lock
from daq.contracts.robot_driver import DriverError, RobotDriver, require_fit
from daq.link.driver_board import TICK_S, DriverBoard
from daq.plugins import named, plugins
from daq.transport import ChannelError, PortBusyError, TransportError
from daq.transport.holders import other_holders
from daq.transport.url import DriverPort, PortUrlError
from firmware_protocol.commands import Stop
from firmware_protocol.message import Reply, Request
from firmware_protocol.scale import LineScale

CONNECTED_WITHIN = 60.0
"""Time (s) for a driver to connect: imports of its libraries included."""
ENDED_WITHIN = 5.0
NUMBER = 2
"""Bytes of a request's number."""
BYTES_PER_SECOND = 10_000.0
"""Nominal rate, by which the time of a call is a number of bytes (`LineScale.turn_bytes`)."""
STOPPED = b"stopped"
R = TypeVar("R")


def driver_line(url: str, port: DriverPort) -> DriverLine:
    """Returns the line to the robot of a URL, not yet connected. Raises PortUrlError if its driver cannot be loaded,
    UnfitRobotError, DriverError."""
    reference = next(plugin.drivers[port.scheme] for plugin in plugins() if port.scheme in plugin.drivers)
    try:
        made: Callable[[str, dict[str, str]], RobotDriver] = named(reference)
    except ImportError as error:
        raise PortUrlError(f"port {url!r}: {error}") from error
    driver = _called(lambda: made(port.target, dict(port.options)))
    require_fit(url, driver.facts)
    return DriverLine(url, driver, device=dict(port.options).get("port"))


class DriverLine:
    """Lets `Link` talk to one driver. It can be opened again after a lost connection.

    state: file that is locked while the robot is owned, and remembers a stop beyond the connection.
    """

    lock_step = False
    control: str | None = None
    bytes_per_second = BYTES_PER_SECOND
    damaged = 0

    def __init__(
        self,
        url: str,
        driver: RobotDriver,
        *,
        device: str | None = None,
        state: Path | None = None,
        now: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        facts = driver.facts
        self.url = self.description = url
        self.complaint = ""
        self.scale = LineScale(
            joints=len(facts.joints),
            set_point_units=facts.counts,
            position_counts=facts.counts,
            every=max(1, round(facts.period_s / TICK_S)),
            turn_bytes=max(1, round(2 * facts.call_s * BYTES_PER_SECOND)),
            measures_drive=False,
        )
        self._driver, self._device, self._now, self._sleep = driver, device, now, sleep
        self._state = state or _state_file(device or url)
        self._changed = threading.Condition()
        """Guards everything below."""
        self._asked: dict[int, Request] = {}
        self._due: deque[int] = deque()
        self._answered: dict[int, Reply] = {}
        self._spoken = b""
        self._stop_waits = False
        """Whether a stop was asked that the robot's driver has not begun."""
        self._open = False
        self._thread: threading.Thread | None = None

    # -- endpoint

    def waited(self) -> float:
        """Returns 0: the robot's time is this computer's."""
        return 0.0

    def connect(self) -> Self:
        """Connects the driver, on the thread that owns it from then on. Raises TransportError, DriverError."""
        self.close()
        if self._thread is not None and self._thread.is_alive():
            raise TransportError(f"{self.url}: the robot's driver is still busy with its last call")
        self.reset()
        if (self._device or "").startswith("/dev/") and (others := other_holders(str(self._device))):
            raise PortBusyError(f"{self._device} is in use by {' and '.join(others)}: end that program")
        result: list[BaseException | None] = []
        connected = threading.Event()
        self._open = True
        self._thread = threading.Thread(target=self._own, args=(result, connected), name="robot driver", daemon=True)
        self._thread.start()
        if not connected.wait(CONNECTED_WITHIN):
            self._open = False
            raise TransportError(f"{self.url}: the driver has not connected within {CONNECTED_WITHIN:g} s")
        if (error := result[0]) is not None:
            self._thread.join()
            raise error
        return self

    def _own(self, result: list[BaseException | None], connected: threading.Event) -> None:
        try:
            with _owned(self._state, self.url) as state:
                _called(self._driver.connect)
                try:
                    stopped = state.read() == STOPPED
                    board = DriverBoard(self._driver, self._now, self._sleep, stopped, lambda on: _keep(state, on))
                    result.append(None)
                    connected.set()
                    self._serve(board)
                finally:
                    if self._stop_waits:
                        _keep(state, True)
                    with suppress(DriverError):
                        _called(self._driver.disconnect)
        except BaseException as error:  # noqa: BLE001 - the thread that connects raises it
            result.append(error)
        finally:
            connected.set()
            with self._changed:
                self._open = False
                self._changed.notify_all()

    def _serve(self, board: DriverBoard) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._due or not self._open)
                if not self._open:
                    return
                number = self._due.popleft()
                request = self._asked.get(number)
                if isinstance(request, Stop):
                    self._stop_waits = False
            if request is None:
                continue  # a second copy, or given up
            try:
                reply = _called(partial(board.answer, request))
            except DriverError as error:
                self.complaint = str(error)  # without a reply, the link repeats the request
                continue
            with self._changed:
                if self._asked.pop(number, None) is not None:
                    self._answered[number] = reply
                    self._spoken += number.to_bytes(NUMBER, "big")
                    self._changed.notify_all()

    # -- channel

    def write(self, data: bytes) -> None:
        """Hands requests to the thread; a stop goes first. Raises ChannelError after the end."""
        numbers = [int.from_bytes(data[at : at + NUMBER], "big") for at in range(0, len(data), NUMBER)]
        with self._changed:
            self._check()
            for number in numbers:
                if isinstance(self._asked.get(number), Stop):
                    self._stop_waits = True
                    self._due.appendleft(number)
                else:
                    self._due.append(number)
            self._changed.notify_all()

    def read(self, timeout_s: float) -> bytes:
        """Returns the numbers of answered requests; empty after the time-out. Raises ChannelError after the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._spoken or not self._open, timeout_s)
            self._check()
            spoken, self._spoken = self._spoken, b""
        return spoken

    def close(self) -> None:
        """Ends the thread, which disconnects the driver. May be called twice."""
        with self._changed:
            self._open = False
            self._changed.notify_all()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(ENDED_WITHIN)

    def _check(self) -> None:
        if not self._open:
            raise ChannelError(f"{self.url}: closed")

    # -- dialect

    def encode(self, sequence: int, request: Request) -> bytes:
        """Notes the request. Returns its number."""
        with self._changed:
            self._asked[sequence] = request
        return sequence.to_bytes(NUMBER, "big")

    def again(self, request: Request, frame: bytes) -> bytes:
        """Returns the number again: the thread answers a request once."""
        del request
        return frame

    def feed(self, data: bytes) -> list[tuple[int, Reply]]:
        """Returns the replies of these numbers."""
        numbers = [int.from_bytes(data[at : at + NUMBER], "big") for at in range(0, len(data), NUMBER)]
        with self._changed:
            return [(number, self._answered.pop(number)) for number in numbers if number in self._answered]

    def forget(self, sequence: int) -> None:
        """Drops a request that has been given up: it is not carried out later."""
        with self._changed:
            self._asked.pop(sequence, None)
            self._answered.pop(sequence, None)

    def answer(self) -> bytes:
        """Returns nothing: a request has one step."""
        return b""

    def farewell(self) -> bytes:
        """Returns nothing: the robot holds its last set points."""
        return b""

    def reset(self) -> None:
        """Drops requests in progress."""
        with self._changed:
            self._asked.clear()
            self._answered.clear()
            self._due.clear()
            self._spoken = b""


def _called(call: Callable[[], R]) -> R:
    """Calls a driver, which may run anybody's code. Raises DriverError with one line for whatever it raises."""
    try:
        with redirect_stdout(sys.stderr):  # an owner's standard output has messages only
            return call()
    except DriverError:
        raise
    except Exception as error:
        line = " ".join(str(error).split())[:300]
        raise DriverError(f"the robot's driver failed: {type(error).__name__}: {line}") from error


def _state_file(key: str) -> Path:
    return platformdirs.user_state_path("ma2000-daq") / f"driver-{zlib.crc32(key.encode()):08x}"


@contextmanager
def _owned(path: Path, url: str) -> Iterator[IO[bytes]]:
    """Opens the state file, locked. Raises PortBusyError if another process has it, TransportError if it cannot be
    made: a stop would be forgotten."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        stream = path.open("a+b")
        with stream:
            if not take_lock(stream):
                raise PortBusyError(f"{url} is in use by another process: end that one, or stop it with `daq stop`")
            stream.seek(0)
            yield stream
    except OSError as error:
        raise TransportError(f"{url}: {path} cannot be kept: {error.strerror or error}") from error


def _keep(state: IO[bytes], stopped: bool) -> None:
    state.truncate(0)
    if stopped:
        state.write(STOPPED)
    state.flush()
