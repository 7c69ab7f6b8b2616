"""The messages of the live WebSocket in both directions. Angles in rad, joints from 1.

Every frame contains `now`, the monotonic clock of the service's computer (s), and `utc`, its wall clock (s since 1970).
The age of a value is `now − host_time` when the frame was sent, and grows from then on.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from daq.contracts.experiment import JointNumber
from daq.contracts.service.base import UserWire, Wire
from daq.contracts.service.events import ServiceEvent
from daq.contracts.service.jobs import Job
from daq.contracts.service.queue import Control, QueueStatus
from daq.contracts.service.robot import Activity, ArmState, ConnectionState, ControlPeriod, RobotIdentity
from daq.contracts.service.teaching import Velocity
from daq.contracts.trace import EventKind

Topic = Literal["samples", "robot", "link", "queue", "jobs", "events", "teaching"]
SampleRate = Literal[50, 25, 10, 5, 1]


class SampleMessage(ControlPeriod):
    """One control period."""

    topic: Literal["sample"] = "sample"
    frozen: bool
    lateness: float
    """Delay (s) compared with the quickest samples: the link's jitter."""


class HistoryMessage(Wire):
    """The last minutes, thinned without losing peaks. A signal has one row per joint; a missing value is None."""

    topic: Literal["history"] = "history"
    joints: tuple[int, ...]
    tick: tuple[int, ...]
    host_time: tuple[float, ...]
    set_point: tuple[tuple[float | None, ...], ...]
    position: tuple[tuple[float | None, ...], ...]
    error: tuple[tuple[float | None, ...], ...]
    drive: tuple[tuple[float | None, ...], ...]
    events: tuple[RecordEventMessage, ...] = ()


class RecordEventMessage(Wire):
    """An event in the record of the running experiment, such as the beginning of a ramp, a limit or a retry."""

    topic: Literal["record_event"] = "record_event"
    kind: EventKind
    message: str
    tick: int | None
    joint: int | None
    host_time: float
    time: float
    """Time (s) from the start of the record."""
    experiment: str | None
    """The experiment being recorded."""


class RobotMessage(Wire):
    """State of the robot, and who may move it; sent when it changes."""

    topic: Literal["robot"] = "robot"
    connection: ConnectionState
    connection_problem: str
    identity: RobotIdentity | None
    arm: ArmState
    cause: str
    stop: int | None
    """Number of the newest stop, which a reset names; None while it is unknown."""
    activity: Activity
    experiment: str | None
    limp: tuple[int, ...]
    control: Control


class LinkMessage(Wire):
    """The link and its counters; sent once per second."""

    topic: Literal["link"] = "link"
    state: Literal["connected", "degraded", "lost", "none"]
    counters: dict[str, float]
    host_time: float


class QueueMessage(Wire):
    """The queue; sent when it changes."""

    topic: Literal["queue"] = "queue"
    status: QueueStatus


class ProgressMessage(Wire):
    """Progress of the running experiment."""

    topic: Literal["progress"] = "progress"
    experiment: str
    fraction: float
    text: str


class JobMessage(Wire):
    """A job whose state or progress has changed."""

    topic: Literal["job"] = "job"
    job: Job


class EventMessage(Wire):
    """An event of the robot or its queue."""

    topic: Literal["event"] = "event"
    event: ServiceEvent


class TeachingMessage(Wire):
    """A line for the person who teaches the arm."""

    topic: Literal["teaching"] = "teaching"
    text: str


class ThinnedMessage(Wire):
    """This client reads too slowly, so samples were left out. If this continues, it is disconnected."""

    topic: Literal["thinned"] = "thinned"
    left_out: int


class RefusedMessage(Wire):
    """The client's message was refused."""

    topic: Literal["refused"] = "refused"
    detail: str
    advice: str = ""


LiveMessage = Annotated[
    SampleMessage
    | HistoryMessage
    | RecordEventMessage
    | RobotMessage
    | LinkMessage
    | QueueMessage
    | ProgressMessage
    | JobMessage
    | EventMessage
    | TeachingMessage
    | ThinnedMessage
    | RefusedMessage,
    Field(discriminator="topic"),
]


class LiveFrame(Wire):
    """One frame of the WebSocket: messages in chronological order."""

    now: float
    utc: float
    messages: tuple[LiveMessage, ...]


class JogCommand(Wire):
    """Drives joints (rad/s) for at most 0.3 s; the client repeats it while the key is held."""

    lease: Annotated[str, Field(max_length=200)]
    velocities: dict[JointNumber, Velocity]


class LiveRequest(UserWire):
    """A client's message over the WebSocket. Its fields may be used alone or together.

    `history`: the last samples (s) to send at once, in about `points` points; `rate`: samples per second.
    """

    subscribe: tuple[Topic, ...] = ()
    unsubscribe: tuple[Topic, ...] = ()
    rate: SampleRate | None = None
    history: Annotated[float, Field(ge=0, le=3600)] | None = None
    points: Annotated[int, Field(ge=10, le=5000)] = 1000
    jog: JogCommand | None = None


class Ticket(Wire):
    """A ticket for one WebSocket connection within `seconds`, for browsers, which cannot send a token there."""

    ticket: str
    seconds: float


HistoryMessage.model_rebuild()
