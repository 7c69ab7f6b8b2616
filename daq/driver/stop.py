"""Result of a stop."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class StopConfirmation:
    """Result of a stop.

    `sent`: the stop was written to the line. `acknowledged`: the controller confirmed the freeze, since `tick`, at the
    postures `frozen` (joint → posture units). `seconds`: time from sending to confirmation, if measured. Without
    confirmation, `problem` states in one line what failed, and the emergency stop must be used.
    """

    sent: bool
    acknowledged: bool
    tick: int | None = None
    frozen: dict[int, int] = field(default_factory=dict)
    problem: str | None = None
    seconds: float | None = None
