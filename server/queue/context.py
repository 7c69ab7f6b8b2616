"""What the queue of one robot works with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from server.clock import Clock
from server.owner.messages import Answer
from server.robot.control import ControlService
from server.robot.robot import Robot
from server.store.experiments import ExperimentStore
from server.store.queues import QueueStore
from server.store.schedules import ScheduleStore


class RecordEvent(Protocol):
    """Who is told what the queue does."""

    def __call__(self, kind: str, text: str, *, actor: str | None = None, experiment: str | None = None) -> None:
        """One thing that happened."""
        ...


@dataclass(frozen=True)
class QueueContext:
    """What the queue works with."""

    robot: Robot
    control: ControlService
    experiments: ExperimentStore
    schedules: ScheduleStore
    queues: QueueStore
    clock: Clock
    record_event: RecordEvent
    recorded: Callable[[Answer], None]
    """Called with the answer of every run that left a trace."""
    unfinished: Callable[[], None]
    """Called after a run whose trace could not be closed, or taken in: what was written of it is there."""
    unattended: bool
