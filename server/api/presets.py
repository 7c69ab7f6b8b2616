"""What an experiment can be: those that have a name, and the rules of a specification."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.service.experiments import ExperimentPreset
from daq.trajectories.presets import PRESETS
from server.api.dependencies import RobotDep, Viewer
from server.problems import PROBLEMS

router = APIRouter(prefix="/robots/{robot}", tags=["experiments"], responses=PROBLEMS)


@router.get("/presets")
def list_presets(rig: RobotDep, _: Viewer) -> tuple[ExperimentPreset, ...]:
    """Experiments that have a name, for the joints that this robot has: to be run as they are, or to begin from."""
    count = len(rig.robot.machine.joints)
    return tuple(
        ExperimentPreset(name=name, description=preset.description, spec=preset.spec)
        for name, preset in PRESETS.items()
        if max(preset.spec.joints) <= count
    )


@router.get("/spec-schema")
def get_spec_schema(_: RobotDep, __: Viewer) -> dict[str, Any]:
    """JSON Schema of `ExperimentSpec`: fields, defaults and bounds, for forms and editors."""
    return ExperimentSpec.model_json_schema()
