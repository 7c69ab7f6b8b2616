"""Taught programs: kept by the service until they are deleted, changed, and carried out."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query, Response

from daq.contracts.service.teaching import ProgramEntry, TeachingStatus
from daq.teaching import Program
from daq.teaching.program import NAME
from server.api.parts import Arrived, LeaseHeader, Operator, RobotPart, ServicesPart, Viewer
from server.problems import PROBLEMS
from server.store.programs import StoredProgram

router = APIRouter(prefix="/robots/{robot}/programs", tags=["teaching"], responses=PROBLEMS)
ProgramName = Annotated[str, Path(pattern=f"^{NAME}$", description="Name of the program.")]
Revision = Annotated[
    int | None,
    Query(ge=1, lt=2**31, description="The revision that you changed. Leave it out for a new program."),
]


@router.get("")
def list_programs(one: RobotPart, found: ServicesPart, _: Viewer) -> tuple[ProgramEntry, ...]:
    """Programs that are kept, the one changed last first."""
    return found.programs.all(one.robot.name)


@router.get("/{program}")
def get_program(program: ProgramName, one: RobotPart, found: ServicesPart, _: Viewer) -> StoredProgram:
    """One program, with the revision that a change of it names."""
    return found.programs.get(one.robot.name, program)


@router.put("/{program}")
def put_program(
    program: ProgramName,
    request: Program,
    one: RobotPart,
    found: ServicesPart,
    who: Operator,
    revision: Revision = None,
) -> ProgramEntry:
    """Keeps a program, or a change of it: `revision` is the one that was changed. Moves nothing, and needs no control.

    A body with another name than the address renames it. What somebody else has changed meanwhile is not overwritten:
    409.
    """
    return found.programs.put(one.robot.name, program, request, revision, found.clock.utc(), who.name)


@router.delete("/{program}", status_code=204)
def delete_program(program: ProgramName, one: RobotPart, found: ServicesPart, who: Operator) -> Response:
    """Deletes a program for good."""
    found.programs.remove(one.robot.name, program)
    found.tell(one.robot.name, "teaching", f"program {program} was deleted", actor=who.name)
    return Response(status_code=204)


@router.post("/{program}/run", status_code=202)
def run_stored_program(
    program: ProgramName,
    one: RobotPart,
    found: ServicesPart,
    _: Operator,
    arrived: Arrived,
    lease: LeaseHeader = None,
) -> TeachingStatus:
    """Carries out a kept program, as POST …/teaching/program does with one that is sent."""
    one.require_motion(lease)
    one.teaching.perform(one.word(lease, arrived), found.programs.get(one.robot.name, program).program)
    return one.teaching.status()
