"""What teaching needs of an arm: the driver has it, and so has whatever stands in for it in a test."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from daq.contracts.errors import DaqError
from daq.contracts.experiment import Gain
from daq.contracts.sample import SampleRow


class TeachingError(DaqError):
    """Teaching had to end, or what was taught cannot be used."""


class TeachableArm(Protocol):
    """An arm, one control period at a time. Every method may raise a DaqError of the link."""

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints (from 1) in every sample, in its order."""
        ...

    def next_sample(self) -> SampleRow:
        """Waits for the next control period and returns it; every period comes once."""
        ...

    def set_points(self, postures: Mapping[int, int]) -> object:
        """Sends set points: joint → posture units 0–999."""
        ...

    def stop(self) -> object:
        """Freezes the set points at the measured posture."""
        ...

    def gains(self) -> Mapping[int, Gain]:
        """Joint → (P, I, D)."""
        ...

    def set_gains(self, joint: int, p: int, i: int, d: int) -> object:
        """Writes the gains of a joint."""
        ...
