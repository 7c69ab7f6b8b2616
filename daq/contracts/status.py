"""Data of `daq status --json`, for a robot of this process or of a service."""

from __future__ import annotations

from pydantic import AwareDatetime

from daq.contracts.service.base import Wire
from daq.contracts.service.queue import Control, QueueStatus
from daq.contracts.service.robot import (
    Activity,
    ArmState,
    ConnectionState,
    LinkStatus,
    RobotIdentity,
    RobotStatus,
    Sample,
)


class StatusReport(Wire):
    """One robot at one moment: the fields of the service's `RobotStatus`, with the same names.

    `server`: the service that owns the robot; None if the command itself read the status. Then there is no queue and no
    control.
    """

    server: str | None = None
    robot: str
    machine: str
    port: str
    connection: ConnectionState
    connection_problem: str = ""
    identity: RobotIdentity | None = None
    arm: ArmState
    cause: str = ""
    stop: int | None = None
    activity: Activity
    experiment: str | None = None
    limp: tuple[int, ...] = ()
    sample: Sample | None = None
    link: LinkStatus
    control: Control | None = None
    queue: QueueStatus | None = None
    utc: AwareDatetime


def report_of(status: RobotStatus, server: str) -> StatusReport:
    """Returns the report of a service's status, without fields that only a newer service has."""
    fields = {name: getattr(status, name) for name in StatusReport.model_fields if name != "server"}
    return StatusReport(server=server, **fields)
