"""Routes of the demonstration: hide an effect, and follow its diagnosis."""

from __future__ import annotations

from typing import Annotated

from daq.contracts.service.hidden import Hidden, HideRequest, HidingPlace
from extras.demonstration.part import Demonstrations
from server.api.dependencies import Operator, RobotDep, Turn, Viewer, part
from server.problems import PROBLEMS
from server.routes import Router

router = Router(prefix="/robots/{robot}/hidden", tags=["demonstration"], responses=PROBLEMS)
Demonstration = Annotated[Demonstrations, part(Demonstrations)]


@router.post("", status_code=201)
def hide_effect(body: HideRequest, rig: RobotDep, made: Demonstration, caller: Operator, _turn: Turn) -> Hidden:
    """Hides an effect in a separate mock, records it in lock-step, and has it diagnosed. Only for robots on a mock."""
    return made.begin(rig, body, caller.name)


@router.get("")
def get_hiding_place(rig: RobotDep, made: Demonstration, _: Viewer, _turn: Turn) -> HidingPlace:
    """Returns the effects that can be hidden, and the latest demonstration; its secret once the diagnosis has
    answered."""
    return made.place(rig)
