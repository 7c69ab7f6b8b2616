"""The base of all faults: a name, checked parameters, a span of board time, and the place of action."""

from __future__ import annotations

import dataclasses
import math
import random
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, NamedTuple

from mock_controller.board.board import Board

Direction = Literal["to_controller", "to_host"]


Count = Callable[[], None]
"""Counts one injection."""


class FaultError(ValueError):
    """A fault that does not exist, or an invalid parameter."""


def parameter(meaning: str, default: Any, low: float = -math.inf, high: float = math.inf) -> Any:
    """Returns a dataclass field for a number in [low, high], with its meaning (unit included)."""
    return field(default=default, metadata={"meaning": meaning, "low": low, "high": high})


def choice(meaning: str, default: str, allowed: Iterable[str]) -> Any:
    """Returns a dataclass field for one of several words."""
    return field(default=default, metadata={"meaning": meaning, "allowed": tuple(allowed)})


class Chunk(NamedTuple):
    """Bytes in transit, `delay_us` later than without faults.

    If `holds_line` is set, everything behind waits for them; else later bytes may overtake them.
    """

    data: bytes
    delay_us: int = 0
    holds_line: bool = False


@dataclass(frozen=True, kw_only=True)
class Fault:
    """Base of all faults. `start` and `duration` are seconds of board time after it is switched on."""

    name: ClassVar[str]
    start: float = parameter("s of board time until it begins", 0.0, 0.0, 1e6)
    duration: float = parameter("s of board time that it lasts", math.inf, 0.0)
    seed: int = parameter("of its own random numbers; by default made from the mock's seed", -1, -1, 2**63)

    @classmethod
    def summary(cls) -> str:
        """Returns the first line of its description."""
        return (cls.__doc__ or "").strip().splitlines()[0]


@dataclass(frozen=True, kw_only=True)
class WireFault(Fault):
    """A fault of the line: acts on a frame with probability `rate`, in one direction or both."""

    rate: float = parameter("probability per frame", 1.0, 0.0, 1.0)
    direction: str = choice("which frames", "both", ("both", "to_controller", "to_host"))

    def strike(self, data: bytes, dice: random.Random) -> list[Chunk]:
        """Returns the chunks into which one encoded frame, delimiters included, is changed; independent of time."""
        raise NotImplementedError


@dataclass(frozen=True)
class FaultyParts:
    """What faults other than those of the line act on. `disconnect` cuts the line for so many s of the host's clock."""

    board: Board
    disconnect: Callable[[float], None]


@dataclass(frozen=True, kw_only=True)
class PartFault(Fault):
    """A fault of board, arm or connection: begins, may act in every period, ends."""

    def begin(self, parts: FaultyParts, dice: random.Random, count: Count) -> None:
        """Begins the fault."""

    def each_period(self, parts: FaultyParts, dice: random.Random, count: Count) -> None:
        """Called once before every control period while it lasts."""

    def end(self, parts: FaultyParts) -> None:
        """Ends the fault."""


def fields_of(kind: type[Fault]) -> dict[str, dataclasses.Field[Any]]:
    """Returns the parameters of a fault class by name."""
    return {item.name: item for item in dataclasses.fields(kind)}
