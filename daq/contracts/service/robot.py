"""State of a robot, and requests to it. Angles are in rad, joints are numbered from 1; every value has its age."""

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
    """Signals of one control period, with columns in the order of `joints`. `host_time`: monotonic clock (s) of the
    service's computer at their arrival."""

    tick: int
    host_time: float
    joints: tuple[int, ...]
    set_point: tuple[float, ...]
    position: tuple[float, ...]
    error: tuple[float, ...]
    drive: tuple[float, ...]


class Sample(ControlPeriod):
    """One control period. At its arrival, `host_time` is the monotonic clock (s) of the service's computer and `utc`
    its wall clock (s since 1970); `age` is the time (s) since then."""

    utc: float
    age: float
    frozen: bool


class SampleRate(Wire):
    """A sampling rate that the serial link can sustain: `joints` joints with their set points, every `every` control
    periods."""

    joints: int
    every: int
    samples_per_second: float
    share: float
    """Share of the link's capacity that this uses, both directions added."""


class LinkStatus(Wire):
    """The link to the controller. Counters are since the link was opened (docs/traces.md names them)."""

    state: Literal["connected", "degraded", "lost", "none"]
    counters: dict[str, float] = Field(default_factory=dict)
    age: float | None = None
    """Time (s) since the counters were read."""
    rates: tuple[SampleRate, ...] = ()
    """Rates that the link can sustain at its baud rate; empty without a connection."""
    stop_seconds: float | None = None
    """Longest time (s) that a stop takes on this link if no byte is lost."""


class RobotIdentity(Wire):
    """Properties that the controller reports. `boots`: how often it has started."""

    simulated: bool
    protocol: int
    period: float
    """Control period (s)."""
    boots: int
    samples: bool = True
    """Whether its bridge sees the control period (SAMPLE): only then is a rate guaranteed."""
    compact: bool = False
    """Whether its bridge supports the compact request and reply for slow links (COMPACT)."""


class RobotStatus(Wire):
    """State of one robot at one moment."""

    robot: str
    machine: str
    port: str
    connection: ConnectionState
    connection_problem: str = ""
    """Why it is not connected."""
    identity: RobotIdentity | None = None
    arm: ArmState
    cause: str = ""
    """Why the arm is stopped or at fault: the text that follows "stopped: " or "fault: " in messages."""
    stop: int | None = None
    """Number of the newest stop, which a reset names; None while it is unknown, as just after a stop."""
    activity: Activity
    experiment: str | None = None
    limp: tuple[int, ...] = ()
    """Limp joints: their proportional gain is 0, so nothing holds them."""
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
    """Whether the stop was written to the link."""
    confirmed: bool
    """Whether the board confirmed that its set points are frozen."""
    tick: int | None = None
    seconds: float
    """Time (s) from the request to this answer."""
    note: str = ""
    """Further information: limp joints, or why the stop was not confirmed."""
    detail: str = ""
    """Cause and advice: the part of `text` after "delivered" or "confirmed"."""
    text: str
    """The whole result in one line."""


class FleetStopResult(StopResult):
    """Result of a stop of all robots. It is `confirmed` or `delivered` only if that is true for every robot."""

    robots: dict[str, StopResult]


class ResetRequest(Wire):
    """Ends the stop of this number, and no later one. `here`: first set the set points to the measured posture."""

    stop: int = Field(ge=0, le=0xFFFFFFFF)
    """`stop` of the robot's status, as the sender saw it."""
    here: StrictBool = False


class JointGains(Wire):
    """P, I, D of joints, each 0 to 20, in the controller's units."""

    gains: dict[JointNumber, Gain]


class ProcessState(Wire):
    """Process inputs and outputs 0 to 7, and the gripper."""

    inputs: tuple[bool, ...]
    outputs: tuple[bool, ...]
    gripper: Literal["open", "closed"]


class OutputRequest(Wire):
    """Switches one process output. Refused while the arm is stopped, unless `while_stopped`."""

    on: StrictBool
    while_stopped: StrictBool = False


class GripperRequest(Wire):
    """Moves the gripper. Refused while the arm is stopped, unless `while_stopped`: it may hold a load, or a person's
    hand."""

    closed: StrictBool
    while_stopped: StrictBool = False


class Done(Wire):
    """Result of a request, in one line."""

    text: str
