"""The shared names of physical effects, with texts about them."""

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
"""Names that saved models and answers may still contain, and the advice for models that do."""


@dataclass(frozen=True)
class EffectName:
    """Texts about one effect.

    name: its usual name. acts_on: where it acts. family: effects that are easily confused with it. line: a description.
    called: its name in a sentence. size: the parameter that is its size, if there is one. in_torques: how it shows in a
    balance of torques, with the placeholders {torque}, {angle} and {turn}.
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
    """Returns all shared effects by name, in the order of `effects.toml`."""
    return entries_of(resources.files("daq.contracts").joinpath("effects.toml").read_text("utf-8"))


def entries_of(text: str) -> dict[str, EffectName]:
    """Returns entries by name, from TOML in the form of `effects.toml`."""
    return {name: EffectName(name=name, **entry) for name, entry in tomllib.loads(text).items()}


def shared_name(name: str) -> str:
    """Returns `name` if it is a shared name, else UNKNOWN_EFFECT."""
    return name if name in effect_names() else UNKNOWN_EFFECT
