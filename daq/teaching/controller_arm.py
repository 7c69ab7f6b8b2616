"""The motor controller as an arm that can be taught: all joints, one control period at a time, in SI units."""

from __future__ import annotations

from collections.abc import Mapping

from daq.contracts.experiment import Gain
from daq.contracts.machine import Machine
from daq.contracts.sample import SampleRow
from daq.driver import Controller
from daq.runner.rows import RowMaker


class ControllerArm:
    """A `TeachableArm` over the driver. Raises what the driver raises."""

    def __init__(self, controller: Controller, machine: Machine) -> None:
        self.joints = tuple(range(1, len(machine.joints) + 1))
        self._controller = controller
        self._rows = RowMaker(machine, self.joints, controller.period_s)
        self._last: int | None = None

    def next_sample(self) -> SampleRow:
        """The next control period; none is left out."""
        snapshot = self._controller.next_snapshot(self._last, self.joints)
        self._last = snapshot.tick
        return self._rows.row(snapshot)

    def set_points(self, postures: Mapping[int, int]) -> None:
        """Joint → posture units 0–999, taken together."""
        self._controller.set_points(postures)

    def stop(self) -> None:
        """Freezes the set points at the measured posture."""
        self._controller.stop()

    def gains(self) -> Mapping[int, Gain]:
        """Joint → (P, I, D)."""
        return self._controller.gains()

    def set_gains(self, joint: int, p: int, i: int, d: int) -> None:
        """Writes the gains of a joint and reads them back."""
        self._controller.set_gains(joint, p, i, d)
