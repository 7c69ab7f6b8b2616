"""The modifications that exist."""

from __future__ import annotations

from typing import Any

from mock_controller.modifications.dead_zone import AmplifierDeadZone
from mock_controller.modifications.payload import Payload
from mock_controller.modifications.soft_gear import SoftGear

LIBRARY: tuple[type[Any], ...] = (Payload, SoftGear, AmplifierDeadZone)
