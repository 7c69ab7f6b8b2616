"""Numbers of a machine that may be other than its file states, where no effect of the shared list does the same.

A heavier link is `link_mass`. A rotor of another inertia has no such name: the machine has nothing that the model
lacks, one of its numbers is wrong. They are named like effects so that an answer has one kind of step, but they are
not in the library: nothing can be added to a model for them. `machine_numbers.toml` has their words.
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
"""By name, with the entry that the shared list would have."""
