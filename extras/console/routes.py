"""Routes of the console, the macros and the calendar. None of them moves the arm, or queues anything."""

from __future__ import annotations

from datetime import timedelta
from typing import Annotated

from fastapi import Path, Query, Response

from daq.contracts.errors import SpecError
from daq.contracts.service.base import Moment
from extras.console.calendar import planned
from extras.console.language import commands, read, with_rule
from extras.console.macros import examples, expand
from extras.console.messages import (
    NAME,
    ConsoleCommand,
    ConsoleLine,
    ConsoleOrder,
    KeptMacro,
    Macro,
    MacroReading,
    Macros,
    MacroValues,
    PlannedRun,
    WrittenLine,
)
from extras.console.store import all_macros, get_macro, put_macro, remove_macro
from extras.console.written import line_of
from server.api.dependencies import Experiments, Identity, Operator, RobotDep, Schedules, ServicesDep, Viewer
from server.problems import PROBLEMS, ProblemError
from server.robot_services import RobotServices
from server.routes import Router

router = Router(prefix="/robots/{robot}", tags=["console"], responses=PROBLEMS)
MacroName = Annotated[str, Path(pattern=NAME, max_length=63, description="Name of the macro.")]
Revision = Annotated[int | None, Query(ge=1, lt=2**31, description="The revision that was changed.")]
LONGEST = timedelta(days=62)
"""Longest part of the calendar in one answer: two months."""
PAGE = 500


@router.get("/console/commands")
def list_console_commands(_: RobotDep, __: Viewer) -> tuple[ConsoleCommand, ...]:
    """Lists the commands of the console with their options, for completion and help."""
    return commands()


@router.post("/console/read")
def read_console_line(request: ConsoleLine, rig: RobotDep, _: Viewer) -> ConsoleOrder:
    """Returns what a line of the command line's language asks for. Carries out nothing."""
    return with_rule(read(request.line, rig.robot.machine), rig.robot.clock.utc())


@router.get("/experiments/{experiment}/line")
def get_experiment_line(experiment: Identity, rig: RobotDep, experiments: Experiments, _: Viewer) -> WrittenLine:
    """Returns the line that runs this experiment once more: a start for a macro."""
    return WrittenLine(line=line_of(experiments.get(rig.robot.name, experiment).spec, rig.robot.machine))


@router.get("/macros")
def list_macros(rig: RobotDep, services: ServicesDep, _: Viewer) -> Macros:
    """Lists the stored macros, most recently changed first, and examples."""
    return Macros(kept=all_macros(services.store, rig.robot.name), examples=examples())


@router.post("/macros/read")
def read_macro(request: Macro, rig: RobotDep, _: Viewer) -> MacroReading:
    """Checks a macro that is not stored, with the defaults of its parameters."""
    return _ruled(expand(request, {}, rig.robot.machine), rig)


@router.put("/macros/{macro}")
def put_macro_(
    macro: MacroName,
    request: Macro,
    rig: RobotDep,
    services: ServicesDep,
    caller: Operator,
    revision: Revision = None,
) -> KeptMacro:
    """Stores a macro, or a change to its `revision`. Its lines must be valid with its defaults. Moves nothing."""
    if request.name != macro:
        raise SpecError(f"name: is {request.name}, but the path has {macro}; a macro keeps its name")
    expand(request, {}, rig.robot.machine)
    return put_macro(services.store, rig.robot.name, request, revision, rig.robot.clock.utc(), caller.name)


@router.delete("/macros/{macro}", status_code=204)
def delete_macro(macro: MacroName, rig: RobotDep, services: ServicesDep, caller: Operator) -> Response:
    """Deletes a macro permanently."""
    remove_macro(services.store, rig.robot.name, macro)
    rig.record_event("experiment", f"macro {macro} was deleted", actor=caller.name)
    return Response(status_code=204)


@router.post("/macros/{macro}/read")
def read_kept_macro(
    macro: MacroName, request: MacroValues, rig: RobotDep, services: ServicesDep, _: Viewer
) -> MacroReading:
    """Returns the experiments of a macro with these values. Queues nothing: a client submits them."""
    return _ruled(expand(get_macro(services.store, rig.robot.name, macro), request.values, rig.robot.machine), rig)


@router.get("/calendar")
def get_calendar(
    rig: RobotDep, experiments: Experiments, schedules: Schedules, _: Viewer, begin: Moment, end: Moment
) -> tuple[PlannedRun, ...]:
    """Lists what will be due from `begin` until before `end`. A due run is submitted; it moves the arm only if the
    queue may."""
    if not timedelta() < end - begin <= LONGEST:
        raise ProblemError(422, "not-valid", f"end: must come 1 s to {LONGEST.days} days after begin")
    waiting = experiments.page(rig.robot.name, ("queued",), None, None, PAGE).items
    return planned(schedules.page(rig.robot.name, None, PAGE).items, waiting, begin, end)


def _ruled(reading: MacroReading, rig: RobotServices) -> MacroReading:
    now = rig.robot.clock.utc()
    return reading.model_copy(update={"orders": tuple(with_rule(order, now) for order in reading.orders)})
