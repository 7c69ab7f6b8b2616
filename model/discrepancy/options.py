"""How a diagnosis is to be done."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Protocol

from pydantic import BaseModel, ConfigDict, Field

from daq.contracts.errors import SpecError
from model.effects.library import effect

if TYPE_CHECKING:
    from model.machine_model.model import Model


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


class Searched(Protocol):
    """What the options of any diagnosis say of where to look, and for what."""

    @property
    def effects(self) -> tuple[str, ...] | None:
        """Names; None for all."""

    @property
    def joints(self) -> tuple[int, ...] | None:
        """Numbers from 1; None for all that the model moves."""


def check_options(options: Searched, model: Model) -> None:
    """That there is something to look for, where it is looked for.

    Raises SpecError for a joint that the model does not move, an effect that is not in the library, and one of the
    user's own that acts on other joints.
    """
    moved = model.machine.modelled_joints
    for joint in options.joints or ():
        if joint not in moved:
            raise SpecError(f"joints to look on: {joint} is not modelled; allowed are {_listed(moved)}")
    if options.effects == ():
        raise SpecError("effects to try: none is named; leave them out for all")
    looked_on = options.joints or moved
    for name in options.effects or ():
        own = effect(name).joints
        if own and not set(own) & set(looked_on):
            raise SpecError(
                f"effect {name}: its file has it on joints {_listed(own)} alone, and it is looked for on joints "
                f"{_listed(looked_on)}"
            )


def _listed(joints: tuple[int, ...]) -> str:
    return ", ".join(map(str, joints))
