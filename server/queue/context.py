"""Dependencies of one robot's queue.

Also the confirmed presence of an operator: a confirmation is valid for 60 s and must be repeated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from daq.contracts.service.experiments import ExperimentState
from daq.contracts.service.queue import Reviewer
from daq.owner.messages import Answer
from server.clock import Clock
from server.robot.control import ControlService
from server.robot.robot import Robot
from server.store.experiments import ExperimentStore
from server.store.queues import QueueStore
from server.store.schedules import ScheduleStore

ATTENDANCE = 60.0
"""Time (s) for which a confirmation of presence is valid (an assumption)."""


class Attendance:
    """The confirmed presence at one robot. Needs no lock: each method reads or sets a single value."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._until: float | None = None
        """When the confirmation expires (s, on the clock that includes sleep mode); None without confirmation, or once
        the expiry was noticed."""

    def say(self) -> None:
        """Confirms that an operator is present for the next ATTENDANCE s."""
        self._until = self._clock.elapsed() + ATTENDANCE

    @property
    def left(self) -> float:
        """Time (s) for which the confirmation is still valid; 0 if there is none."""
        until = self._until
        return 0.0 if until is None else max(0.0, until - self._clock.elapsed())

    def has_lapsed(self) -> bool:
        """True once, when the confirmed presence has expired."""
        if self._until is None or self.left > 0:
            return False
        self._until = None
        return True


class RecordEvent(Protocol):
    """Records an event of the queue."""

    def __call__(self, kind: str, text: str, *, actor: str | None = None, experiment: str | None = None) -> None:
        """Records one event."""
        ...


@dataclass(frozen=True)
class QueueContext:
    """Stores, services and callbacks of one queue."""

    robot: Robot
    control: ControlService
    experiments: ExperimentStore
    schedules: ScheduleStore
    queues: QueueStore
    clock: Clock
    record_event: RecordEvent
    add_trace: Callable[[Answer], None]
    """Called with the answer of every run that left a trace."""
    add_unfinished_traces: Callable[[], None]
    """Called after a run whose trace could not be closed or added to the catalogue, to add the written part."""
    unattended: bool
    reviewer: Reviewer | None = None
    """Who must approve an experiment before it moves a real arm; None for nobody."""
    paused: Callable[[str], None] = lambda _reason: None
    """Called with the reason when the queue pauses by itself. Must not block."""
    ended: Callable[[str, ExperimentState, str], None] = lambda _experiment, _state, _reason: None
    """Called with the end of each experiment: its ID, its state, and the reason. Must not block."""
