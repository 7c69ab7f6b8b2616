"""Makes changed copies of the arm's constants."""

from __future__ import annotations

from dataclasses import replace

from mock_controller.plant.parameters import PlantParameters


def change_joint(parameters: PlantParameters, number: int, **values: float) -> PlantParameters:
    """Returns the arm with other constants at one joint (from 1)."""
    joints = list(parameters.joints)
    joints[number - 1] = replace(joints[number - 1], **values)
    return replace(parameters, joints=tuple(joints))


def change_body(parameters: PlantParameters, **values: float) -> PlantParameters:
    """Returns the arm with other rigid-body constants."""
    return replace(parameters, rigid_body=replace(parameters.rigid_body, **values))  # type: ignore[arg-type]
