"""What the acquisition process is told, and what it tells: one JSON object a line, on its standard input and output."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, StrictBool, TypeAdapter

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.frozen import WHEN_USED, FrozenRecord
from daq.contracts.labels import Outcome
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.trace import TraceEvent


class Job(FrozenRecord):
    """One experiment to run: the first line that the process reads.

    `moves_real_arm` is the operator's consent: without it a controller that is not simulated is refused.
    """

    url: str
    machine: Machine
    limits: Limits
    spec: ExperimentSpec
    folder: Path
    robot: str = "ma2000"
    memory_map: str | None = None
    """Text of a memory map file; None for the one that ships."""
    moves_real_arm: StrictBool = False
    late_stop_window: Annotated[float, Field(ge=0)] = 10.0
    """s after the loss of the link in which the stop is still tried: an assumption, time enough to push a plug in."""
    report_samples: bool = False


class Progress(FrozenRecord):
    """How far the run is."""

    kind: Literal["progress"] = "progress"
    fraction: float
    text: str


class EventHappened(FrozenRecord):
    """Something that is in the trace too."""

    kind: Literal["event"] = "event"
    event: TraceEvent


class Sampled(FrozenRecord):
    """One sample, for a live view; columns in the order of `joints`."""

    kind: Literal["sample"] = "sample"
    tick: int
    time: float
    joints: tuple[int, ...]
    set_point: tuple[float, ...]
    position: tuple[float, ...]
    drive: tuple[float, ...]
    status: int


class Finished(FrozenRecord):
    """The run is over and its trace is closed."""

    kind: Literal["finished"] = "finished"
    outcome: Outcome
    trace: Path
    samples: int
    missing: int
    counters: dict[str, float]
    reason: str = ""


class Failed(FrozenRecord):
    """Nothing was recorded: why, in one line, and the exit code that goes with it. `needs_consent`: the robot is real
    and waits for the operator's word."""

    kind: Literal["failed"] = "failed"
    message: str
    exit_code: int
    needs_consent: bool = False


Report = Annotated[Progress | EventHappened | Sampled | Finished | Failed, Field(discriminator="kind")]
REPORT: TypeAdapter[Progress | EventHappened | Sampled | Finished | Failed] = TypeAdapter(Report, config=WHEN_USED)
