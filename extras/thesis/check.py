"""A statement of the source and whether the reproduction bears it out."""

from __future__ import annotations

from daq.contracts.frozen import FrozenRecord


class Check(FrozenRecord):
    """`holds`: whether our result agrees with the source's statement. `ours` and `published` are one line each."""

    name: str
    holds: bool
    ours: str
    published: str


class Choice(FrozenRecord):
    """A number that the source does not give, what was taken for it, and why."""

    what: str
    value: str
    why: str
