"""All robots of one service: their state at a glance, and the same experiment on several of them."""

from __future__ import annotations

from typing import Annotated

from pydantic import AwareDatetime, Field, StringConstraints

from daq.contracts.service.base import Wire
from daq.contracts.service.experiments import Experiment, ExperimentRequest
from daq.contracts.service.jobs import ParameterWords
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


class FittedNumber(Wire):
    """A parameter that a fit has determined, with its 95 % interval."""

    name: str
    unit: str
    value: float
    deviation: float
    low: float
    high: float


class JointResidual(Wire):
    """What a fit leaves of one joint: root mean square of simulated − measured, and of the measurement's own noise."""

    joint: int
    unit: str
    after: float
    floor: float


class ArmFit(Wire):
    """One fit of one robot. `at`: when the newest of its traces was recorded."""

    job: str
    at: AwareDatetime
    traces: tuple[str, ...]
    converged: bool
    whitened_mean_square: float
    """Mean square of the whitened residual: 1 where the noise model describes what is left."""
    residuals: tuple[JointResidual, ...]
    numbers: tuple[FittedNumber, ...]


class NumberChange(Wire):
    """A number that two fits of one robot have determined. `low` to `high`: 95 % interval of the difference."""

    name: str
    unit: str
    before: float
    after: float
    difference: float
    low: float
    high: float
    changed: bool
    """Whether it changed by more than all intervals together allow: noise alone makes any number of the whole
    comparison count as changed in one comparison out of twenty."""


class ArmComparison(Wire):
    """The fits of one robot to one experiment, the oldest first, and what has changed from `reference` to the newest.

    `reference` is the newest fit that is older than the newest one by the time asked for; None if there is none.
    """

    robot: str
    fits: tuple[ArmFit, ...]
    reference: str | None = None
    changes: tuple[NumberChange, ...] = ()


class FleetComparison(Wire):
    """The robots' fits to the same experiment, over time."""

    experiments: tuple[str, ...]
    """Names of all experiments to which anything was fitted."""
    experiment: str | None
    """The one that is compared here."""
    days: float
    robots: tuple[ArmComparison, ...]
    words: dict[str, ParameterWords] = Field(default_factory=dict)
    """How people write the parameters."""
