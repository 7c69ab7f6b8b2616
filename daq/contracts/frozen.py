"""Data that files and messages are made of."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class FrozenRecord(BaseModel):
    """Named values that do not change once made. Unknown ones are refused, never ignored."""

    model_config = ConfigDict(extra="forbid", frozen=True)
