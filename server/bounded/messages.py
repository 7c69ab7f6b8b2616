"""Orders to a process with limits, and its answers: one JSON object per line. Only data reach the service, whatever a
file does to its reader."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.frozen import WHEN_USED, FrozenRecord
from daq.contracts.machine import Machine
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces.catalogue import TraceSummary


class Limits(FrozenRecord):
    """Limits of one order: `memory` in bytes, and time in s."""

    memory: int
    seconds: float


class ReadUpload(FrozenRecord):
    """Reads an uploaded file as a trace. `folder`: where a trace made from a CSV file is written."""

    kind: Literal["upload"] = "upload"
    path: Path
    folder: Path
    limits: TraceLimits = DEFAULT_TRACE_LIMITS


class ReadModel(FrozenRecord):
    """Reads an uploaded file as a model."""

    kind: Literal["model"] = "model"
    path: Path


class WorkOutMotion(FrozenRecord):
    """Plans an experiment and checks it against the machine's limits. `most_shown`: most set points in the answer."""

    kind: Literal["motion"] = "motion"
    spec: ExperimentSpec
    machine: Machine
    most_shown: int


Order = ReadUpload | ReadModel | WorkOutMotion
ORDER: TypeAdapter[Order] = TypeAdapter(Annotated[Order, Field(discriminator="kind")], config=WHEN_USED)


class UploadedTrace(FrozenRecord):
    """An uploaded file that is a trace: its path, its final name, and its summary."""

    path: Path
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,120}\.mcap$")]
    summary: TraceSummary


class Answer(FrozenRecord):
    """The answer to an order.

    problem:   error in the input, in one line; empty if there is none
    exhausted: the input needs too much memory
    no_room:   the disk is full; there is no other error
    fault:     traceback of an unexpected error, whose text is in `problem`
    spent:     this process has grown too large or has failed, and must not be used again
    """

    problem: str = ""
    exhausted: bool = False
    no_room: bool = False
    fault: str = ""
    spent: bool = False
    data: dict[str, Any] = Field(default_factory=dict)
