"""Routes over several robots: the same experiment on each, and a comparison of their fits."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import Query

from daq.contracts.errors import SpecError
from daq.contracts.service.fleet import FleetComparison, FleetExperimentRequest, FleetExperiments
from extras.lab.fleet.comparison import Arm, Comparisons
from server.api.dependencies import (
    ClockDep,
    Experiments,
    IdempotencyKey,
    Motions,
    Operator,
    Robots,
    Traces,
    Turn,
    Viewer,
    part,
)
from server.api.experiments import require_possible
from server.api.presets import with_preset
from server.bounded.workers import Workers
from server.catalogue.room import require_room
from server.jobs.mailbox import RESULT
from server.problems import PROBLEMS, ProblemError
from server.robot_services import RobotServices, robot_named
from server.routes import Router

router = Router(prefix="/fleet", tags=["fleet"], responses=PROBLEMS)


@router.post("/experiments", status_code=201)
def submit_fleet_experiment(
    body: FleetExperimentRequest,
    robots: Robots,
    experiments: Experiments,
    motions: Motions,
    clock: ClockDep,
    caller: Operator,
    _turn: Turn,
    idempotency_key: IdempotencyKey = None,
) -> FleetExperiments:
    """Puts the same experiment into the queue of several robots. If one of them cannot run it, none gets it.

    It begins when its robot's queue allows it: a paused queue stays paused. With the same Idempotency-Key each robot
    gets it once.
    """
    rigs = _chosen(robots, body.robots)
    body = body.model_copy(update={"request": with_preset(body.request)})
    new = [rig for rig in rigs if experiments.made_before(rig.robot.name, body.request, idempotency_key) is None]
    for rig in new:
        _require_possible(motions, rig, body)
    names = [rig.robot.name for rig in rigs]
    made = experiments.submit_to_each(names, body.request, clock.utc(), caller.name, idempotency_key)
    for rig, (experiment, is_new) in zip(rigs, made, strict=True):  # no queue begins before all of them have it
        if is_new:
            rig.queue.submitted(experiment, caller.name)
    shown = [rig.queue.with_progress(experiment) for rig, (experiment, _) in zip(rigs, made, strict=True)]
    return FleetExperiments(experiments=tuple(shown))


@router.get("/comparison")
def compare_fleet(
    robots: Robots,
    traces: Traces,
    comparisons: Annotated[Comparisons, part(Comparisons)],
    _: Viewer,
    _turn: Turn,
    experiment: Annotated[str | None, Query(max_length=400, description="Its name; else the most fitted one.")] = None,
    days: Annotated[float, Query(ge=0, le=36500, description="Least time between the compared fits, in days.")] = 30,
) -> FleetComparison:
    """Compares the robots' fits to the same experiment over time, and reports values that have changed."""
    arms = [
        Arm(
            rig.robot.name,
            partial(rig.jobs.result_file, name=RESULT),
            partial(traces.get, rig.robot.name),
        )
        for rig in robots
    ]
    return comparisons.compare(arms, experiment, days)


def _chosen(robots: list[RobotServices], names: tuple[str, ...] | None) -> list[RobotServices]:
    """Returns the robots of these names; all of them for None. Raises a 404 and a 422."""
    if names is None:
        return robots
    if len(set(names)) < len(names):
        raise ProblemError(422, "not-valid", "robots: one is named twice", "name each robot once")
    return [robot_named(robots, name) for name in names]


def _require_possible(motions: Workers, rig: RobotServices, body: FleetExperimentRequest) -> None:
    """Raises the problem of one robot, beginning with its name."""
    try:
        require_possible(motions, rig, body.request.spec)
        require_room(rig.catalogue.folder)
    except SpecError as error:
        raise SpecError(f"robot {rig.robot.name}: {error}; nothing was queued") from error
    except ProblemError as problem:
        line = f"robot {rig.robot.name}: {problem.detail}; nothing was queued"
        raise ProblemError(
            problem.status, problem.kind, line, problem.advice, problem.fields, problem.headers
        ) from problem
