"""All modifications, collected from the files of this folder."""

from __future__ import annotations

from typing import Any

from mock_controller.modifications import (
    amplifier,
    controller,
    friction,
    load,
    motor,
    sensor,
    strange_friction,
    transmission,
)

SHARED: tuple[type[Any], ...] = (
    *friction.SHARED,
    *motor.SHARED,
    *amplifier.SHARED,
    *transmission.SHARED,
    *load.SHARED,
    *sensor.SHARED,
    *controller.SHARED,
)
"""Effects whose names the diagnosis also uses."""

OPEN_SET: tuple[type[Any], ...] = (
    *strange_friction.OPEN_SET,
    *transmission.OPEN_SET,
    *amplifier.OPEN_SET,
    *sensor.OPEN_SET,
)
"""Effects that only the mock has; to the diagnosis they are unknown."""

LIBRARY: tuple[type[Any], ...] = SHARED + OPEN_SET
