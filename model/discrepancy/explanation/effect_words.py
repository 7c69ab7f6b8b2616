"""The words for an effect: its name in a sentence, its size, and what it looks like in torques. They are entries of
`daq/contracts/effects.toml`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from daq.contracts.effects import FORMER_EFFECTS, EffectName, effect_names
from model.discrepancy.diagnosis import FoundValue
from model.discrepancy.numbers import plain
from model.effects.library import find_named_effect
from model.effects.machine_numbers import MACHINE_NUMBERS
from model.effects.names import effect_name, joints_in_words

TURNING = {"torque": "torque", "angle": "angle", "turn": "turn"}
SLIDING = {"torque": "force", "angle": "position", "turn": "metre"}
"""Words for joints that turn, and for joints that slide."""
SHOWN = {"rad": (math.degrees(1.0), "°"), "1": (100.0, " %"), "s": (1e3, " ms"), "H": (1e3, " mH")}
"""Factor and unit in which people read a size, by its unit in SI."""


def entry_of(effect: str) -> EffectName | None:
    """The entry of an effect of the shared list, or of a number of the machine; None for another's."""
    number = MACHINE_NUMBERS.get(effect)
    return effect_names().get(effect) if number is None else number.own_entry


def called(effect: str, joints: Sequence[int] = ()) -> str:
    """The effect in a sentence: “a dead zone of the amplifier on joint 2”."""
    entry = entry_of(effect)
    own = "" if effect in FORMER_EFFECTS else " (an effect of the user's own)"
    name = f"{effect_name(effect)}{own}" if entry is None else entry.called
    return f"{name} on {joints_in_words(joints)}" if joints else name


def sizes_of(effect: str, parameters: Mapping[str, FoundValue]) -> list[FoundValue]:
    """The parameters that are sizes of an effect: one of each joint, or every one of a number of the machine."""
    entry = entry_of(effect)
    return [v for v in parameters.values() if effect in MACHINE_NUMBERS or (entry and v.part == entry.size)]


def size_on(joint: int, effect: str, parameters: Mapping[str, FoundValue]) -> FoundValue | None:
    """The size of an effect on a joint, or the one that it has; None where it has no single size."""
    sizes = [] if effect in MACHINE_NUMBERS else sizes_of(effect, parameters)
    return next((v for v in sizes if joint in v.joints), sizes[0] if sizes else None)


def size_words(value: FoundValue) -> str:
    """“0.93° (0.90 to 0.96)”: an estimate in the units that people read, with its interval if it has one."""
    factor, unit = SHOWN.get(value.unit, (1.0, f" {value.unit}"))
    interval = ""
    if value.low is not None and value.high is not None:
        interval = f" ({plain(value.low * factor, 3)} to {plain(value.high * factor, 3)})"
    return f"{plain(value.value * factor, 3)}{unit}{interval}"


def shape_in_torques(effect: str, *, slides: bool) -> str:
    """What an effect looks like in a balance of torques; of the user's own effects, the equation."""
    entry = entry_of(effect)
    if entry is None:
        return find_named_effect(effect).physics
    return entry.in_torques.format(**(SLIDING if slides else TURNING)) or entry.line
