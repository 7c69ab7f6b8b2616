"""Something in the gripper that nobody told the model about."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from mock_controller.modifications.registry import parameter
from mock_controller.plant.parameters import PlantParameters


@dataclass
class Payload:
    """Adds `mass` (kg) to MLOAD, its centre `offset` (m) beyond the wrist along the hand."""

    name: ClassVar[str] = "payload"
    mass: float = parameter(-1.0, 5.0)
    offset: float = parameter(-0.5, 0.5, default=0.0)

    def change_plant(self, parameters: PlantParameters) -> PlantParameters:
        body = parameters.rigid_body
        m_load = body.m_load + self.mass
        moment = body.m_load * body.load_offset + self.mass * self.offset
        changed = replace(body, m_load=m_load, load_offset=moment / m_load)
        return replace(parameters, rigid_body=changed)
