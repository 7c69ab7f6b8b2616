"""Machine parameters that may differ from the file, where no effect of the shared list has the same result.

A heavier link is the effect `link_mass`. A rotor of another inertia has no such effect: the model lacks nothing, but
one of its parameters is wrong. These parameters are named like effects so that an answer has only one kind of step.
They are not in the library, because nothing can be added to a model for them. Their words are in
`machine_numbers.toml`.
"""

from __future__ import annotations

from importlib import resources

from daq.contracts.effects import entries_of
from model.effects.effect import Effect

MACHINE_NUMBERS: dict[str, Effect] = {
    name: Effect(name, physics=entry.line, source="the machine file", parameters=(), own_entry=entry)
    for name, entry in entries_of(
        resources.files("model.effects").joinpath("machine_numbers.toml").read_text("utf-8")
    ).items()
}
"""By name, with an entry in the form of the shared list."""
