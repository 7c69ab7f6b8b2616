"""Options of a diagnosis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Protocol

from pydantic import Field

from daq.contracts.errors import SpecError
from daq.contracts.frozen import SpokenRecord
from model.discrepancy.grounds import Method
from model.effects.library import effect

if TYPE_CHECKING:
    from model.machine_model.model import Model


class DiagnosisOptions(SpokenRecord):
    """Options of a diagnosis; the defaults suit traces of a machine with a known controller.

    effects: candidates by name; None for the whole library and loaded effects of the user's own.
    joints: on these joints only; None for all that the model moves.
    most_steps: effects that may be added, one after another.
    method: how model and records are compared; None: as machine and traces allow (`method_choice`).
    fitted: candidates per step that are fitted after the probes.
    polished: how many of the best fits are taken to their ends.
    despite_doubts: compute although a record is doubted; the verdict stays `check-the-record`.
    """

    effects: tuple[str, ...] | None = None
    joints: tuple[int, ...] | None = None
    most_steps: Annotated[int, Field(ge=1, le=10)] = 3
    method: Method | None = None
    fitted: Annotated[int, Field(ge=1, le=100)] = 8
    polished: Annotated[int, Field(ge=1, le=100)] = 3
    despite_doubts: bool = False


class SearchOptions(Protocol):
    """Options of either method that limit the search to effects and joints."""

    @property
    def effects(self) -> tuple[str, ...] | None:
        """Names; None for all."""

    @property
    def joints(self) -> tuple[int, ...] | None:
        """Numbers from 1; None for all that the model moves."""


def check_options(options: SearchOptions, model: Model) -> None:
    """Raises SpecError for options that leave nothing to look for.

    That is a joint that the model does not move, an effect that is not in the library, or a user's own effect that acts
    on other joints.
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
