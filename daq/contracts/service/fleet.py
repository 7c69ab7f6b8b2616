"""All robots of one service: their state at a glance, and the same experiment on several of them."""

from __future__ import annotations

from typing import Annotated

from pydantic import AwareDatetime, Field, StringConstraints

from daq.contracts.service.base import Wire
from daq.contracts.service.experiments import Experiment, ExperimentRequest
from daq.contracts.service.queue import Control, QueueStatus
from daq.contracts.service.robot import Activity, ArmState, ConnectionState

MOST_CHOSEN = 32
"""Largest number of robots in one request."""
ChosenRobot = Annotated[str, StringConstraints(min_length=1, max_length=64)]


class FleetRobot(Wire):
    """One robot at a glance. Nothing here is from before the connection was lost, and the sample has its age."""

    robot: str
    machine: str
    simulated: bool | None = None
    """Whether it is a mock; None while it is not connected."""
    connection: ConnectionState
    connection_problem: str = ""
    """Why it is not connected."""
    arm: ArmState
    cause: str = ""
    """Why the arm is stopped or at fault."""
    activity: Activity
    limp: tuple[int, ...] = ()
    sample_age: float | None = None
    """Time (s) since the newest sample arrived; None without one."""
    progress: float | None = None
    """Fraction, from 0 to 1, of the experiment that runs."""
    unattended: bool
    """Whether its queue may move it, a real arm, while no operator has confirmed being present."""
    control: Control
    queue: QueueStatus


class FleetStatus(Wire):
    """All robots of the service at one moment, in the order of the configuration."""

    utc: AwareDatetime
    robots: tuple[FleetRobot, ...]


class FleetExperimentRequest(Wire):
    """The same experiment for several robots; None for all of them. Each gets it in its own queue."""

    request: ExperimentRequest
    robots: Annotated[tuple[ChosenRobot, ...], Field(min_length=1, max_length=MOST_CHOSEN)] | None = None


class FleetExperiments(Wire):
    """The experiments that were queued, one a robot."""

    experiments: tuple[Experiment, ...]
