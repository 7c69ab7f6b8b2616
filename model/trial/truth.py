"""The effects hidden in an arm, as `python -m mock_controller.reveal` prints them, and their detectability."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from daq.contracts.effects import UNKNOWN_EFFECT, effect_names

Kind = Literal["clean", "single", "open_set", "pair", "shared_by_joints", "wrong_priors", "later_single"]

DETECTABLE = 5.0
"""Least d′ at which an effect counts as detectable."""
MERGED_FRICTION = "friction"
"""Name of all kinds of friction when they are merged."""
FRICTION_OF_MOCK = ("tight_spot", "cable_hysteresis", "ageing_friction")
"""Effects that only the mock has and that are friction too."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)


class HiddenEffect(_Part):
    """One hidden effect: the mock's name, the shared name (or `unknown_effect`), joints, one set of parameters per
    joint (one set without joints for an effect on the whole arm), strength 0 to 1 within its range of sizes."""

    effect: str
    known_as: str
    joints: tuple[int, ...]
    parameters: tuple[dict[str, float], ...]
    strength: float

    def at(self, joint: int | None) -> dict[str, float]:
        """Returns its parameters at a joint."""
        return self.parameters[0 if joint is None else self.joints.index(joint)]


class Truth(_Part):
    """An arm revealed. `deviations`: fractions of the data file's values; that of the computing delay in s."""

    seed: int
    kind: Kind
    load: str
    load_kg: float | None
    effects: tuple[HiddenEffect, ...]
    deviations: dict[str, float]

    @property
    def is_strange(self) -> bool:
        """Whether its effect is none of the library's; one that was drawn as such may have come to it later."""
        return self.kind == "open_set" and any(e.known_as == UNKNOWN_EFFECT for e in self.effects)


class SeenEffect(_Part):
    """d′ of one effect with the arm's others acting."""

    effect: str
    d_prime: float


class Detectability(_Part):
    """d′ of an arm's effects together and one by one, computed on the mock's side before any diagnosis."""

    seed: int
    d_prime: float
    effects: tuple[SeenEffect, ...] = ()

    @property
    def every_effect_detectable(self) -> bool:
        """Whether there is an effect, and each is detectable."""
        return bool(self.effects) and all(seen.d_prime >= DETECTABLE for seen in self.effects)


def merged(name: str) -> str:
    """Returns the effect's name, or one common name for all kinds of friction."""
    known = effect_names().get(name)
    return MERGED_FRICTION if known is not None and known.family == "friction" else name


def is_mock_friction(name: str) -> bool:
    """Whether an effect that only the mock has is friction."""
    return name in FRICTION_OF_MOCK


def parse_truth(data: dict[str, Any]) -> Truth:
    """Parses the truth from one line of `reveal`. Raises pydantic's ValidationError for anything else."""
    return Truth.model_validate(data)
