"""Requests and orders to the owner of this computer's port."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from daq.contracts.experiment import Gain
from daq.contracts.service.robot import Done, JointGains, ProcessState
from daq.owner.client import OwnerOnDemand
from daq.owner.messages import MoveGripper, ReadGains, ReadProcess, Reset, WriteGains, WriteOutput


@dataclass(frozen=True)
class OwnRobot:
    """`Orders` and `Changes` through such an owner. Raises OrderFailedError for refused orders."""

    owner: OwnerOnDemand

    def gains(self) -> JointGains:
        """Reads the board."""
        return JointGains.model_validate(self.owner.ask(ReadGains))

    def set_gains(self, gains: Mapping[int, Gain]) -> JointGains:
        """Writes and reads back."""
        return JointGains.model_validate(self.owner.ask(WriteGains, gains=dict(gains)))

    def process(self) -> ProcessState:
        """Reads the board."""
        return ProcessState.model_validate(self.owner.ask(ReadProcess))

    def set_output(self, output: int, *, on: bool, while_stopped: bool = False) -> ProcessState:
        """Switches and reads back."""
        found = self.owner.ask(WriteOutput, output=output, on=on, while_stopped=while_stopped)
        return ProcessState.model_validate(found)

    def set_gripper(self, *, closed: bool, while_stopped: bool = False) -> ProcessState:
        """Switches and reads back."""
        return ProcessState.model_validate(self.owner.ask(MoveGripper, closed=closed, while_stopped=while_stopped))

    def reset(self, *, here: bool = False) -> Done:
        """Ends the stop that is now in force on the board."""
        return Done.model_validate(self.owner.ask(Reset, stop=None, here=here))
