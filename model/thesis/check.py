"""A statement of the source and whether the reproduction bears it out."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Check(_Part):
    """`holds`: whether our result agrees with the source's statement. `ours` and `published` are one line each."""

    name: str
    holds: bool
    ours: str
    published: str


class Choice(_Part):
    """A number that the source does not give, what was taken for it, and why."""

    what: str
    value: str
    why: str
