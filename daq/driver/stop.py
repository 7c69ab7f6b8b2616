"""What is known after a stop."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class StopConfirmation:
    """`sent`: the stop has been written to the line. `acknowledged`: the controller has confirmed the freeze, since
    `tick`, at the postures `frozen` (joint → posture units); `seconds` from sending the stop to that, where they were
    measured. Otherwise `problem` says in one line what failed, and the hardware's own stop is to be used."""

    sent: bool
    acknowledged: bool
    tick: int | None = None
    frozen: dict[int, int] = field(default_factory=dict)
    problem: str | None = None
    seconds: float | None = None
