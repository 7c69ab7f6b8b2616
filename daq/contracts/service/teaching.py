"""Moves the arm by hand and by program, as the original teach pendant did."""

from __future__ import annotations

from typing import Annotated

from pydantic import AwareDatetime, Field

from daq.contracts.experiment import JointNumber
from daq.contracts.service.base import Wire
from daq.contracts.service.robot import Activity

Velocity = Annotated[float, Field(ge=-3, le=3)]
Angle = Annotated[float, Field(ge=-7, le=7)]


class JogRequest(Wire):
    """Velocities (rad/s) of joints, applied for at most 0.3 s: the client repeats the request while the key is held.
    Without velocities, the arm holds."""

    velocities: dict[JointNumber, Velocity]


class StepRequest(Wire):
    """One off-line step to absolute angles (`to`) or by relative ones (`by`), in rad; give one of the two. `speed`:
    speed of the fastest joint (rad/s)."""

    to: dict[JointNumber, Angle] | None = None
    by: dict[JointNumber, Angle] | None = None
    speed: Annotated[float, Field(gt=0, le=0.35)] = 0.25


class LeadRequest(Wire):
    """Joints to be guided by hand. They lose their drive and sink: hold the arm."""

    joints: Annotated[tuple[JointNumber, ...], Field(min_length=1)] = (1, 2, 3)


class TaughtPath(Wire):
    """Measured angles (rad), one row per control period, one column per joint; times (s) from the first row. An
    experiment can play it back as its `path`."""

    joints: tuple[int, ...]
    times: tuple[float, ...]
    positions: tuple[tuple[float, ...], ...]


class TeachingLine(Wire):
    """A line for the person who teaches, such as a refused joint, or the beginning of an instruction."""

    number: int
    at: AwareDatetime
    text: str


class TeachingStatus(Wire):
    """The current teaching activity, and how the last one ended."""

    activity: Activity
    lines: tuple[TeachingLine, ...] = ()
    """The newest lines, oldest first."""
    result: str = ""
    """How the last teaching ended; empty during teaching, or before the first."""
    problem: str = ""
    """Why the last teaching ended early."""
    path: TaughtPath | None = None
    """The last path guided by hand."""


class ProgramEntry(Wire):
    """A taught program stored by the service. `revision` grows with every change; `instructions` is their number."""

    name: str
    robot: str
    revision: int
    instructions: int
    changed: AwareDatetime
    changed_by: str
