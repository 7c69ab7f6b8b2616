"""A statement of the source, and whether the reproduction agrees with it."""

from __future__ import annotations

from daq.contracts.frozen import FrozenRecord


class Check(FrozenRecord):
    """`holds`: whether our result agrees with the source's statement. `ours` and `published` are one line each."""

    name: str
    holds: bool
    ours: str
    published: str


class Choice(FrozenRecord):
    """A value that the source does not give, the value that was chosen, and why."""

    what: str
    value: str
    why: str
