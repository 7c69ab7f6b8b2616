"""All robots of one service: overview, and one experiment on several robots."""

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
    """Overview of one robot. It contains no data from before a lost connection, and the age of its sample."""

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
    """Time (s) since the newest sample arrived; None if there is none."""
    progress: float | None = None
    """Progress of the running experiment, from 0 to 1."""
    unattended: bool
    """Whether its queue may move it, a real arm, without an operator who has confirmed being present."""
    control: Control
    queue: QueueStatus


class FleetStatus(Wire):
    """All robots of the service at one moment, in configuration order."""

    utc: AwareDatetime
    robots: tuple[FleetRobot, ...]


class FleetExperimentRequest(Wire):
    """An experiment for several robots; None for all of them. It is added to the queue of each."""

    request: ExperimentRequest
    robots: Annotated[tuple[ChosenRobot, ...], Field(min_length=1, max_length=MOST_CHOSEN)] | None = None


class FleetExperiments(Wire):
    """The queued experiments, one per robot."""

    experiments: tuple[Experiment, ...]


class FittedNumber(Wire):
    """A parameter estimated by a fit, with its 95 % interval."""

    name: str
    unit: str
    value: float
    deviation: float
    low: float
    high: float


class JointResidual(Wire):
    """Residual of a fit at one joint: root mean square of simulated − measured, and of the measurement noise."""

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
    """Mean square of the whitened residual; 1 if the noise model describes the residual."""
    residuals: tuple[JointResidual, ...]
    numbers: tuple[FittedNumber, ...]


class NumberChange(Wire):
    """A parameter that two fits of one robot estimated. `low` to `high`: 95 % interval of the difference."""

    name: str
    unit: str
    before: float
    after: float
    difference: float
    low: float
    high: float
    changed: bool
    """Whether the change is larger than all intervals together allow. By noise alone, only one comparison in twenty
    marks any parameter as changed."""


class ArmComparison(Wire):
    """A robot's fits to one experiment, the oldest first, and the changes from `reference` to the newest.

    `reference`: the newest fit that is older than the last one by the requested time; None if there is none.
    """

    robot: str
    fits: tuple[ArmFit, ...]
    reference: str | None = None
    changes: tuple[NumberChange, ...] = ()


class FleetComparison(Wire):
    """The robots' fits to the same experiment, over time."""

    experiments: tuple[str, ...]
    """Names of all experiments with a fit."""
    experiment: str | None
    """The experiment that is compared here."""
    days: float
    robots: tuple[ArmComparison, ...]
    words: dict[str, ParameterWords] = Field(default_factory=dict)
    """Names of the parameters for people."""
