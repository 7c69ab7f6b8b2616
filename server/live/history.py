"""The samples of the last minutes, for clients that join, in a ring buffer."""

from __future__ import annotations

import threading
from collections import deque

import numpy as np

from daq.contracts.service.live import HistoryMessage, RecordEventMessage
from daq.contracts.thinning import extremes, moments, stretches
from daq.contracts.trace import Floats
from daq.owner.messages import LiveSample

SIGNALS = ("set_point", "position", "error", "drive")
DIGITS = 5
"""Decimal places of values sent: 1e-5 rad is a hundredth of the sensors' resolution."""
EVENTS = 500
"""Most events stored."""


class History:
    """The samples of the last `seconds` s for `joints` joints, one every `period` s. Safe to use from any thread."""

    def __init__(self, joints: int, period: float, seconds: float) -> None:
        self._joints = joints
        self._room = max(2, round(seconds / period))
        self._lock = threading.Lock()
        self._count = 0
        self._tick = np.zeros(self._room, np.int64)
        self._time = np.zeros(self._room)
        self._values = np.full((len(SIGNALS), self._room, joints), np.nan)
        self._events: deque[RecordEventMessage] = deque(maxlen=EVENTS)

    def add(self, sample: LiveSample) -> None:
        """Adds a sample; it replaces the oldest one if the buffer is full."""
        place = self._count % self._room
        columns = [joint - 1 for joint in sample.joints]
        with self._lock:
            self._tick[place] = sample.tick
            self._time[place] = sample.host_time
            self._values[:, place] = np.nan
            for number, name in enumerate(SIGNALS):
                self._values[number, place, columns] = getattr(sample, name)
            self._count += 1

    def add_event(self, event: RecordEventMessage) -> None:
        """Adds an event of the record, which plots mark."""
        with self._lock:
            self._events.append(event)

    def since(self, begin: float, points: int) -> HistoryMessage:
        """Returns the samples after `begin` (s, monotonic), thinned to about `points` without losing extremes."""
        with self._lock:
            order = np.arange(max(0, self._count - self._room), self._count) % self._room
            order = order[self._time[order] >= begin]
            tick, time, values = self._tick[order], self._time[order], self._values[:, order]
            events = tuple(event for event in self._events if event.host_time >= begin)
        if (first := stretches(len(time), points)) is not None:
            tick, time = moments(tick, first), moments(time, first)
            values = np.stack([extremes(signal, first) for signal in values])
        columns = {name: _rows(values[number]) for number, name in enumerate(SIGNALS)}
        return HistoryMessage(
            joints=tuple(range(1, self._joints + 1)),
            tick=tuple(tick.tolist()),
            host_time=tuple(np.round(time, 3).tolist()),
            events=events,
            **columns,
        )


def _rows(values: Floats) -> tuple[tuple[float | None, ...], ...]:
    """Converts (n, j) to j rows, and NaN to None."""
    rounded = np.round(values.T, DIGITS)
    return tuple(tuple(None if value != value else value for value in row) for row in rounded.tolist())  # noqa: PLR0124
