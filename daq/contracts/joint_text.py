"""Formats positions and speeds of joints for people: degrees for revolute joints, millimetres for prismatic ones."""

from __future__ import annotations

import math

from daq.contracts.machine import Machine

MM = 1e3
"""Millimetres in a metre."""


def slides(machine: Machine, joint: int) -> bool:
    """Whether `joint` (from 1) is prismatic: its positions are in m."""
    return machine.joint(joint).kind == "prismatic"


def position_text(machine: Machine, joint: int, value: float, digits: int = 2) -> str:
    """Formats a position or position difference (rad; m on a prismatic joint), such as `21.60°` or `30.00 mm`."""
    return f"{value * MM:.{digits}f} mm" if slides(machine, joint) else f"{math.degrees(value):.{digits}f}°"


def speed_text(machine: Machine, joint: int, value: float) -> str:
    """Formats a speed (rad/s; m/s on a prismatic joint), such as `33.2 °/s` or `50.0 mm/s`."""
    return f"{value * MM:.1f} mm/s" if slides(machine, joint) else f"{math.degrees(value):.1f} °/s"


def speed_unit(machine: Machine, joint: int) -> str:
    """Unit of a joint's speed in files and in the service: `rad/s`, or `m/s` on a prismatic joint."""
    return "m/s" if slides(machine, joint) else "rad/s"
