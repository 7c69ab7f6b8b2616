"""Real time: the board's time follows the clock, and never drifts from it, unless it waits for its computer.

The board advances at exactly the moments when something happens: a period begins, the drive changes, a snapshot is
complete, bytes have left the line, the host has spoken. Between two of them lies little to simulate (some 0.5 ms of
work at most). A process that was not given the processor in time catches up event by event, listening in between,
and counts what was late. One that waits (`waits`) lets the board's clock stand still for that time instead: a late
simulator is no fault of an arm. It is for a host that is told for how long; to any other the samples would seem late.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mock_controller.board.board import Board
from mock_controller.bridge.link import Link

EVENTS_AT_ONCE = 6
"""Most controller events (three per period) that are simulated before the host's input is read again."""
LATE_US = 2_000
"""Delay (µs) beyond which a simulated controller event counts as late."""


@dataclass
class Lateness:
    """Delay of the simulation behind the clock."""

    late_ticks: int = 0
    """Periods that began in the board more than LATE_US late."""
    worst_us: int = 0
    waited_us: int = 0
    """Time for which the board's clock was stopped because the process was late."""


class RealTimePace:
    """Drives one link by a clock (µs, monotonic); board time at construction is the clock's present."""

    def __init__(self, link: Link, board: Board, clock_us: Callable[[], int], *, waits: bool = False) -> None:
        self._link = link
        self._board = board
        self._clock_us = clock_us
        self._waits = waits
        self.zero_us = clock_us() - board.time_us
        """Reading of the clock at board time 0."""
        self.lateness = Lateness()

    def hang_up(self) -> None:
        """Handles the end of the connection."""
        self._link.hang_up()

    def receive(self, data: bytes) -> None:
        """Accepts bytes from the host: they have arrived now, or, if the board is behind, as early as possible."""
        self._move_on()
        self._link.receive(data)

    def work(self) -> bytes:
        """Does all due work; returns the bytes for the host."""
        self._move_on()
        return self._link.take_output()

    def timeout_s(self) -> float:
        """Returns the time (s) until the next event."""
        due = self._board.next_event_us
        event = self._link.next_event_us()
        if event is not None:
            due = min(due, event)
        return max(due - self._now_us(), 0) * 1e-6

    def _now_us(self) -> int:
        return self._clock_us() - self.zero_us

    def _move_on(self) -> None:
        """Advances the board to the present, or by a few events if it is far behind."""
        for _ in range(EVENTS_AT_ONCE):
            due, now = self._board.next_event_us, self._now_us()
            if due > now:
                self._link.run_until(now)
                return
            if self._waits and now - due > LATE_US:
                self.zero_us += now - due
                self.lateness.waited_us += now - due
            tick = self._board.tick
            self._link.run_until(due)
            if self._board.tick != tick:
                late = self._now_us() - due
                self.lateness.worst_us = max(self.lateness.worst_us, late)
                self.lateness.late_ticks += late > LATE_US
