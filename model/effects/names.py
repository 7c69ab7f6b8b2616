"""Names of effects and their joints for people."""

from __future__ import annotations

from collections.abc import Sequence

_PROPER = {"coulomb": "Coulomb", "stribeck": "Stribeck", "emf": "EMF"}
_HYPHENATED = {
    "back_emf": "back-EMF",
    "load_dependent": "load-dependent",
    "gravity_torque": "gravity-torque",
    "direction_dependent": "direction-dependent",
    "one_sided": "one-sided",
}


def effect_name(effect: str) -> str:
    """Returns the name in words, such as "Coulomb friction"."""
    for identifier, name in _HYPHENATED.items():
        effect = effect.replace(identifier, name)
    return " ".join(_PROPER.get(word, word) for word in effect.split("_"))


def effect_on(effect: str, joints: Sequence[int]) -> str:
    """Returns an effect within a sentence: "Coulomb friction on joint 2"; without joints for the whole machine."""
    return f"{effect_name(effect)} on {joints_in_words(joints)}" if joints else effect_name(effect)


def placed(effect: str, joints: Sequence[int]) -> str:
    """Returns an effect within a list: "Coulomb friction, joint 2"; without joints for the whole machine."""
    if not joints:
        return effect_name(effect)
    return f"{effect_name(effect)}, joint{'s' if len(joints) > 1 else ''} {'+'.join(map(str, joints))}"


def joints_in_words(joints: Sequence[int]) -> str:
    """Returns "joint 2", "joints 1 and 2", or "joints 1, 2 and 3"."""
    names = [str(j) for j in joints]
    if len(names) == 1:
        return f"joint {names[0]}"
    return f"joints {', '.join(names[:-1])} and {names[-1]}"


def capitalised(text: str) -> str:
    """Returns the text with a capital first letter and the rest unchanged."""
    return text[:1].upper() + text[1:]
