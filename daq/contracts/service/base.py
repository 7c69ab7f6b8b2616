"""What the models of the service have in common."""

from __future__ import annotations

from typing import Annotated, Generic, TypeVar

from pydantic import BaseModel, ConfigDict, Field


class Wire(BaseModel):
    """A message of the service. A field that nobody knows is refused, never ignored."""

    model_config = ConfigDict(extra="forbid", frozen=True)


T = TypeVar("T")
PageLimit = Annotated[int, Field(ge=1, le=500)]


class Page(Wire, Generic[T]):
    """A part of a list. `next` is the cursor of the part that follows; None at the end."""

    items: tuple[T, ...]
    next: str | None = None
