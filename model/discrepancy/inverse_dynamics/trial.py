"""An effect that may explain residual torques: its parameters, and the values from which they are searched."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

Start = dict[str, float]


@dataclass(frozen=True)
class Trial:
    """An effect on joints, with its own parameters and the starting values from which it is tried.

    amplitudes: its parameters (full names) that measure its size; the others only shape it.
    stated: those of its parameters that the file states, as it states them: the trial lifts their priors. Its starts
        are then measured from where the tolerances' fit has them, `origin`, and not from nothing.
    """

    effect: str
    joints: tuple[int, ...]
    model: Model
    parameters: tuple[Parameter, ...]
    amplitudes: tuple[str, ...]
    starts: tuple[Start, ...]
    stated: tuple[Parameter, ...] = ()
    origin: Mapping[str, float] = field(default_factory=dict)

    @property
    def size(self) -> int:
        """Parameters that the effect adds."""
        return len(self.parameters)
