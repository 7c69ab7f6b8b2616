"""The shared names of physical effects."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources

UNKNOWN_EFFECT = "unknown_effect"
"""Name of every effect that is not in the shared list."""

FORMER_EFFECTS = {
    "back_emf_error": "it changed K_b alone, and K_T and K_b belong to one magnet; fit or diagnose again, with "
    "weakened_magnet or with the motor's back_emf_constant",
}
"""Names that saved models and answers may still have, and what to say of models that do."""


@dataclass(frozen=True)
class EffectName:
    """One effect: its usual name, where it acts, the family in which effects are easily confused, and one line."""

    name: str
    acts_on: str
    family: str
    line: str


@cache
def effect_names() -> dict[str, EffectName]:
    """Every shared effect by name, in the order of `effects.toml`."""
    text = resources.files("daq.contracts").joinpath("effects.toml").read_text("utf-8")
    return {name: EffectName(name=name, **entry) for name, entry in tomllib.loads(text).items()}


def shared_name(name: str) -> str:
    """`name` if it is a shared name, else UNKNOWN_EFFECT."""
    return name if name in effect_names() else UNKNOWN_EFFECT
