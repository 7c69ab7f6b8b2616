"""Data that files and messages are made of."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict


class FrozenRecord(BaseModel):
    """Named values that do not change once made. Unknown ones are refused, never ignored."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    shown: ClassVar[tuple[str, ...]] = ()
    """Fields and properties that `repr` shows, for records that would fill a page; empty for all fields."""

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        if self.shown:
            return ((name, getattr(self, name)) for name in self.shown)
        return iter(super().__repr_args__())
