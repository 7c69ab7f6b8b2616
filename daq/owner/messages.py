"""Messages to and from the owner of a port: one JSON object a line, on its standard input and output."""

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
"""Time (s) after which a quick order is refused: less than the service waits for the answer (an assumption)."""

BEGINS_WITHIN = 5.0
"""Time (s) after which an order that moves the arm is refused: the process may have been suspended meanwhile."""


# ---- to the owner


class Open(FrozenRecord):
    """The first line: which robot to open, and where.

    With `watched`, samples are read at all times, and a lost link is restored. Without it nothing is read between two
    orders, and a stop that a lost link has not delivered is tried for `late_stop_window` s after a run. With `live`,
    every sample and the state of the arm are reported.
    """

    kind: Literal["open"] = "open"
    url: str
    machine: Machine
    limits: Limits
    folder: Path
    robot: str = "ma2000"
    memory_map: str | None = None
    """Text of a memory map file; None for the one in the package."""
    watched: bool = False
    live: bool = False
    late_stop_window: Annotated[float, Field(ge=0)] = 10.0
    """An assumption: time enough to push a plug in."""


class _Request(FrozenRecord):
    """A request. The answer has the same `number`."""

    number: int


class _QuickRequest(_Request):
    """A quick request that arrived at the time `asked` (s, this computer's monotonic clock). It is refused after
    WAITS_AT_MOST: the client may have given up, and another may have control of the arm by now."""

    asked: float


class _LongRequest(_Request):
    """A request that moves the arm, and arrived at the time `asked`. It is refused after BEGINS_WITHIN, since nobody
    expects the motion any more."""

    asked: float


class RunExperiment(_LongRequest):
    """Runs an experiment. The answer comes when its trace is closed."""

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
    """Drives joints at these velocities (rad/s) for 0.3 s at most; replaces the command before. It has no answer.
    `said`: when the client's command arrived (s, this computer's monotonic clock); a delayed command moves nothing."""

    kind: Literal["jog_drive"] = "jog_drive"
    velocities: dict[int, float]
    said: float


class RunProgram(_LongRequest):
    """Runs a taught program, or a step, which is a program of one instruction. The answer comes at the end."""

    kind: Literal["program"] = "program"
    activity: Literal["program", "step"] = "program"
    program: dict[str, object]
    """The data of a `daq.teaching.Program`, of which the client need not load the code."""


class LeadBegin(_LongRequest):
    """Lets joints be led by hand until `Finish`. The answer has the recorded path."""

    activity: ClassVar[Activity] = "lead"
    kind: Literal["lead_begin"] = "lead_begin"
    joints: tuple[int, ...]


class Finish(FrozenRecord):
    """Ends jogging or leading in good order. No answer of its own."""

    kind: Literal["finish"] = "finish"


class HaltRun(FrozenRecord):
    """Ends whatever runs with a stop: as the operator's cancel at a service does, or with `here` as Ctrl-C in the
    program that started the owner. No answer of its own."""

    kind: Literal["halt"] = "halt"
    here: StrictBool = False


class Freeze(_Request):
    """Stops the arm, as the stop socket does. The answer's data are those of a `StopAnswer`; it comes at once."""

    kind: Literal["freeze"] = "freeze"


class ReadState(_QuickRequest):
    """Reads status, sample and gains: the answer's data are those of a `StateAnswer`."""

    kind: Literal["read_state"] = "read_state"


class ReadGains(_QuickRequest):
    """Reads P, I, D of all joints."""

    kind: Literal["read_gains"] = "read_gains"


class WriteGains(_QuickRequest):
    """Writes gains. It is refused for a joint that would jump to its set point."""

    kind: Literal["write_gains"] = "write_gains"
    gains: dict[int, Gain]


class ReadProcess(_QuickRequest):
    """Reads process inputs, outputs and gripper."""

    kind: Literal["read_process"] = "read_process"


class WriteOutput(_QuickRequest):
    """Switches one process output, 0 to 7. It is refused while the arm is stopped, unless `while_stopped`."""

    kind: Literal["write_output"] = "write_output"
    output: int
    on: StrictBool
    while_stopped: StrictBool = False


class MoveGripper(_QuickRequest):
    """Closes or opens the gripper. It is refused while the arm is stopped, unless `while_stopped`."""

    kind: Literal["gripper"] = "gripper"
    closed: StrictBool
    while_stopped: StrictBool = False


class Reset(_QuickRequest):
    """Ends the stop of number `stop` (`ArmReport.stop`), and no other. Without a number it ends the one that the board
    is in when this begins."""

    kind: Literal["reset"] = "reset"
    stop: int | None
    here: StrictBool


class Close(FrozenRecord):
    """Frees the port, after a stop of running work."""

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
    """The controller has answered, and the robot is connected."""

    kind: Literal["opened"] = "opened"
    identity: RobotIdentity


class LiveSample(ControlPeriod):
    """The sample of one control period, whatever the arm is doing."""

    kind: Literal["live"] = "live"
    status: int
    lateness: float
    """Delay (s) compared with the quickest samples."""


class ArmReport(FrozenRecord):
    """The state of the arm and of the link. It is sent when it changes, and once a second."""

    kind: Literal["arm"] = "arm"
    arm: ArmState
    cause: str
    activity: Activity
    limp: tuple[int, ...]
    link: Literal["connected", "degraded", "lost"]
    counters: dict[str, float]
    stop: int | None = None
    """Number of the board's newest stop, 0 if there was none; None while it is not known, such as just after a stop."""
    unheard: str = ""
    """Why `daq stop` and the stop listener do not reach this process; empty where they do."""


class StateAnswer(FrozenRecord):
    """What one look at the robot has shown."""

    arm: ArmReport
    sample: LiveSample
    gains: dict[int, Gain]
    missed: int
    """Set points that the board has missed since its power-up."""


class TeachingText(FrozenRecord):
    """A line for the person who is teaching."""

    kind: Literal["told"] = "told"
    text: str


class Progress(FrozenRecord):
    """How far a run is."""

    kind: Literal["progress"] = "progress"
    fraction: float
    text: str


class EventHappened(FrozenRecord):
    """Something that is in the trace too."""

    kind: Literal["event"] = "event"
    event: TraceEvent


class Finished(FrozenRecord):
    """A run is over and its trace is closed."""

    kind: Literal["finished"] = "finished"
    outcome: Outcome
    trace: Path
    samples: int
    missing: int
    counters: dict[str, float]
    reason: str = ""


class Answer(FrozenRecord):
    """The answer to a request. `problem` is empty if it was carried out; `exit_code` is that of the command line."""

    kind: Literal["answer"] = "answer"
    number: int
    data: dict[str, object] = {}
    problem: str = ""
    exit_code: int = 0
    finished: Finished | None = None
    """The end of an experiment that left a trace."""


class CannotOpen(FrozenRecord):
    """The robot could not be reached, or the program has a fault; the process ends."""

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
