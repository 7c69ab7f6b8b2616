"""What a plug-in does in a running service."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from daq.contracts.service.experiments import ExperimentState
from daq.contracts.service.jobs import Job
from daq.owner.messages import Report


@dataclass(frozen=True)
class Attention:
    """Something that needs somebody for as long as it lasts; `topic` is one of notifications."""

    topic: str
    text: str
    robot: str | None = None


class Part:
    """A part of the service that a plug-in adds: `Plugin.parts` names the class. It is made with the `Services`, before
    they start, and found again as `services.part(Class)`. It overrides what it needs of the following. The name of its
    log begins with `server.`, so that it is written as the others are."""

    def robots_made(self, robots: Sequence[Any]) -> None:
        """Is given the `RobotServices` of every robot, before anything starts."""

    def start(self) -> None:
        """Begins: the robots have started."""

    def close(self, seconds: float) -> None:
        """Ends within this time. Nothing else of the service runs any more but the log and the database."""
        del seconds

    def warnings(self) -> list[str]:
        """Returns what will need somebody soon, one line each."""
        return []

    def checks(self) -> dict[str, str]:
        """Returns what the readiness of the service says: by its name, a problem, or an empty text."""
        return {}

    def attention(self) -> dict[str, Attention]:
        """Returns what needs somebody, by a key that stays the same meanwhile."""
        return {}

    # News. These may be called on any thread, and must not wait.

    def arm_reported(self, robot: str, report: Report) -> None:
        """Hears what the owner of a robot's port reports."""

    def experiment_ended(self, robot: str, identity: str, state: ExperimentState, reason: str) -> None:
        """Hears of the end of an experiment."""

    def queue_paused(self, robot: str, reason: str) -> None:
        """Hears that a queue is paused until somebody has looked."""

    def job_changed(self, job: Job) -> None:
        """Hears of a job that has begun, advanced or ended."""
