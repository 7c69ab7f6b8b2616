"""The shared names of physical effects, and their words."""

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
    """One effect in words.

    name: its usual one. acts_on: where it acts. family: of effects that are easily confused. line: one line on it.
    called: its name in a sentence. size: the parameter that is its size, if one is. in_torques: how a balance of
    torques shows it, with {torque}, {angle} and {turn}.
    """

    name: str
    acts_on: str
    family: str
    line: str
    called: str = ""
    size: str | None = None
    in_torques: str = ""


@cache
def effect_names() -> dict[str, EffectName]:
    """Every shared effect by name, in the order of `effects.toml`."""
    return entries_of(resources.files("daq.contracts").joinpath("effects.toml").read_text("utf-8"))


def entries_of(text: str) -> dict[str, EffectName]:
    """Entries by name, from TOML in the form of `effects.toml`."""
    return {name: EffectName(name=name, **entry) for name, entry in tomllib.loads(text).items()}


def shared_name(name: str) -> str:
    """`name` if it is a shared name, else UNKNOWN_EFFECT."""
    return name if name in effect_names() else UNKNOWN_EFFECT
