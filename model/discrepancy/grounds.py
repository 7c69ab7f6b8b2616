"""What speaks for and against an answer, as data. `explanation/answer_words.py` alone makes sentences from it."""

from __future__ import annotations

from enum import StrEnum
from typing import Any, Literal

from daq.contracts.frozen import FrozenRecord

Method = Literal["output-error", "inverse-dynamics"]
"""How model and record were compared: by simulating the closed loop, or by balancing torques along the motion."""
NoteKind = Literal[
    "cutoff",
    "drive-at-limit",
    "errors-follow-record",
    "larger-noise",
    "limited-search",
    "no-experiment-left",
    "not-looked-for",
    "not-separable",
    "nothing-held-out",
    "one-class",
    "positions-of-links",
    "resting-left-out",
    "shakes-above-cutoff",
    "stated-numbers-moved",
    "taken-out-again",
    "tolerances-fitted-first",
    "tolerance-source",
    "torque-left",
    "unfinished-record",
]
SharedLaw = Literal[
    "torque-with-speed",
    "torque-against-motion",
    "torque-with-position",
    "torque-of-weight",
    "torque-per-volt",
    "late-drive",
    "play-and-give",
    "reading-over-range",
    "torque-at-one-rate",
]
"""What effects have in common that motions alone may not tell apart."""
Measurement = Literal[
    "current-clamp",
    "coast-with-drive-open",
    "force-gauge",
    "weighed-parts",
    "spirit-level",
    "loosened-cables",
    "protractor",
    "dial-gauge",
    "oscilloscope",
    "stopped-arm",
]
"""A measurement beside the arm's own readings."""
RefusalKind = Literal[
    "falls-too-little",
    "less-than-rest",
    "only-resembles",
    "superfluous",
]


class Reason(FrozenRecord):
    """What speaks for the effect of a step, beside what the step itself holds: its parameters, evidence and errors.

    `removed`: by balancing torques, the share of the mean square that is gone on records not fitted to.
    """

    removed: float | None = None


class ControllerEffect(StrEnum):
    """Effects of the controller, which its own recorded numbers prove or exclude."""

    WRONG_GAIN = "wrong_gain"
    LOST_SET_POINTS = "lost_set_points"

    @property
    def part(self) -> str:
        """The effect's only number."""
        return "relative" if self is ControllerEffect.WRONG_GAIN else "share"


class ControllerProof(FrozenRecord):
    """The controller's own recorded numbers prove an effect: so many `samples`, `of` those looked at, show it."""

    samples: int
    of: int


class Refusal(FrozenRecord):
    """Why an effect was not taken into the model. `joints`: those that it leaves unexplained."""

    kind: RefusalKind
    numbers: dict[str, float] = {}
    joints: tuple[int, ...] = ()


class Note(FrozenRecord):
    """An assumption or limit of an answer. `warning`: it speaks against the whole answer and is read before it."""

    kind: NoteKind
    values: dict[str, Any] = {}
    warning: bool = False
