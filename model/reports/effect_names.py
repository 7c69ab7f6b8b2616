"""Names of effects and their joints, as a report writes them."""

from __future__ import annotations

from collections.abc import Sequence

_PROPER = {"coulomb": "Coulomb", "stribeck": "Stribeck"}


def effect_name(effect: str) -> str:
    """The name of an effect in words: Coulomb friction, back-EMF error, dead zone."""
    return " ".join(_PROPER.get(word, word) for word in effect.replace("back_emf", "back-EMF").split("_"))


def placed(effect: str, joints: Sequence[int]) -> str:
    """An effect and its joints: Coulomb friction, joint 2. Of the whole machine, the effect alone."""
    if not joints:
        return effect_name(effect)
    return f"{effect_name(effect)}, joint{'s' if len(joints) > 1 else ''} {'+'.join(map(str, joints))}"


def capitalised(text: str) -> str:
    """The text with a capital first letter, the rest as it is."""
    return text[:1].upper() + text[1:]
