"""The arm as teaching uses it: an interface that the motor controller and a test's substitute implement."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from typing import Protocol

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq.contracts.experiment import Gain
from daq.contracts.sample import SampleRow
from daq.runner.arm_control import StoppedError


class TeachingError(DaqError):
    """Teaching ended early, or its result cannot be used."""

    exit_code = exit_codes.FAULT


class TeachableArm(Protocol):
    """An arm, one control period at a time. Every method may raise StoppedError (the arm was stopped) and
    TeachingError (a fault, a lost link): it is frozen then."""

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints (from 1) in every sample, in its order."""
        ...

    @property
    def every(self) -> int:
        """Control periods from one sample to the next: more than one where the line to the arm is slow."""
        ...

    @property
    def lateness(self) -> float:
        """Time (s) by which the last sample came later than the quickest ones."""
        ...

    def driven(self) -> AbstractContextManager[None]:
        """Set points are taken only within this context. Leaving it ends the work, unless the arm has been stopped; an
        exception freezes the arm before anything else is done."""
        ...

    def next_sample(self) -> SampleRow:
        """Waits for the next control period and returns it; every period comes once, or every n-th (`every`)."""
        ...

    def set_points(self, postures: Mapping[int, int]) -> None:
        """Sends set points: joint → posture units 0–999."""
        ...

    def gains(self) -> Mapping[int, Gain]:
        """Joint → (P, I, D)."""
        ...

    def set_gains(self, joint: int, p: int, i: int, d: int) -> None:
        """Writes the gains of a joint."""
        ...

    def freeze_for_stop(self, cause: str) -> StoppedError:
        """Freezes the arm on request; returns the error to raise, which states the result."""
        ...

    def freeze_for_fault(self, cause: str) -> TeachingError:
        """Freezes the arm because of a fault; returns the error to raise, which states the result."""
        ...
