"""The effects of the library for clients."""

from __future__ import annotations

from daq.contracts.service.jobs import KnownEffect
from model.effects.library import library
from model.effects.names import effect_name


def known_effects() -> tuple[KnownEffect, ...]:
    """Returns the effects in the order of the shared list, which groups them by family."""
    return tuple(
        KnownEffect(
            name=one.name,
            called=effect_name(one.name),
            family=one.shared_name.family,
            title=one.shared_name.line,
            physics=one.physics,
            joints=one.joints,
            whole_machine=one.whole_machine,
        )
        for one in library().values()
    )
