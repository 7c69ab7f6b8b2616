"""Every effect the library knows, by name."""

from __future__ import annotations

from functools import cache

from daq.contracts.effects import FORMER_EFFECTS, effect_names
from daq.contracts.errors import SpecError
from model.effects.controller import CONTROL
from model.effects.effect import Effect, EffectFile
from model.effects.external import EXTERNAL
from model.effects.friction import FRICTION
from model.effects.load import LOAD
from model.effects.machine_numbers import MACHINE_NUMBERS
from model.effects.motor import MOTOR
from model.effects.sensor import SENSOR
from model.effects.transmission import TRANSMISSION

BESIDE = {
    "direction_dependent_gear_loss": "gear_loss",
    "direction_dependent_viscous_friction": "viscous_friction",
}
"""Effects that a diagnosis tries, unless asked for by name, only on joints that have another effect already, and which.

A gear that loses κ only while its motor drives gives the torque of one that loses κ/2 both ways, with a constant
K_T (1 − κ/2). Within the tolerance of K_T it is `gear_loss`; to try both at once would make a group of every gear loss.
Friction in proportion to speed in one direction, and none in the other, is no law of the field; alone, it stands for a
constant force and friction together.
"""

_own: dict[str, Effect] = {}


@cache
def _shipped() -> dict[str, Effect]:
    known = {e.name: e for e in (*FRICTION, *MOTOR, *TRANSMISSION, *LOAD, *EXTERNAL, *SENSOR, *CONTROL)}
    return {name: known[name] for name in effect_names()}


def library() -> dict[str, Effect]:
    """Effects by name, in the order of the shared list; then the user's own that have been loaded."""
    return {**_shipped(), **_own}


def own_effects() -> dict[str, Effect]:
    """Effects of the user's own that have been loaded, by name."""
    return dict(_own)


def add_own(found: Effect) -> None:
    """Adds an effect of the user's own. Raises SpecError when another file's effect has its name."""
    other = _own.get(found.name)
    if other is not None and other != found:
        assert other.file is not None
        raise SpecError(f"effect {found.name}: loaded from another file {other.file.name} already; one at a time")
    _own[found.name] = found


def remove_own(name: str) -> None:
    """Removes an effect of the user's own from the library; models that have it can no longer be used."""
    _own.pop(name, None)


def effect(name: str) -> Effect:
    """The effect of that name. Raises SpecError with the names there are."""
    found = _shipped().get(name) or _own.get(name)
    if found is None and name in FORMER_EFFECTS:
        raise SpecError(f"effect {name}: no longer in the library: {FORMER_EFFECTS[name]}")
    if found is None:
        raise SpecError(f"effect {name!r}: not in the library; it has {', '.join(library())}")
    return found


def find_named_effect(name: str) -> Effect:
    """What a step of an answer names: an effect, or a number of the machine. Raises SpecError with the names."""
    return MACHINE_NUMBERS.get(name) or effect(name)


def effect_from(name: str, file: EffectFile | None) -> Effect:
    """The effect of that name, from the file that a model was made with.

    Raises SpecError when that file has not been loaded, or has changed since.
    """
    if file is None:
        return effect(name)
    found = _own.get(name)
    if found is None or found.file is None:
        raise SpecError(
            f"effect {name}: of the user's own; name its file, {file.name} (SHA-256 {file.sha256}…), with --effect-file"
        )
    if found.file.sha256 != file.sha256:
        raise SpecError(
            f"effect {name}: the model was made with {file.name} of SHA-256 {file.sha256}…, and {found.file.name} now "
            f"has {found.file.sha256}…: it was changed since; take the old file back, or fit again"
        )
    return found
