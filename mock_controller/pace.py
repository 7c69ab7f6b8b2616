"""Two ways in which board time moves: lock-step, only when the host asks, so that runs repeat; and real time.

A *turn* belongs to the host. It begins when a whole piece, ended by its delimiter, has come in, and every piece is
one turn, whether it is a frame, damaged, or lost to a fault: so it does not matter how the operating system cut the
host's bytes, and an unfinished piece is simply waited for. In its turn the bridge

1. carries out the piece, which lets board time pass: memory accesses, the line, a `Sample` up to the next period,
   an `Advance`;
2. waits until nothing is owed: no request waits for its moment and all that has been sent has left the line;
3. if it has still sent nothing, and something is delayed by a fault, waits for that, for at most
   `HOST_PATIENCE_US` of board time: that is how long the host is taken to wait for a reply in vain;
4. ends the turn with IDLE_MARK. One mark for each piece, always: a host that counts knows what has been lost.

What is delayed for longer comes in a later turn.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from firmware_protocol.dialect import IDLE_MARK
from mock_controller.board.board import Board
from mock_controller.bridge.link import Link
from mock_controller.bridge.pieces import PieceSplitter

HOST_PATIENCE_US = 20_000
"""Time (µs) that the host is assumed to wait for a reply: one control period."""
SLICE_US = 500_000
"""Board time (µs) after which long work is interrupted to serve the control port."""


class LockStepPace:
    """Drives one link, turn by turn."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._splitter = PieceSplitter()
        self._pieces: deque[bytes] = deque()
        self._in_turn = False
        self._has_sent = False
        self._patience_ends_us = 0

    def hang_up(self) -> None:
        """Handles the end of the connection."""
        self._splitter.reset()
        self._pieces.clear()
        self._in_turn = False
        self._link.hang_up()

    def receive(self, data: bytes) -> None:
        """Accepts bytes from the host."""
        self._pieces.extend(self._splitter.feed(data))

    def timeout_s(self) -> float | None:
        """Returns the time (s) until there is work: none, or until the host sends something."""
        return 0.0 if self._in_turn or self._pieces else None

    def work(self) -> bytes:
        """Does the work that is due, for about SLICE_US of board time at most; returns the bytes for the host."""
        output = bytearray()
        slice_ends = self._link.time_us + SLICE_US
        while self._link.time_us < slice_ends and (self._in_turn or self._pieces):
            if not self._in_turn:
                self._begin_turn(self._pieces.popleft())
            elif self._go_on(output, slice_ends):
                output += IDLE_MARK
                self._in_turn = False
        return bytes(output)

    def _begin_turn(self, piece: bytes) -> None:
        self._link.receive_piece(piece)
        self._in_turn = piece.endswith(b"\0")
        self._has_sent = False
        self._patience_ends_us = self._link.time_us + HOST_PATIENCE_US

    def _go_on(self, output: bytearray, slice_ends: int) -> bool:
        """Does one step of a turn; returns whether it was the last."""
        link = self._link
        if link.owes:
            link.run_until(min(link.next_event_us() or 0, slice_ends))
        elif link.delayed and not self._has_sent and link.time_us < self._patience_ends_us:
            link.run_until(min(link.next_event_us() or 0, self._patience_ends_us, slice_ends))
        else:
            return True
        sent = link.take_output()
        output += sent
        self._has_sent = self._has_sent or bool(sent)
        if link.owes:
            self._patience_ends_us = max(self._patience_ends_us, link.time_us + HOST_PATIENCE_US)
        return False


# --- Real time: the board's time follows the clock, and never drifts from it, unless it waits for its computer
#
# The board advances at exactly the moments when something happens: a period begins, the drive changes, a snapshot is
# complete, bytes have left the line, the host has spoken. Between two of them lies little to simulate (some 0.5 ms of
# work at most). A process that was not given the processor in time catches up event by event, listening in between,
# and counts what was late. One that waits (`waits`) lets the board's clock stand still for that time instead: a late
# simulator is no fault of an arm. It is for a host that is told for how long; to any other the samples would seem late.


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
