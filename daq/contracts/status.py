"""Data of `daq status --json`, for a robot of this process or of a service."""

from __future__ import annotations

from daq.contracts.frozen import like
from daq.contracts.service.queue import Control, QueueStatus
from daq.contracts.service.robot import RobotStatus


class StatusReport(RobotStatus):
    """One robot at one moment: the fields of the service's `RobotStatus`, with the same names.

    `server`: the service that owns the robot; None if the command itself read the status. Then there is no queue and no
    control.
    """

    server: str | None = None
    control: Control | None = None  # type: ignore[assignment]
    queue: QueueStatus | None = None  # type: ignore[assignment]


def report_of(status: RobotStatus, server: str) -> StatusReport:
    """Returns the report of a service's status, without fields that only a newer service has."""
    return like(StatusReport, status, server=server)
