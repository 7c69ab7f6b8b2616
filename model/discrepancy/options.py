"""How a diagnosis is to be done."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field


class DiagnosisOptions(BaseModel):
    """How a diagnosis is to be done; the defaults suit traces of a machine with a known controller.

    effects: candidates by name; None for the whole library and loaded effects of the user's own.
    joints: on these joints only; None for all that the model moves.
    most_steps: effects that may be added, one after the other.
    fitted: candidates a step that are fitted after the probes.
    polished: best of these whose fit is taken to its end.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    effects: tuple[str, ...] | None = None
    joints: tuple[int, ...] | None = None
    most_steps: Annotated[int, Field(ge=1, le=10)] = 3
    fitted: Annotated[int, Field(ge=1, le=100)] = 8
    polished: Annotated[int, Field(ge=1, le=100)] = 3
