"""The modifications that exist, collected from the files of this folder."""

from __future__ import annotations

from typing import Any

from mock_controller.modifications import amplifier, controller, friction, gear, load, motor, sensor, strange_friction

SHARED: tuple[type[Any], ...] = (
    *friction.SHARED,
    *motor.SHARED,
    *amplifier.SHARED,
    *gear.SHARED,
    *load.SHARED,
    *sensor.SHARED,
    *controller.SHARED,
)
"""Effects whose names the diagnosis also knows."""

OPEN_SET: tuple[type[Any], ...] = (
    *strange_friction.OPEN_SET,
    *gear.OPEN_SET,
    *amplifier.OPEN_SET,
    *sensor.OPEN_SET,
)
"""Effects that only the mock knows; to the diagnosis they are unknown."""

LIBRARY: tuple[type[Any], ...] = SHARED + OPEN_SET
