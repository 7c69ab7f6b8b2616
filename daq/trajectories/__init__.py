"""Turns a specified motion into set points for every control period. Pure: nothing here moves an arm."""

from daq.trajectories.move import MOVE_SPEED, plan_move
from daq.trajectories.planner import plan, start_angles
from daq.trajectories.presets import PRESETS, Preset, preset
from daq.trajectories.set_points import Mark, Plan, PlanPreview, control_period, make_plan, representable_angles

__all__ = [
    "MOVE_SPEED",
    "PRESETS",
    "Mark",
    "Plan",
    "PlanPreview",
    "Preset",
    "control_period",
    "make_plan",
    "plan",
    "plan_move",
    "preset",
    "representable_angles",
    "start_angles",
]
