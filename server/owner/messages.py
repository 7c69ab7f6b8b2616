"""What the owner of a robot is told, and what it tells: one JSON object a line, on its standard input and output."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field, StrictBool, TypeAdapter

from daq.acquisition.messages import EventHappened, Finished, Progress
from daq.contracts.experiment import ExperimentSpec, Gain
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.service.robot import Activity, ArmState, ControlPeriod
from daq.teaching import Program

WAITS_AT_MOST = 2.0
"""s after which a quick order is not carried out any more: less than its asker waits for the answer (an assumption)."""


BEGINS_WITHIN = 5.0
"""s after which an order that moves the arm is not begun any more: its process was put aside, say, and goes on now."""


class _Message(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


# ---- what it is told


class Open(_Message):
    """The first line: which robot, where."""

    kind: Literal["open"] = "open"
    url: str
    machine: Machine
    limits: Limits
    folder: Path
    robot: str
    memory_map: str | None = None
    """Text of a memory map file; None for the one that ships."""


class _Request(_Message):
    """`number` comes back with the answer."""

    number: int


class _QuickRequest(_Request):
    """`asked` is the monotonic clock (s) of this computer when it was asked for. One that has waited longer than
    WAITS_AT_MOST is refused: its asker may have given up, and the arm may be another's by now."""

    asked: float


class _LongRequest(_Request):
    """As a quick one: one that has waited longer than BEGINS_WITHIN moves nothing, since nobody expects it any more."""

    asked: float


class RunExperiment(_LongRequest):
    """Runs an experiment; answered when its trace is closed."""

    activity: ClassVar[Activity] = "experiment"
    kind: Literal["run"] = "run"
    spec: ExperimentSpec
    trace_id: str
    moves_real_arm: StrictBool


class JogBegin(_LongRequest):
    """Jogging until `Finish`; answered at its end."""

    activity: ClassVar[Activity] = "jog"
    kind: Literal["jog_begin"] = "jog_begin"


class JogDrive(_Message):
    """Velocities (rad/s) for the next moment; replaces the command before. No answer. `said` is the monotonic clock
    (s) of this computer when the client's command arrived: one that was held up on its way moves nothing."""

    kind: Literal["jog_drive"] = "jog_drive"
    velocities: dict[int, float]
    said: float


class RunProgram(_LongRequest):
    """Carries out a taught program, or the one instruction of a step; answered at its end."""

    kind: Literal["program"] = "program"
    activity: Literal["program", "step"] = "program"
    program: Program


class LeadBegin(_LongRequest):
    """Joints are led by hand until `Finish`; answered with the recorded path."""

    activity: ClassVar[Activity] = "lead"
    kind: Literal["lead_begin"] = "lead_begin"
    joints: tuple[int, ...]


class Finish(_Message):
    """Ends jogging or leading in good order. No answer of its own."""

    kind: Literal["finish"] = "finish"


class HaltRun(_Message):
    """Ends whatever runs with a stop, as the operator's cancel does. No answer of its own."""

    kind: Literal["halt"] = "halt"


class ReadGains(_QuickRequest):
    """P, I, D of all joints."""

    kind: Literal["read_gains"] = "read_gains"


class WriteGains(_QuickRequest):
    """Refused for a joint that would jump to its set point."""

    kind: Literal["write_gains"] = "write_gains"
    gains: dict[int, Gain]


class ReadProcess(_QuickRequest):
    """Process inputs, outputs, gripper."""

    kind: Literal["read_process"] = "read_process"


class WriteOutput(_QuickRequest):
    """One process output, 0 to 7. Refused while the arm is stopped, unless `while_stopped`."""

    kind: Literal["write_output"] = "write_output"
    output: int
    on: StrictBool
    while_stopped: StrictBool = False


class MoveGripper(_QuickRequest):
    """Closes or opens the gripper. Refused while the arm is stopped, unless `while_stopped`."""

    kind: Literal["gripper"] = "gripper"
    closed: StrictBool
    while_stopped: StrictBool = False


class Reset(_QuickRequest):
    """The explicit end of a stop."""

    kind: Literal["reset"] = "reset"
    here: StrictBool


class Close(_Message):
    """Gives the port back. Ends what runs with a stop first."""

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
    | ReadGains
    | WriteGains
    | ReadProcess
    | WriteOutput
    | MoveGripper
    | Reset
    | Close,
    Field(discriminator="kind"),
]
ORDER: TypeAdapter[Order] = TypeAdapter(Order)

Long = RunExperiment | JogBegin | RunProgram | LeadBegin
Quick = ReadGains | WriteGains | ReadProcess | WriteOutput | MoveGripper | Reset


# ---- what it tells


class Opened(_Message):
    """The controller has been greeted."""

    kind: Literal["opened"] = "opened"
    simulated: bool
    protocol: int
    period: float
    boots: int


class LiveSample(ControlPeriod):
    """One control period, whatever is going on."""

    kind: Literal["live"] = "live"
    status: int
    lateness: float
    """s by which it came later than the quickest samples after their ticks."""


class ArmReport(_Message):
    """State of the arm and of the link; told when it changes, and once a second."""

    kind: Literal["arm"] = "arm"
    arm: ArmState
    cause: str
    activity: Activity
    limp: tuple[int, ...]
    link: Literal["connected", "degraded", "lost"]
    counters: dict[str, float]


class TeachingText(_Message):
    """A line for whoever is teaching."""

    kind: Literal["told"] = "told"
    text: str


class Answer(_Message):
    """What became of a request. `problem` is empty when it was carried out; `exit_code` as the command line's."""

    kind: Literal["answer"] = "answer"
    number: int
    data: dict[str, object] = {}
    problem: str = ""
    exit_code: int = 0
    finished: Finished | None = None
    """Of an experiment that left a trace."""


class CannotOpen(_Message):
    """The robot could not be reached; the process ends."""

    kind: Literal["cannot_open"] = "cannot_open"
    problem: str
    exit_code: int
    busy: bool = False
    """Another program has the port."""


Report = Annotated[
    Opened | LiveSample | ArmReport | TeachingText | Answer | CannotOpen | Progress | EventHappened,
    Field(discriminator="kind"),
]
REPORT: TypeAdapter[Report] = TypeAdapter(Report)
