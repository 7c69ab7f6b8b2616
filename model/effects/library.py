"""Every effect the library knows, by name."""

from __future__ import annotations

from functools import cache

from daq.contracts.effects import effect_names
from daq.contracts.errors import SpecError
from model.effects.control import CONTROL
from model.effects.effect import Effect
from model.effects.external import EXTERNAL
from model.effects.friction import FRICTION
from model.effects.load import LOAD
from model.effects.motor import MOTOR
from model.effects.sensor import SENSOR
from model.effects.transmission import TRANSMISSION


@cache
def library() -> dict[str, Effect]:
    """Effects by name, in the order of the shared list."""
    known = {e.name: e for e in (*FRICTION, *MOTOR, *TRANSMISSION, *LOAD, *EXTERNAL, *SENSOR, *CONTROL)}
    return {name: known[name] for name in effect_names()}


def effect(name: str) -> Effect:
    """The effect of that name. Raises SpecError with the names there are."""
    if name not in library():
        raise SpecError(f"effect {name!r}: not in the library; it has {', '.join(library())}")
    return library()[name]
