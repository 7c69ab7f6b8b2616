"""The demonstration: the mock hides an effect, a diagnosis looks for it, and the service opens the secret."""

from __future__ import annotations

from typing import Literal

from pydantic import AwareDatetime

from daq.contracts.experiment import JointNumber
from daq.contracts.service.base import Wire
from daq.contracts.service.jobs import EffectName

HiddenState = Literal["recording", "diagnosing", "opened", "failed"]
Outcome = Literal["named", "among", "joint", "missed", "wrong", "unanswered"]
"""`named`: the answer names the effect and no other; `among`: the answer gives a group that contains the effect;
`joint`: only the joint is right; `missed`: nothing significant was found; `wrong`: anything else. `unanswered`: the
search was cancelled or failed."""


class HideRequest(Wire):
    """The request to hide an effect. Without `effect` or `joint`, the mock draws them at random, unseen by anybody."""

    effect: EffectName | None = None
    joint: JointNumber | None = None


class HideChoice(Wire):
    """An effect that can be hidden. `joints` is empty if it acts on the whole arm. `line`: its physics, in words."""

    effect: str
    called: str
    line: str
    joints: tuple[int, ...]


class HiddenNumber(Wire):
    """A parameter of the hidden effect. `found` is the answer's value, with its 95 % interval from `low` to `high`. It
    is set if the answer names the effect and both values are of the same quantity."""

    called: str
    unit: str
    hidden: float
    found: float | None = None
    low: float | None = None
    high: float | None = None


class OpenedSecret(Wire):
    """The hidden effect, and how the answer compares. `python -m mock_controller.reveal SEED` prints the secret of
    `seed` in one line. The SHA-256 of that line is the seal that was shown before."""

    seed: int
    effect: str
    joints: tuple[int, ...]
    called: str
    numbers: tuple[HiddenNumber, ...]
    outcome: Outcome


class Hidden(Wire):
    """One demonstration. Identifiers of traces and jobs are set as these are created. The job `comparison` simulates
    the machine file on the trace, while the job `diagnosis` looks for missing effects."""

    id: str
    state: HiddenState
    began: AwareDatetime
    seal: str = ""
    picked: HideRequest
    motion: float | None = None
    """Duration (s) of the recorded motion. Recording takes less time, since the mock runs in lock-step."""
    trace: str | None = None
    held_out: str | None = None
    comparison: str | None = None
    diagnosis: str | None = None
    seconds: float | None = None
    """Time (s) from the request to the opened secret."""
    problem: str = ""
    secret: OpenedSecret | None = None


class HidingPlace(Wire):
    """Effects that this robot's mock can hide, and the latest demonstration. If the mock can hide none, `problem` says
    why; otherwise `problem` is empty."""

    problem: str
    choices: tuple[HideChoice, ...]
    latest: Hidden | None
    opened: int
    """Demonstrations since the service started."""
    named: int
    """Demonstrations whose answer named the effect and no other."""
