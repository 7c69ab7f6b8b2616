"""An arm on which one thing at a time is looked at."""

import math
from dataclasses import replace
from typing import Any

import mujoco

from mock_controller.modification import Modification
from mock_controller.modifications import build_modifications
from mock_controller.modifications.parameter import change_joint
from mock_controller.plant import Plant, PlantParameters, default_plant
from mock_controller.plant.rigid_body import build_model

UPRIGHT = (math.pi, math.pi / 2, 0.0, 0.0, 0.0, 0.0)
STRETCHED = (math.pi, 0.0, 0.0, 0.0, 0.0, 0.0)
STEP_S = 1e-3


def effect(name: str, **values: Any) -> Any:
    """One effect, told what it wants to know of the arm."""
    (built,) = build_modifications([(name, values)])
    if hasattr(built, "know_plant"):
        built.know_plant(default_plant(), STEP_S)
    return built


def changed(name: str, **values: Any) -> PlantParameters:
    """The arm's constants with one effect."""
    parameters: PlantParameters = effect(name, **values).change_plant(default_plant())
    return parameters


def without_friction() -> PlantParameters:
    """The arm with neither Coulomb friction nor weight."""
    parameters = default_plant()
    body = replace(parameters.rigid_body, gravity=(0.0, 0.0, 0.0))
    for joint in range(1, 7):
        parameters = change_joint(parameters, joint, constant_friction=0.0)
    return replace(parameters, rigid_body=body)


def plant_with(*modifications: Modification, parameters: PlantParameters | None = None, **more: Any) -> Plant:
    """An arm with effects, standing upright if nothing else is said."""
    return Plant(parameters or default_plant(), modifications, **{"angles": UPRIGHT, **more})


def steady_rate(plant: Plant, joint: int, volts_in: float) -> float:
    """Rate (rad/s) of a joint after 0.3 s at constant volts at its amplifier's input."""
    plant.advance([volts_in if index == joint - 1 else 0.0 for index in range(6)], 300_000)
    return plant.joint_rates[joint - 1]


def weights(parameters: PlantParameters, angles: tuple[float, ...] = STRETCHED) -> list[float]:
    """Torques (N·m) of gravity that the joints have to hold."""
    model = build_model(parameters, STEP_S)
    data = mujoco.MjData(model)
    data.qpos[:] = angles
    mujoco.mj_forward(model, data)
    return [float(value) for value in data.qfrc_bias]
