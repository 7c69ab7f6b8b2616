"""Routes of experiments: submit, list, follow, cancel."""

from __future__ import annotations

from typing import Annotated

from fastapi import Query, Response

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.service.base import Page
from daq.contracts.service.experiments import (
    ENDS,
    ApprovalRequest,
    Experiment,
    ExperimentChange,
    ExperimentOrder,
    ExperimentRequest,
    ExperimentState,
    MotionPreview,
)
from daq.safety.preview import preview_of
from daq.trajectories.length import least_length, points_of
from server.access.caller import Caller
from server.api.dependencies import (
    CursorOf,
    Experiments,
    IdempotencyKey,
    Identity,
    Limit,
    Motions,
    Operator,
    RobotDep,
    Turn,
    Viewer,
)
from server.api.presets import with_preset
from server.bounded.messages import WorkOutMotion
from server.bounded.workers import ExhaustedError, Workers
from server.catalogue.room import require_room
from server.experiments.schedule import LONGEST
from server.live.waiting import Wait, when_ended
from server.problems import PROBLEMS, ProblemError
from server.robot_services import RobotServices
from server.routes import Router
from server.store.experiments import ExperimentStore

MOST_SHOWN = 5000
"""Most set points in a preview; of a longer motion only every second, third, … is returned."""
SHORT, FEW_POINTS = 60.0, 5000
"""Longest motion (s) and most given set points that are planned here, which is quick; a process plans others."""
router = Router(prefix="/robots/{robot}/experiments", tags=["experiments"], responses=PROBLEMS)
StateFilter = Annotated[list[ExperimentState] | None, Query(description="Only experiments in one of these states.")]


@router.post("", status_code=201, response_model=Experiment, responses={200: {"model": Experiment}})
def submit_experiment(
    request: ExperimentRequest,
    rig: RobotDep,
    experiments: Experiments,
    motions: Motions,
    caller: Operator,
    response: Response,
    _turn: Turn,
    idempotency_key: IdempotencyKey = None,
) -> Experiment:
    """Puts an experiment into the queue. It is checked now and again when it runs; a 422 names what is wrong.

    The same Idempotency-Key returns the same experiment (200) and never queues a second one.
    """
    request = with_preset(request)
    experiment, new = experiments.made_before(rig.robot.name, request, idempotency_key), False
    if experiment is None:  # an accepted request stays accepted, even if the disk is full by now
        require_possible(motions, rig, request.spec)
        require_room(rig.catalogue.folder)
        experiment, new = rig.queue.submit(request, caller.name, idempotency_key)
    response.status_code = 201 if new else 200
    response.headers["Location"] = f"/api/v1/robots/{rig.robot.name}/experiments/{experiment.id}"
    return rig.queue.with_progress(experiment)


@router.get("")
def list_experiments(
    rig: RobotDep,
    experiments: Experiments,
    _: Viewer,
    state: StateFilter = None,
    schedule: Annotated[str | None, Query(max_length=64)] = None,
    order: Annotated[ExperimentOrder, Query(description="`ended` lists only those that have ended.")] = "submitted",
    limit: Limit = 50,
    cursor: CursorOf = None,
) -> Page[Experiment]:
    """Lists experiments, the last submitted or the last ended first."""
    page = experiments.page(rig.robot.name, tuple(state or ()), schedule, cursor, limit, order)
    return page.model_copy(update={"items": tuple(rig.queue.with_progress(item) for item in page.items)})


@router.post("/preview")
def preview_experiment(
    request: ExperimentRequest, rig: RobotDep, motions: Motions, _: Viewer, _turn: Turn
) -> MotionPreview:
    """Plans an experiment and returns its motion and all violations of limits. Nothing is queued, nothing moves."""
    return _preview(motions, rig, with_preset(request).spec, MOST_SHOWN)


@router.get("/{experiment}")
async def get_experiment(
    experiment: Identity, rig: RobotDep, experiments: Experiments, _: Viewer, wait: Wait = 0
) -> Experiment:
    """Returns one experiment with its state, progress and outcome. With `wait`, answers when it has ended."""
    return await when_ended(
        rig.hub,
        {"events"},
        lambda: rig.queue.with_progress(experiments.get(rig.robot.name, experiment)),
        lambda now: now.state in ENDS,
        wait,
    )


