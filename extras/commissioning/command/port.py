"""The port, found by unplugging the cable and plugging it in again."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from daq.contracts.errors import ReachError
from daq.transport.discovery import FoundPort, appeared, ports
from extras.commissioning.memory.procedure import Operator, Task

POLL_S, PATIENCE_S = 0.25, 15.0
"""Time (s) between two looks at the list of ports, and for which a port may take to appear."""


def port_by_plugging(
    operator: Operator,
    listed: Callable[[], Sequence[FoundPort]] = ports,
    wait: Callable[[float], None] = time.sleep,
) -> FoundPort:
    """The port that appears when the cable is plugged in. Opens none. Raises ReachError, TransportError."""
    before = {one.url for one in listed()}
    if not operator.begin(Task("unplug")):
        raise ReachError("the cable was not unplugged, so the port is not known: give --port (`daq ports` lists them)")
    without = listed()
    if before and before <= {one.url for one in without}:  # once more only: it may have been unplugged beforehand
        operator.begin(Task("unplug", again=f"no port went away, there are {', '.join(sorted(before))}"))
        without = listed()
    if not operator.begin(Task("plug_in")):
        raise ReachError("the cable was not plugged in, so the port is not known: give --port (`daq ports` lists them)")
    operator.show(f"Looking for it, {PATIENCE_S:.0f} s at most.")
    for _ in range(round(PATIENCE_S / POLL_S)):
        if (found := appeared(without, listed())) is not None:
            shown = ", ".join(text for text in (found.description, found.maker, found.serial_number) if text)
            operator.show(f"{found.url}  {shown}")
            return found
        wait(POLL_S)
    others = ", ".join(one.url for one in without) or "none"
    raise ReachError(
        f"no port appeared within {PATIENCE_S:.0f} s of plugging in (others: {others}): "
        "is the cable one for data, and the bridge alive?"
    )
