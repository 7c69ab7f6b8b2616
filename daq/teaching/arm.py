"""The interface of an arm for teaching, implemented by the motor controller and by a test double."""

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
    """An arm, one control period at a time. Every method may raise StoppedError (the arm was stopped) and TeachingError
    (a fault, a lost link), after which the arm is frozen."""

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints (from 1) in every sample, in order."""
        ...

    @property
    def every(self) -> int:
        """Control periods from one sample to the next: more than one on a slow line."""
        ...

    @property
    def lateness(self) -> float:
        """Delay (s) of the last sample compared with the quickest ones."""
        ...

    def driven(self) -> AbstractContextManager[None]:
        """Set points are accepted only within this context. Leaving it ends the work, unless the arm was stopped. An
        exception first freezes the arm."""
        ...

    def next_sample(self) -> SampleRow:
        """Waits for the next sample and returns it. Every period, or every n-th (`every`), is returned once."""
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
        """Freezes the arm on request. Returns the error to raise, which states the result."""
        ...

    def freeze_for_fault(self, cause: str) -> TeachingError:
        """Freezes the arm because of a fault. Returns the error to raise, which states the result."""
        ...
