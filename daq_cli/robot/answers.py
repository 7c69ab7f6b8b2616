"""Answers of a robot to commands, equal for a local robot and a service's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from daq.contracts.experiment import Gain
    from daq.contracts.status import StatusReport


@dataclass(frozen=True)
class RobotState:
    """State of the robot, as data and as one line."""

    report: StatusReport
    headline: str
    gains: Mapping[int, Gain] = field(default_factory=dict)
    """P, I and D by joint; may be empty if no joint is limp."""


@dataclass(frozen=True)
class ImportedTrace:
    """An imported trace: its ID, its file, a line about its place, the notes of the import, and the columns of its
    signals."""

    trace: str
    file: str
    text: str
    notes: str = ""
    columns: Mapping[str, str] = field(default_factory=dict)


def headline(found: StatusReport) -> str:
    """Returns the state of a robot in one line."""
    if found.identity is None:
        problem = f": {found.connection_problem}" if found.connection_problem else ""
        return f"{found.robot}: {found.connection}{problem}"
    kind = "mock" if found.identity.simulated else "REAL ARM"
    tick = "" if found.sample is None else f", tick {found.sample.tick}, {found.sample.age * 1e3:.0f} ms old"
    cause = f" ({found.cause})" if found.cause else ""
    activity = "" if found.activity == "none" else f"; {found.activity}"
    return f"{kind}{tick}, {found.arm}{cause}{activity}; link {found.link.state}"
