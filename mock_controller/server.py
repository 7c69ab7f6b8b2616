"""The process: waits for the host, the clock and the control port, and lets the mock do the rest."""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import sys
import time
from collections.abc import Callable
from typing import Any

from mock_controller.control import Control
from mock_controller.control_port import ControlPort
from mock_controller.device import Device, build_device
from mock_controller.options import Options
from mock_controller.pace import LockStepPace, RealTimePace
from mock_controller.ports import Port, PortError, PtyPort, TcpPort, host_and_port

_STDIN, _STDOUT = 0, 1
_RETRY_S = 0.1
"""Seconds between attempts to reopen a port that another program has taken meanwhile."""


def _clock_us() -> int:
    return time.monotonic_ns() // 1000


class Server:
    """One mock with its port and control port. `build` makes its parts; tests replace the bridge.

    Raises ValueError with one clear line for invalid options.
    """

    def __init__(
        self, options: Options, build: Callable[[Options, Callable[[float], None]], Device] = build_device
    ) -> None:
        self._options = options
        self._back_at: float | None = None
        self._cut_wanted: float | None = None
        self._device = build(options, self._cut_soon)
        self._control: ControlPort | None = None
        if options.control != "none":
            self._control = ControlPort(options.control, Control(self._device, self).execute)
        try:
            self._port = _open_port(options)
        except PortError:
            if self._control is not None:
                self._control.close()
            raise
        link = self._device.link
        self._pace: LockStepPace | RealTimePace
        self._pace = (
            LockStepPace(link)
            if options.lock_step
            else RealTimePace(link, self._device.board, _clock_us, waits=options.waits)
        )
        self._told_us = 0

    def run(self) -> None:
        """Serves until interrupted, or, if owned, until standard input ends."""
        self._announce()
        try:
            while self._turn():
                pass
        finally:
            self._port.cut()
            if self._control is not None:
                self._control.close()

    # --- actions for the control port

    def disconnect(self, seconds: float | None) -> None:
        """Cuts the line; restores it after `seconds`, or only by `reconnect`."""
        self._port.cut()
        self._pace.hang_up()
        self._back_at = None if seconds is None else time.monotonic() + seconds

    def reconnect(self) -> None:
        """Restores the line, now or as soon as its address is free."""
        try:
            self._port.restore()
            self._back_at = None
            self._announce()
        except PortError:
            self._back_at = time.monotonic() + _RETRY_S

    def kill(self) -> None:
        """Ends the process at once."""
        os.kill(os.getpid(), signal.SIGKILL)

    def clock(self) -> dict[str, Any]:
        """Returns the relation of board time and the clock."""
        if isinstance(self._pace, LockStepPace):
            return {"mode": "lock_step"}
        late = self._pace.lateness
        return {
            "mode": "real_time",
            "monotonic_us_at_zero": self._pace.zero_us,
            "late_ticks": late.late_ticks,
            "worst_late_us": late.worst_us,
            "waited_us": late.waited_us,
        }

    def lost_bytes(self) -> int:
        """Bytes that the host never read."""
        return self._port.lost

    # --- the loop

    def _turn(self) -> bool:
        """Waits for an event and handles it; returns whether to continue."""
        control = [] if self._control is None else self._control.watched
        port = self._port.watched
        owner = [_STDIN] if self._options.owned else []
        readable, _, _ = select.select([*port, *control, *owner], self._port.waiting_to_write, [], self._timeout_s())
        for descriptor in readable:
            if descriptor in port:
                self._read(descriptor)
            elif descriptor in control and self._control is not None:
                self._control.serve(descriptor)
            elif not os.read(_STDIN, 4096):
                return False
        output = self._pace.work()
        self._tell_waited()  # before the work that follows it
        self._port.send(output)
        self._cut_and_restore()
        return True

    def _read(self, descriptor: int) -> None:
        if descriptor not in self._port.watched:  # the control port has cut it in this turn
            return
        data = self._port.read(descriptor)
        if data is None:
            self._pace.hang_up()
        elif data:
            self._pace.receive(data)

    def _timeout_s(self) -> float | None:
        timeout = self._pace.timeout_s()
        if self._back_at is None:
            return timeout
        left = max(self._back_at - time.monotonic(), 0.0)
        return left if timeout is None else min(timeout, left)

    def _cut_soon(self, seconds: float) -> None:
        """Cuts the line for a fault, after the present work, which still uses it."""
        self._cut_wanted = seconds

    def _cut_and_restore(self) -> None:
        if self._cut_wanted is not None:
            seconds, self._cut_wanted = self._cut_wanted, None
            self.disconnect(seconds)
        if self._back_at is not None and time.monotonic() >= self._back_at:
            self.reconnect()

    def _tell_waited(self) -> None:
        """Reports for how long the board's clock was stopped in all. If the owner's pipe is full, it reports later."""
        if isinstance(self._pace, LockStepPace) or self._pace.lateness.waited_us == self._told_us:
            return
        if not select.select([], [_STDOUT], [], 0)[
            1
        ]:  # a pipe with room takes a whole line; other kinds share their modes with other programs
            return
        line = json.dumps({"waited_us": self._pace.lateness.waited_us}) + "\n"
        with contextlib.suppress(BrokenPipeError):
            os.write(_STDOUT, line.encode())
            self._told_us = self._pace.lateness.waited_us

    def _announce(self) -> None:
        ready = {"ready": True, "url": self._port.url, "control": self._control.url if self._control else None}
        with contextlib.suppress(BrokenPipeError):
            sys.stdout.write(json.dumps(ready) + "\n")
            sys.stdout.flush()


def _open_port(options: Options) -> Port:
    if options.pty:
        return PtyPort(options.link)
    return TcpPort(*host_and_port(options.tcp or "", "tcp"))
