"""Orders to a process with limits, and its answers: one JSON object a line each way, so that nothing that a file makes
of its reader can reach the service but data."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import Machine
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces.catalogue import TraceSummary


class _Message(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Limits(_Message):
    """What one order may take: bytes of memory, and s."""

    memory: int
    seconds: float


class ReadUpload(_Message):
    """Read a file from elsewhere as a trace. `folder`: where a trace that is made of a CSV file is written."""

    kind: Literal["upload"] = "upload"
    path: Path
    folder: Path
    limits: TraceLimits = DEFAULT_TRACE_LIMITS


class WorkOutMotion(_Message):
    """Plan an experiment and hold it against the machine's limits; `most_shown`: set points of the answer."""

    kind: Literal["motion"] = "motion"
    spec: ExperimentSpec
    machine: Machine
    most_shown: int


Order = Annotated[ReadUpload | WorkOutMotion, Field(discriminator="kind")]
ORDER: TypeAdapter[ReadUpload | WorkOutMotion] = TypeAdapter(Order)


class UploadedTrace(_Message):
    """A file that is a trace: where it lies, the name that it gets, what it says about itself."""

    path: Path
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,120}\.mcap$")]
    summary: TraceSummary


class Answer(_Message):
    """`problem`: what is wrong with what was sent, in one line; empty where nothing is. `exhausted`: it is nothing but
    too much. `no_room`: nothing is wrong but that the disk is full. `fault`: a traceback, where the line is that of an
    error that nobody has foreseen. `spent`: this process has grown, and is not to be used again."""

    problem: str = ""
    exhausted: bool = False
    no_room: bool = False
    fault: str = ""
    spent: bool = False
    data: dict[str, Any] = Field(default_factory=dict)
