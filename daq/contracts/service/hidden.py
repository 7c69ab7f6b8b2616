"""The demonstration: an effect that the mock hides, what a diagnosis makes of it, and the secret once it is opened."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AwareDatetime, Field

from daq.contracts.experiment import JointNumber
from daq.contracts.service.base import Wire

HiddenState = Literal["recording", "diagnosing", "opened", "failed"]
Outcome = Literal["named", "among", "joint", "missed", "wrong"]
"""`named`: alone and rightly; `among`: in the group that the answer gives; `joint`: only the joint is right;
`missed`: nothing significant was found; `wrong`: anything else."""


class HideRequest(Wire):
    """What to hide. Without `effect` or `joint`, the mock draws them, and nobody knows them."""

    effect: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,63}$")] | None = None
    joint: JointNumber | None = None


class HideChoice(Wire):
    """An effect that can be hidden; no joints: it acts on the whole arm."""

    effect: str
    called: str
    joints: tuple[int, ...]


class HiddenNumber(Wire):
    """A number of the hidden effect. `found`: the answer's, with its 95 % interval, where it has named the effect and
    both count the same quantity."""

    called: str
    unit: str
    hidden: float
    found: float | None = None
    low: float | None = None
    high: float | None = None


class OpenedSecret(Wire):
    """What was hidden, and how the answer compares. `python -m mock_controller.reveal SEED` prints `seed`'s secret, and
    the SHA-256 of that line is the seal that was shown before."""

    seed: int
    effect: str
    joints: tuple[int, ...]
    called: str
    numbers: tuple[HiddenNumber, ...]
    outcome: Outcome


class Hidden(Wire):
    """One demonstration. Numbers of traces and jobs come as they are made: `comparison` simulates the machine file on
    the trace while `diagnosis` looks for what is missing."""

    id: str
    state: HiddenState
    began: AwareDatetime
    seal: str = ""
    picked: HideRequest
    motion: float | None = None
    """Duration (s) of the recorded motion. It was recorded faster than that, in lock-step."""
    trace: str | None = None
    held_out: str | None = None
    comparison: str | None = None
    diagnosis: str | None = None
    seconds: float | None = None
    """Time (s) from the request to the opened secret."""
    problem: str = ""
    secret: OpenedSecret | None = None


class HidingPlace(Wire):
    """Whether this robot's mock can hide effects (`problem` is empty then), which, and what it did last."""

    problem: str
    choices: tuple[HideChoice, ...]
    latest: Hidden | None
    opened: int
    """Demonstrations since the service started."""
    named: int
    """Those whose effect was named alone and rightly."""
