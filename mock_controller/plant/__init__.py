"""The physical arm of the mock: rigid bodies, motors, gears, friction and amplifiers."""

from mock_controller.plant.parameters import PlantParameters, default_plant, parse_plant
from mock_controller.plant.plant import STEP_US, Plant, PlantError

__all__ = ["STEP_US", "Plant", "PlantError", "PlantParameters", "default_plant", "parse_plant"]
