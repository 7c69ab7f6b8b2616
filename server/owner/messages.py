"""Messages to and from the owner of a robot: one JSON object a line, on its standard input and output."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field, StrictBool, TypeAdapter

from daq.acquisition.messages import EventHappened, Finished, Progress
from daq.contracts.experiment import ExperimentSpec, Gain
from daq.contracts.frozen import WHEN_USED, FrozenRecord
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.service.robot import Activity, ArmState, ControlPeriod
from daq.teaching.program import Program

WAITS_AT_MOST = 2.0
"""Time (s) after which a quick order is refused: less than the service waits for the answer (an assumption)."""

BEGINS_WITHIN = 5.0
"""Time (s) after which an order that moves the arm is refused: the process may have been suspended meanwhile."""


# ---- to the owner


class Open(FrozenRecord):
    """The first line: which robot to open, and where."""

    kind: Literal["open"] = "open"
    url: str
    machine: Machine
    limits: Limits
    folder: Path
    robot: str
    memory_map: str | None = None
    """Text of a memory map file; None for the one in the package."""


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
    trace_id: str
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
    program: Program


class LeadBegin(_LongRequest):
    """Lets joints be led by hand until `Finish`. The answer has the recorded path."""

    activity: ClassVar[Activity] = "lead"
    kind: Literal["lead_begin"] = "lead_begin"
    joints: tuple[int, ...]


class Finish(FrozenRecord):
    """Ends jogging or leading in good order. No answer of its own."""

    kind: Literal["finish"] = "finish"


class HaltRun(FrozenRecord):
    """Ends whatever runs with a stop, as the operator's cancel does. No answer of its own."""

    kind: Literal["halt"] = "halt"


class Freeze(_Request):
    """Stops the arm, as the stop socket does. The answer's data are those of a `StopAnswer`; it comes at once."""

    kind: Literal["freeze"] = "freeze"


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
    """Ends the stop of number `stop` (`ArmReport.stop`), and no other."""

    kind: Literal["reset"] = "reset"
    stop: int
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

Long = RunExperiment | JogBegin | RunProgram | LeadBegin
Quick = ReadGains | WriteGains | ReadProcess | WriteOutput | MoveGripper | Reset


# ---- from the owner


class Opened(FrozenRecord):
    """The controller has answered, and the robot is connected."""

    kind: Literal["opened"] = "opened"
    simulated: bool
    protocol: int
    period: float
    boots: int
    samples: bool = True
    compact: bool = False


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


class TeachingText(FrozenRecord):
    """A line for the person who is teaching."""

    kind: Literal["told"] = "told"
    text: str


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
    """The robot could not be reached; the process ends."""

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