@router.patch("/{experiment}")
def change_experiment(
    experiment: Identity,
    change: ExperimentChange,
    rig: RobotDep,
    experiments: Experiments,
    motions: Motions,
    caller: Operator,
    _turn: Turn,
) -> Experiment:
    """Changes a waiting experiment: the caller's own or, for owners of the robot, anybody's.

    A new specification is checked like that of a new experiment, and ends its approval.
    """
    _require_own(experiments, rig, caller, experiment)
    if change.spec is not None:
        require_possible(motions, rig, change.spec)
    changed, ended = experiments.change(rig.robot.name, experiment, caller.name, change.priority, change.spec)
    what = ["specification changed"] if change.spec is not None else []
    what += [f"approval of {ended} ended"] if ended else []
    what += [f"priority {change.priority}"] if change.priority is not None else []
    rig.record_event("experiment", ", ".join(what), actor=caller.name, experiment=experiment)
    rig.queue.wake()
    return rig.queue.with_progress(changed)


@router.put("/{experiment}/approval")
def approve_experiment(
    experiment: Identity, request: ApprovalRequest, rig: RobotDep, experiments: Experiments, caller: Operator
) -> Experiment:
    """Approves exactly this content of a waiting experiment, so that it may move a real arm.

    Nobody can approve an experiment that they submitted or changed. It begins as soon as the queue allows; a change
    ends the approval.
    """
    given = rig.approval(caller, request.content)
    approved = experiments.approve(rig.robot.name, experiment, rig.queue.review, given, rig.robot.clock.utc())
    rig.record_event("review", "approved", actor=caller.name, experiment=experiment)
    rig.queue.wake()
    return rig.queue.with_progress(approved)


@router.delete("/{experiment}/approval")
def withdraw_experiment_approval(
    experiment: Identity, rig: RobotDep, experiments: Experiments, caller: Operator
) -> Experiment:
    """Withdraws the approval of a waiting experiment. Every operator may do this."""
    found, ended = experiments.withdraw_approval(rig.robot.name, experiment)
    if ended is not None:
        line = f"approval of {ended} withdrawn"
        rig.record_event("review", line, actor=caller.name, experiment=experiment)
    return rig.queue.with_progress(found)


@router.post("/{experiment}/cancel")
def cancel_experiment(experiment: Identity, rig: RobotDep, experiments: Experiments, caller: Operator) -> Experiment:
    """Cancels an experiment: the caller's own or, for owners of the robot, anybody's.

    A running experiment is ended by a stop: the arm is frozen and needs a reset.
    """
    _require_own(experiments, rig, caller, experiment)
    return rig.queue.cancel(experiment, caller.name)


def _require_own(experiments: ExperimentStore, rig: RobotServices, caller: Caller, experiment: str) -> None:
    """Raises a 403 unless the caller may change this experiment, and a 404."""
    found = experiments.get(rig.robot.name, experiment)
    rig.require_own(caller, found.owner, f"experiment {found.spec.name or found.id}")


def _preview(motions: Workers, rig: RobotServices, spec: ExperimentSpec, most_shown: int) -> MotionPreview:
    """Plans a short motion here and a long one in a worker process. Raises SpecError, and a 422 for a motion that is
    too long to plan."""
    length = least_length(spec)
    if length > LONGEST:
        line = f"spec: takes {length / 3600:.1f} h, allowed are {LONGEST / 3600:g} h"
        raise ProblemError(422, "beyond-limits", line, "make a schedule of shorter experiments")
    order = WorkOutMotion(spec=spec, machine=rig.robot.machine, most_shown=most_shown)
    if length <= SHORT and spec.repeats == 1 and points_of(spec) <= FEW_POINTS:
        return preview_of(spec, rig.robot.machine, most_shown)
    try:
        answer = motions.ask(order)
    except ExhaustedError as error:
        raise ProblemError(422, "beyond-limits", f"spec: {error}", "make it shorter") from error
    if answer.problem:
        raise ProblemError(422, "beyond-limits" if answer.exhausted else "not-valid", answer.problem)
    return MotionPreview.model_validate(answer.data)


def require_possible(motions: Workers, rig: RobotServices, spec: ExperimentSpec) -> None:
    """Raises SpecError, and a 422 for a motion beyond the limits."""
    violations = _preview(motions, rig, spec, 1).violations
    if violations:
        more = f" (and {len(violations) - 1} more)" if len(violations) > 1 else ""
        line = f"spec.trajectory: {violations[0].message}{more}"
        raise ProblemError(422, "beyond-limits", line, "POST …/experiments/preview shows the motion and its violations")
