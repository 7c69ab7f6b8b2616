"""Numbers of a machine that may be other than its file states, where no effect of the shared list does the same.

A heavier link is `link_mass`. A rotor of another inertia has no such name: the machine has nothing that the model
lacks, one of its numbers is wrong. They are named like effects so that an answer has one kind of step, but they are
not in the library: nothing can be added to a model for them.
"""

from __future__ import annotations

from daq.contracts.effects import EffectName
from model.effects.effect import Effect


def _number(name: str, acts_on: str, family: str, line: str) -> Effect:
    entry = EffectName(name=name, acts_on=acts_on, family=family, line=line)
    return Effect(name, physics=line, source="the machine file", parameters=(), own_entry=entry)


MACHINE_NUMBERS: dict[str, Effect] = {
    e.name: e
    for e in (
        _number(
            "wrong_rotor_inertia", "joint torque", "inertia", "the rotor's inertia differs from the machine file's"
        ),
        _number("wrong_link_inertia", "load", "inertia", "a link's moments of inertia differ from the machine file's"),
        _number("wrong_link_centre", "load", "inertia", "a link's centre of mass differs from the machine file's"),
        _number("wrong_geometry", "load", "geometry", "a link's dimensions differ from the machine file's"),
        _number(
            "wrong_torque_constant", "drive", "motor", "the motor's torque constant differs from the machine file's"
        ),
        _number("wrong_resistance", "drive", "motor", "the winding's resistance differs from the machine file's"),
        _number("wrong_drive_gain", "drive", "motor", "the drive's gain differs from the machine file's"),
        _number("wrong_gear_ratio", "transmission", "motor", "the gear ratio differs from the machine file's"),
    )
}
"""By name, with the entry that the shared list would have."""
