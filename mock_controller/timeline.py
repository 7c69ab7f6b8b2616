"""Board and faults on one time axis: advances the board, and begins and ends faults at their times."""

from __future__ import annotations

from mock_controller.board.board import Board
from mock_controller.faults.fault_set import FaultSet

_BEFORE_PERIOD_US = 1
"""Time (µs) before a period at which its faults are prepared."""


class Timeline:
    """The board's time, with faults on it."""

    def __init__(self, board: Board, faults: FaultSet) -> None:
        self.board = board
        self.faults = faults
        self._period_us = board.parameters.timing.period
        self._prepared_us = -1

    @property
    def time_us(self) -> int:
        """Board time."""
        return self.board.time_us

    def next_period_us(self) -> int:
        """Returns when the controller's next period begins, computed from the last one; without one, the controller's
        next event."""
        newest = self.board.snapshots.newest()
        if newest is None:
            return self.board.next_event_us
        past = self.board.time_us - newest.time_us
        return newest.time_us + (past // self._period_us + 1) * self._period_us

    def run_until(self, time_us: int) -> None:
        """Advances time to `time_us`; a past time changes nothing."""
        while self.faults.active:
            prepare_us = self.next_period_us() - _BEFORE_PERIOD_US
            if prepare_us <= self._prepared_us:
                prepare_us = self._prepared_us + self._period_us
            change_us = self.faults.next_change_us()
            stop_us = prepare_us if change_us is None else min(prepare_us, change_us)
            if stop_us > time_us:
                break
            self.board.run_until(stop_us)
            if stop_us == prepare_us:
                self._prepared_us = prepare_us
                self.faults.before_period(prepare_us + _BEFORE_PERIOD_US)
            else:
                self.faults.make_changes(stop_us)
        self.board.run_until(time_us)
