"""Runs a mock in lock-step inside the host's own process: bytes in, bytes out, without a port between them.

This saves the switches between two processes, which otherwise take most of a turn's time. The host still accesses only
the bytes of its line.
"""

from __future__ import annotations

import os
import select
import threading
import time
from collections.abc import Sequence
from typing import Any

from mock_controller.control import Control
from mock_controller.control_port import ControlPort
from mock_controller.device import build_device
from mock_controller.options import read_options
from mock_controller.pace import LockStepPace


class EmbeddedMock:
    """One mock, and the line to it, which a fault or the control port may cut.

    `arguments` are those of the mock's command line, without its address. Raises ValueError with one clear line for
    invalid options.
    """

    def __init__(self, arguments: Sequence[str]) -> None:
        self._device = build_device(read_options([*arguments], listens=False), self._cut_soon)
        self._pace = LockStepPace(self._device.link)
        self._in_use = threading.Lock()
        self._lines = 0
        """Number of lines so far; users of older ones find them cut."""
        self._back_at: float | None = 0.0
        """Time (s, monotonic) from which the line is available; None: not before `reconnect`."""
        self._cut_wanted: float | None = None
        self._ended = False
        self._control: ControlPort | None = None
        self._wake: tuple[int, int] = (-1, -1)

    def open_line(self) -> int | None:
        """Returns the number of a new line, which cuts the previous one; None while none is available."""
        with self._in_use:
            if self._ended or self._back_at is None or time.monotonic() < self._back_at:
                return None
            self._hang_up()
            return self._lines

    def take(self, line: int, data: bytes) -> bool:
        """Accepts bytes from the host; returns whether the line is whole."""
        with self._in_use:
            if line == self._lines:
                self._pace.receive(data)
            return line == self._lines

    def say(self, line: int) -> bytes | None:
        """Advances board time and returns the mock's answers to all accepted bytes; None if the line is cut."""
        with self._in_use:
            if line != self._lines:
                return None
            said = b""
            while not said and line == self._lines and self._pace.timeout_s() == 0.0:
                said = self._pace.work()
                if self._cut_wanted is not None:
                    seconds, self._cut_wanted = self._cut_wanted, None
                    self.disconnect(seconds)
            return said

    @property
    def control(self) -> str:
        """URL of the control port, which is opened when it is first requested."""
        with self._in_use:
            if self._control is None:
                self._control = ControlPort("127.0.0.1:0", Control(self._device, self).execute)
                self._wake = os.pipe()
                threading.Thread(target=self._serve_control, name="control port of a mock", daemon=True).start()
            return self._control.url

    @property
    def ended(self) -> bool:
        """Whether it was closed or killed."""
        return self._ended

    def close(self) -> None:
        """Ends the mock. May be called twice."""
        with self._in_use:
            self.kill()
            if self._control is not None and self._wake[1] >= 0:
                os.close(self._wake[1])
                self._wake = (self._wake[0], -1)

    # --- actions for the control port

    def disconnect(self, seconds: float | None) -> None:
        """Cuts the line; restores it after `seconds`, or only by `reconnect`."""
        self._hang_up()
        self._back_at = None if seconds is None else time.monotonic() + seconds

    def reconnect(self) -> None:
        """Restores the line now."""
        self._back_at = 0.0

    def kill(self) -> None:
        """Ends the mock at once, as the end of its process would."""
        self._hang_up()
        self._ended = True

    def clock(self) -> dict[str, Any]:
        """Returns the relation of board time and the clock."""
        return {"mode": "lock_step"}

    def lost_bytes(self) -> int:
        """Returns 0: the host takes all bytes at once."""
        return 0

    def _cut_soon(self, seconds: float) -> None:
        """Cuts the line for a fault, after the present work, which still uses it."""
        self._cut_wanted = seconds

    def _hang_up(self) -> None:
        self._lines += 1
        self._pace.hang_up()

    def _serve_control(self) -> None:
        control, (woken, _) = self._control, self._wake
        assert control is not None
        while woken not in (readable := select.select([*control.watched, woken], [], [])[0]):
            with self._in_use:
                for descriptor in readable:
                    control.serve(descriptor)
        control.close()
        os.close(woken)
