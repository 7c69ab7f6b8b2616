"""Faults of the connection as a whole."""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import ClassVar

from mock_controller.faults.fault import Count, Fault, FaultyParts, PartFault, parameter


@dataclass(frozen=True, kw_only=True)
class Stall(Fault):
    """Silences the bridge: input and output wait until the stall ends."""

    name: ClassVar[str] = "stall"
    duration: float = parameter("s of board time that it lasts", 0.2, 0.0, 1e6)


@dataclass(frozen=True, kw_only=True)
class Disconnect(PartFault):
    """Cuts the line; it comes back."""

    name: ClassVar[str] = "disconnect"
    seconds: float = parameter("s of the host's clock until it is restored", 0.5, 0.0, 1e6)
    duration: float = parameter("ignored: `seconds` sets the end", 0.0, 0.0)

    def begin(self, parts: FaultyParts, dice: random.Random, count: Count) -> None:  # noqa: ARG002
        count()
        parts.disconnect(self.seconds)
