"""Routes of taught programs, which the service stores until they are deleted."""

from __future__ import annotations

from typing import Annotated

from fastapi import Path, Query, Response

from daq.contracts.service.teaching import ProgramEntry
from daq.teaching.program import NAME, Program
from server.api.dependencies import Operator, Programs, RobotDep, Viewer
from server.problems import PROBLEMS
from server.routes import Router
from server.store.programs import StoredProgram

router = Router(prefix="/robots/{robot}/programs", tags=["teaching"], responses=PROBLEMS)
ProgramName = Annotated[str, Path(pattern=f"^{NAME}$", description="Name of the program.")]
Revision = Annotated[
    int | None,
    Query(ge=1, lt=2**31, description="The revision that was changed. Omit it for a new program."),
]


@router.get("")
def list_programs(rig: RobotDep, programs: Programs, _: Viewer) -> tuple[ProgramEntry, ...]:
    """Lists the stored programs, most recently changed first."""
    return programs.all(rig.robot.name)


@router.get("/{program}")
def get_program(program: ProgramName, rig: RobotDep, programs: Programs, _: Viewer) -> StoredProgram:
    """Returns one program with its revision, which a change must state."""
    return programs.get(rig.robot.name, program)


@router.put("/{program}")
def put_program(
    program: ProgramName,
    request: Program,
    rig: RobotDep,
    programs: Programs,
    caller: Operator,
    revision: Revision = None,
) -> ProgramEntry:
    """Stores a program, or a change to its `revision`. Moves nothing and needs no control.

    A body with another name than the path renames the program. A program that another client has changed meanwhile is
    not overwritten (409).
    """
    return programs.put(rig.robot.name, program, request, revision, rig.robot.clock.utc(), caller.name)


@router.delete("/{program}", status_code=204)
def delete_program(program: ProgramName, rig: RobotDep, programs: Programs, caller: Operator) -> Response:
    """Deletes a program permanently."""
    programs.remove(rig.robot.name, program)
    rig.record_event("teaching", f"program {program} was deleted", actor=caller.name)
    return Response(status_code=204)
