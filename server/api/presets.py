"""Routes of the named experiments, and of the schema of a specification."""

from __future__ import annotations

from typing import Any

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.service.experiments import ExperimentPreset, Submission
from server.api.dependencies import RobotDep, Viewer
from server.problems import PROBLEMS, ProblemError
from server.routes import Router


def with_preset(request: Submission) -> Submission:
    """Returns a request with the specification of the preset that it names, if it names one. Raises a 422."""
    if request.preset is None:
        return request
    from daq.trajectories.presets import PRESETS  # builds all of them

    if request.preset not in PRESETS:
        detail = f"preset: is none of {', '.join(PRESETS)} (got {request.preset!r:.80})"
        raise ProblemError(422, "not-valid", detail, "name one of them, or give a `spec`")
    return request.model_copy(update={"spec": PRESETS[request.preset].spec, "preset": None})


router = Router(prefix="/robots/{robot}", tags=["experiments"], responses=PROBLEMS)


@router.get("/presets")
def list_presets(rig: RobotDep, _: Viewer) -> tuple[ExperimentPreset, ...]:
    """Lists the named experiments for the joints of this robot: to run unchanged, or as a start."""
    from daq.trajectories.presets import PRESETS

    count = len(rig.robot.machine.joints)
    return tuple(
        ExperimentPreset(name=name, description=preset.description, spec=preset.spec)
        for name, preset in PRESETS.items()
        if max(preset.spec.joints) <= count
    )


@router.get("/spec-schema")
def get_spec_schema(_: RobotDep, __: Viewer) -> dict[str, Any]:
    """Returns the JSON Schema of `ExperimentSpec`, for forms and editors."""
    return ExperimentSpec.model_json_schema()
