"""The robot as the service sees it. Angles are in rad, joints are numbered from 1; every value has its age."""

from __future__ import annotations

from typing import Literal

from pydantic import AwareDatetime, Field, StrictBool

from daq.contracts.experiment import Gain, JointNumber
from daq.contracts.service.base import Wire
from daq.contracts.service.queue import Control, QueueStatus

ArmState = Literal["disconnected", "idle", "armed", "running", "stopped", "fault"]
Activity = Literal["none", "experiment", "jog", "step", "program", "lead"]
ConnectionState = Literal["disconnected", "connecting", "connected", "lost"]


class ControlPeriod(Wire):
    """Signals of one control period, columns in the order of `joints`. `host_time` is the monotonic clock (s) of the
    service's computer when they arrived."""

    tick: int
    host_time: float
    joints: tuple[int, ...]
    set_point: tuple[float, ...]
    position: tuple[float, ...]
    error: tuple[float, ...]
    drive: tuple[float, ...]


class Sample(ControlPeriod):
    """One control period. `host_time` is the monotonic clock (s) of the service's computer, `utc` the wall clock (s
    since 1970) when it arrived, `age` the time (s) since then."""

    utc: float
    age: float
    frozen: bool


class SampleRate(Wire):
    """What the line can give: samples of so many joints, with a set point for each of them, every so many control
    periods."""

    joints: int
    every: int
    samples_per_second: float
    share: float
    """Share of the line's capacity that this takes, both directions added."""


class LinkStatus(Wire):
    """The link to the controller. Counters since the link was opened (docs/traces.md names them)."""

    state: Literal["connected", "degraded", "lost", "none"]
    counters: dict[str, float] = Field(default_factory=dict)
    age: float | None = None
    """Time (s) since they were read."""
    rates: tuple[SampleRate, ...] = ()
    """What the line can give, by its baud rate; empty without a connection."""
    stop_seconds: float | None = None
    """Longest time (s) that a stop takes on this line where no byte is lost."""


class RobotIdentity(Wire):
    """What the controller says about itself."""

    simulated: bool
    protocol: int
    period: float
    """Control period (s)."""
    boots: int
    samples: bool = True
    """Whether its bridge sees the control period (SAMPLE): only then is a rate promised."""
    compact: bool = False
    """Whether its bridge understands the compact turn for slow lines (COMPACT)."""


class RobotStatus(Wire):
    """Everything about one robot, at one moment."""

    robot: str
    machine: str
    port: str
    connection: ConnectionState
    connection_problem: str = ""
    """Why it is not connected."""
    identity: RobotIdentity | None = None
    arm: ArmState
    cause: str = ""
    """Why the arm is stopped or at fault, as it stands behind "stopped:" or "fault:"."""
    stop: int | None = None
    """Number of the newest stop, which a reset names; None while it is not known, such as for a moment after a stop."""
    activity: Activity
    experiment: str | None = None
    limp: tuple[int, ...] = ()
    """Joints without drive: their proportional gain is 0, so nothing holds them."""
    sample: Sample | None = None
    link: LinkStatus
    control: Control
    queue: QueueStatus
    utc: AwareDatetime


class RobotSummary(Wire):
    """One robot of this service."""

    robot: str
    machine: str
    connection: ConnectionState
    arm: ArmState


class StopResult(Wire):
    """Result of a stop. Unless it is `confirmed`, use the emergency stop."""

    delivered: bool
    """Whether the stop has been written to the line to the controller."""
    confirmed: bool
    """Whether the board has confirmed that its set points are frozen."""
    tick: int | None = None
    seconds: float
    """Time (s) from the request to this answer."""
    note: str = ""
    """Further information: joints without drive, or why the stop was not confirmed."""
    detail: str = ""
    """What `text` says beyond whether the stop was delivered and confirmed, and what to do about it."""
    text: str
    """The whole result in one line."""


class FleetStopResult(StopResult):
    """Result of a stop of all robots. It is `confirmed` only if every board has confirmed it, and the same holds for
    `delivered`."""

    robots: dict[str, StopResult]


class ResetRequest(Wire):
    """Ends the stop of this number, and no later one. `here`: first make the measured posture the set points."""

    stop: int = Field(ge=0, le=0xFFFFFFFF)
    """`stop` of the robot's status, as it was seen by whoever wants to end it."""
    here: StrictBool = False


class JointGains(Wire):
    """P, I, D of joints, each 0 to 20: the controller's numbers, not physical gains."""

    gains: dict[JointNumber, Gain]


class ProcessState(Wire):
    """Process inputs and outputs 0 to 7, and the gripper."""

    inputs: tuple[bool, ...]
    outputs: tuple[bool, ...]
    gripper: Literal["open", "closed"]


class OutputRequest(Wire):
    """One process output. Refused while the arm is stopped, unless `while_stopped`."""

    on: StrictBool
    while_stopped: StrictBool = False


class GripperRequest(Wire):
    """The gripper. Refused while the arm is stopped, unless `while_stopped`: it may hold a load, or somebody's hand."""

    closed: StrictBool
    while_stopped: StrictBool = False


class Done(Wire):
    """Something was carried out."""

    text: str
