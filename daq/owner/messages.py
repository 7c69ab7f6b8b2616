"""Messages to and from the owner: one JSON object per line, on its standard input and output."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field, StrictBool, TypeAdapter

from daq.contracts.experiment import ExperimentSpec, Gain
from daq.contracts.frozen import WHEN_USED, FrozenRecord
from daq.contracts.labels import Outcome
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.service.robot import Activity, ArmState, ControlPeriod, RobotIdentity
from daq.contracts.trace import TraceEvent
from daq.traces.naming import new_trace_id

WAITS_AT_MOST = 2.0
"""Age (s) at which a quick order is refused. Less than the service waits for the answer (an assumption)."""

BEGINS_WITHIN = 5.0
"""Age (s) at which an order that moves the arm is refused: the process may have been suspended meanwhile."""


# ---- to the owner


class Open(FrozenRecord):
    """The first order: which robot to open, and at which port.

    `watched`: the arm is monitored between orders, that is, samples are read at all times and a lost link is restored.
    Without `watched`, nothing is read between orders; a stop that a lost link held back is tried for `late_stop_window`
    s after a run. `live`: every sample and the state of the arm are reported.
    """

    kind: Literal["open"] = "open"
    url: str
    machine: Machine
    limits: Limits
    folder: Path
    robot: str = "ma2000"
    memory_map: str | None = None
    """Text of a memory map file; None for the packaged one."""
    watched: bool = False
    live: bool = False
    late_stop_window: Annotated[float, Field(ge=0)] = 10.0
    """Time (s); an assumption: long enough to push a plug in."""


class _Request(FrozenRecord):
    """A request. The answer has the same `number`."""

    number: int


class _QuickRequest(_Request):
    """A quick request that arrived at `asked` (s, this computer's monotonic clock). It is refused after WAITS_AT_MOST:
    by then the client may have given up, and another client may control the arm."""

    asked: float


class _LongRequest(_Request):
    """A request that moves the arm and arrived at `asked` (s, this computer's monotonic clock). It is refused after
    BEGINS_WITHIN, when nobody expects the motion any more."""

    asked: float


class RunExperiment(_LongRequest):
    """Runs an experiment. The answer comes once the trace is closed."""

    activity: ClassVar[Activity] = "experiment"
    kind: Literal["run"] = "run"
    spec: ExperimentSpec
    trace_id: str = Field(default_factory=new_trace_id)
    moves_real_arm: StrictBool


class JogBegin(_LongRequest):
    """Jogs until `Finish`. The answer comes at the end."""

    activity: ClassVar[Activity] = "jog"
    kind: Literal["jog_begin"] = "jog_begin"


class JogDrive(FrozenRecord):
    """Drives joints at these velocities (rad/s) for at most 0.3 s; replaces the previous command. There is no answer.
    `said`: arrival time of the client's command (s, this computer's monotonic clock); a delayed command moves
    nothing."""

    kind: Literal["jog_drive"] = "jog_drive"
    velocities: dict[int, float]
    said: float


class RunProgram(_LongRequest):
    """Runs a taught program; a single step is a program of one instruction. The answer comes at the end."""

    kind: Literal["program"] = "program"
    activity: Literal["program", "step"] = "program"
    program: dict[str, object]
    """The data of a `daq.teaching.Program`. Plain data, so that the client need not load that code."""


class LeadBegin(_LongRequest):
    """Lets a person guide joints by hand until `Finish`. The answer contains the recorded path."""

    activity: ClassVar[Activity] = "lead"
    kind: Literal["lead_begin"] = "lead_begin"
    joints: tuple[int, ...]


class Finish(FrozenRecord):
    """Ends jogging or hand guiding in good order. There is no answer."""

    kind: Literal["finish"] = "finish"


class HaltRun(FrozenRecord):
    """Ends running work with a stop. With `here`, the cause is Ctrl-C in the program that started the owner; without, a
    cancellation by the service. There is no answer."""

    kind: Literal["halt"] = "halt"
    here: StrictBool = False


class Freeze(_Request):
    """Stops the arm at once, as the stop socket does. The answer contains the data of a `StopAnswer`."""

    kind: Literal["freeze"] = "freeze"


class ReadState(_QuickRequest):
    """Reads status, sample and gains. The answer contains the data of a `StateAnswer`."""

    kind: Literal["read_state"] = "read_state"


class ReadGains(_QuickRequest):
    """Reads P, I, D of all joints."""

    kind: Literal["read_gains"] = "read_gains"


class WriteGains(_QuickRequest):
    """Writes gains. Refused for a joint that would jump to its set point."""

    kind: Literal["write_gains"] = "write_gains"
    gains: dict[int, Gain]


class ReadProcess(_QuickRequest):
    """Reads process inputs, outputs and gripper."""

    kind: Literal["read_process"] = "read_process"


class WriteOutput(_QuickRequest):
    """Switches one process output, 0 to 7. Refused while the arm is stopped, unless `while_stopped` is set."""

    kind: Literal["write_output"] = "write_output"
    output: int
    on: StrictBool
    while_stopped: StrictBool = False


class MoveGripper(_QuickRequest):
    """Closes or opens the gripper. Refused while the arm is stopped, unless `while_stopped` is set."""

    kind: Literal["gripper"] = "gripper"
    closed: StrictBool
    while_stopped: StrictBool = False


class Reset(_QuickRequest):
    """Ends the stop with the number `stop` (`ArmReport.stop`), and no other. None ends the stop in force when the reset
    begins. `here`: first set the set points to the measured posture."""

    kind: Literal["reset"] = "reset"
    stop: int | None
    here: StrictBool


class Close(FrozenRecord):
    """Stops running work and frees the port."""

    kind: Literal["close"] = "close"


Order = Annotated[
    Open
    | RunExperiment
    | JogBegin
    | JogDrive
    | RunProgram
    | LeadBegin
    | Finish
    | HaltRun
    | Freeze
    | ReadState
    | ReadGains
    | WriteGains
    | ReadProcess
    | WriteOutput
    | MoveGripper
    | Reset
    | Close,
    Field(discriminator="kind"),
]
ORDER: TypeAdapter[Order] = TypeAdapter(Order, config=WHEN_USED)

LongOrder = RunExperiment | JogBegin | RunProgram | LeadBegin
QuickOrder = ReadState | ReadGains | WriteGains | ReadProcess | WriteOutput | MoveGripper | Reset


# ---- from the owner


class Opened(FrozenRecord):
    """The controller has answered: the robot is connected."""

    kind: Literal["opened"] = "opened"
    identity: RobotIdentity


class LiveSample(ControlPeriod):
    """The sample of one control period, whatever the arm is doing."""

    kind: Literal["live"] = "live"
    status: int
    lateness: float
    """Delay (s) compared with the quickest samples."""


class ArmReport(FrozenRecord):
    """The state of the arm and of the link, sent on each change and once per second."""

    kind: Literal["arm"] = "arm"
    arm: ArmState
    cause: str
    activity: Activity
    limp: tuple[int, ...]
    link: Literal["connected", "degraded", "lost"]
    counters: dict[str, float]
    stop: int | None = None
    """Number of the board's newest stop, 0 if there was none; None while it is unknown, as just after a stop."""
    unheard: str = ""
    """Why `daq stop` and the stop listener cannot reach this process; empty if they can."""


class StateAnswer(FrozenRecord):
    """State, newest sample and gains of a robot at one moment."""

    arm: ArmReport
    sample: LiveSample
    gains: dict[int, Gain]
    missed: int
    """Set points that the board has missed since power-up."""


class TeachingText(FrozenRecord):
    """A line for the person who teaches the arm."""

    kind: Literal["told"] = "told"
    text: str


class Progress(FrozenRecord):
    """Progress of a run."""

    kind: Literal["progress"] = "progress"
    fraction: float
    text: str


class EventHappened(FrozenRecord):
    """An event that is also in the trace."""

    kind: Literal["event"] = "event"
    event: TraceEvent


class Finished(FrozenRecord):
    """A run has ended and its trace is closed."""

    kind: Literal["finished"] = "finished"
    outcome: Outcome
    trace: Path
    samples: int
    missing: int
    counters: dict[str, float]
    reason: str = ""


class Answer(FrozenRecord):
    """The answer to a request. `problem` is empty if the request was carried out; `exit_code` is for the command
    line."""

    kind: Literal["answer"] = "answer"
    number: int
    data: dict[str, object] = {}
    problem: str = ""
    exit_code: int = 0
    finished: Finished | None = None
    """The end of an experiment that left a trace."""


class CannotOpen(FrozenRecord):
    """The robot could not be reached, or the program has a fault. The process ends."""

    kind: Literal["cannot_open"] = "cannot_open"
    problem: str
    exit_code: int
    busy: bool = False
    """Whether another program uses the port."""


Report = Annotated[
    Opened | LiveSample | ArmReport | TeachingText | Answer | CannotOpen | Progress | EventHappened,
    Field(discriminator="kind"),
]
REPORT: TypeAdapter[Report] = TypeAdapter(Report, config=WHEN_USED)
