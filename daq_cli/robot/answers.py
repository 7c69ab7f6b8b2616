"""The answers of a robot to commands, which are the same for a local robot and for one at a service."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from daq.contracts.experiment import Gain
    from daq.contracts.status import StatusReport


@dataclass(frozen=True)
class RobotState:
    """The state of the robot, in full and in one line."""

    report: StatusReport
    headline: str
    gains: Mapping[int, Gain] = field(default_factory=dict)
    """P, I and D by joint; may be empty where no joint is limp."""


@dataclass(frozen=True)
class ResetDone:
    """The result of a reset in one line and, from a local board, the joints that nothing holds."""

    text: str
    limp: str = ""


@dataclass(frozen=True)
class ImportChoice:
    """What is taken from a bag: the topic, the names of the joints, whether the times are those of reception, and the
    unit of the effort. Of any other file only the unit of the drive can be chosen."""

    topic: str | None = None
    joints: tuple[str, ...] | None = None
    received: bool = False
    drive_unit: str | None = None


@dataclass(frozen=True)
class ImportedTrace:
    """An imported trace: its number, its file, one line on where it is, and what was noted in making it."""

    trace: str
    file: str
    text: str
    notes: str = ""
