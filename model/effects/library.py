"""The library of effects, by name."""

from __future__ import annotations

import hashlib
import sys
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from daq.contracts.documents import read_text
from daq.contracts.effects import FORMER_EFFECTS, effect_names
from daq.contracts.errors import SpecError
from daq.contracts.refused import nearest
from model.effects.effect import Effect, EffectFile
from model.effects.friction import FRICTION
from model.effects.load import EXTERNAL, LOAD
from model.effects.machine_numbers import MACHINE_NUMBERS
from model.effects.motor import MOTOR
from model.effects.own import OwnEffect, as_library_effect
from model.effects.sensor import CONTROL, SENSOR
from model.effects.transmission import TRANSMISSION

BESIDE = {
    "direction_dependent_gear_loss": "gear_loss",
    "direction_dependent_viscous_friction": "viscous_friction",
}
"""Effects that a diagnosis tries only on joints that already have a certain other effect, unless requested by name.

A gear that loses κ only while its motor drives gives the same torque as one that loses κ/2 both ways with a constant
K_T (1 − κ/2). Within the tolerance of K_T, that is `gear_loss`: trying both at once would make every gear loss
ambiguous. Friction in proportion to speed in only one direction is no law of the field. Alone, it imitates a constant
force plus friction.
"""
RARELY_ALONE = {"quadratic_drag": "viscous_friction"}
"""Effects that act alone, without a certain other one on their joints, a hundred times more rarely than others do:
drag nearly always acts beside viscous friction, but a propeller has nothing else."""

_own: dict[str, Effect] = {}


@cache
def _shipped() -> dict[str, Effect]:
    known = {e.name: e for e in (*FRICTION, *MOTOR, *TRANSMISSION, *LOAD, *EXTERNAL, *SENSOR, *CONTROL)}
    return {name: known[name] for name in effect_names()}


def library() -> dict[str, Effect]:
    """Returns effects by name, in the order of the shared list, then users' loaded effects."""
    return {**_shipped(), **_own}


def own_effects() -> dict[str, Effect]:
    """Returns users' loaded effects by name."""
    return dict(_own)


def add_own(found: Effect) -> None:
    """Adds a user's effect. Raises SpecError if an effect of another file has its name."""
    other = _own.get(found.name)
    if other is not None and other != found:
        assert other.file is not None
        raise SpecError(
            f"effect {found.name}: already loaded from another file, {other.file.name}; only one can be loaded"
        )
    _own[found.name] = found


def remove_own(name: str) -> None:
    """Removes a user's effect from the library; models that contain it can no longer be used."""
    _own.pop(name, None)


def effect(name: str) -> Effect:
    """Returns the effect of that name. Raises SpecError with the available names."""
    found = _shipped().get(name) or _own.get(name)
    if found is None and name in FORMER_EFFECTS:
        raise SpecError(f"effect {name}: no longer in the library: {FORMER_EFFECTS[name]}")
    if found is None:
        near = nearest(name, library())
        raise SpecError(f"effect {name!r:.80}: not in the library{near}; it has {', '.join(library())}")
    return found


def find_named_effect(name: str) -> Effect:
    """Returns the effect or machine parameter that a step of an answer names. Raises SpecError with the names."""
    return MACHINE_NUMBERS.get(name) or effect(name)


def effect_from(name: str, file: EffectFile | None) -> Effect:
    """Returns the effect of that name, from the file that a model was made with.

    Raises SpecError if that file has not been loaded, or has changed since.
    """
    if file is None:
        return effect(name)
    found = _own.get(name)
    if found is None or found.file is None:
        raise SpecError(
            f"effect {name}: defined by a user; name its file, {file.name} (SHA-256 {file.sha256}…), with --effect-file"
        )
    if found.file.sha256 != file.sha256:
        raise SpecError(
            f"effect {name}: the model was made with {file.name} of SHA-256 {file.sha256}…, but that file now has "
            f"{found.file.sha256}…: restore the old file, or fit again"
        )
    return found


# --- Loads users' effects from files into the library, where they stay until they are removed
#
# Loading runs the file, so only a file that a person names is loaded. A saved model states the name and hash of the
# file that it needs, but never makes a program run it.


HASH_DIGITS = 16
EFFECT = "EFFECT"


def load_effect_file(path: Path) -> Effect:
    """Returns the effect that a file defines as `EFFECT`, and adds it to the library; loading it twice changes nothing.

    Raises SpecError, in one line, for a file that cannot be read or run, or that defines no valid effect, and for an
    effect name that another loaded file uses.
    """
    source = read_text(path, f"effect file {path}").encode()
    if path.suffix != ".py":
        raise SpecError(f"effect file {path}: it is Python, so its name must end in .py")
    file = EffectFile(name=path.name, sha256=hashlib.sha256(source).hexdigest()[:HASH_DIGITS])
    for known in own_effects().values():
        if known.file == file:
            return known
    found = as_library_effect(_stated(path, file), file)
    add_own(found)
    return found


def _stated(path: Path, file: EffectFile) -> OwnEffect:
    """Runs the file under a module name of its own; returns the effect that it defines."""
    name = f"own_effect_{file.sha256}"
    spec = spec_from_file_location(name, path.resolve())
    if spec is None or spec.loader is None:
        raise SpecError(f"effect file {path}: cannot be loaded as Python")
    module = module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and numba look up a function's module by its name
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise SpecError(f"effect file {path}: running it raises {type(error).__name__}: {error}") from error
    stated = getattr(module, EFFECT, None)
    if not isinstance(stated, OwnEffect):
        raise SpecError(f"effect file {path}: defines no effect; write {EFFECT} = OwnEffect(…), see docs/own-effect.md")
    return stated
