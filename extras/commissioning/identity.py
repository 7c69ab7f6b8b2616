"""Whether the controller at a port is the one that was commissioned. Controllers have no serial number.

What is compared, all of it by reading: bytes of the memory that nothing changed while the memory map was found, neither
motion nor switching off and on; that error + position is the set point at the places that were found; the control
period, which hangs on the board's crystal; and the serial number of the adapter. Two controllers with the same program
at the same adapter differ in the crystal alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from firmware_protocol.memory_map import MemoryMap
from firmware_protocol.units import POSTURE_UNITS, posture_to_counts

FEWEST_CONSTANTS = 4
"""Least number of constant bytes that are evidence."""
OTHERS = 0.2
"""Share of constant bytes that may have changed on the same controller: a slow counter may not have moved while the map
was found. At another controller the greater part differs."""
ALLOWED_COUNTS = 12
"""Largest departure (ADC counts) of error + position from the set point: a joint may move between two bytes."""
CRYSTALS = 1e-3
"""Largest relative difference of the control period on one controller: two quartz crystals differ by a tenth of it."""


@dataclass(frozen=True)
class Identity:
    """What is known of a controller; what is not known is empty, 0 or None.

    constants: address → byte that nothing changed
    period_ms: control period by the host's clock, and the standard error of it
    adapter:   serial number of the USB adapter
    """

    constants: Mapping[int, int]
    period_ms: float = 0.0
    period_error_ms: float = 0.0
    adapter: str | None = None

    def as_data(self) -> dict[str, Any]:
        """Plain data for TOML."""
        data: dict[str, Any] = {"constants": {f"{at:04X}": value for at, value in sorted(self.constants.items())}}
        if self.period_ms:
            data |= {"period_ms": self.period_ms, "period_error_ms": self.period_error_ms}
        return data if self.adapter is None else data | {"adapter": self.adapter}

    @staticmethod
    def of_data(data: Mapping[str, Any]) -> Identity:
        """The identity in plain data. Raises ValueError, TypeError, AttributeError for other data."""
        constants = {int(at, 16): int(value) for at, value in data.get("constants", {}).items()}
        period, error = (float(data.get(name, 0.0)) for name in ("period_ms", "period_error_ms"))
        adapter = data.get("adapter")
        return Identity(constants, period, error, None if adapter is None else str(adapter))


def without_registers(constants: Mapping[int, int], memory_map: MemoryMap) -> dict[int, int]:
    """The constant bytes that belong to no register: a host may change those."""
    taken = {address for register in memory_map.registers.values() for address in register.addresses}
    return {at: value for at, value in constants.items() if at not in taken}


def same_bytes(kept: Identity, base: int, pages: Sequence[bytes]) -> tuple[Identity, str]:
    """The identity without bytes that have changed after all, and why these readings of the memory are of another
    controller; empty if they may be of the same."""
    changed = [at for at, value in kept.constants.items() if all(page[at - base] != value for page in pages)]
    count = len(kept.constants)
    if count >= FEWEST_CONSTANTS and len(changed) > max(1, OTHERS * count):
        return kept, f"{len(changed)} of {count} bytes that nothing changed are others"
    left = {at: value for at, value in kept.constants.items() if at not in changed}
    return replace(kept, constants=left), ""


def same_registers(set_points: Mapping[int, float], positions: Mapping[int, float], errors: Mapping[int, float]) -> str:
    """Why these values were not read where set points, positions and errors lie; empty if they agree."""
    wrong = []
    for joint, posture in set_points.items():
        valid = 0 <= posture < POSTURE_UNITS
        if not valid or abs(positions[joint] + errors[joint] - posture_to_counts(round(posture))) > ALLOWED_COUNTS:
            wrong.append(str(joint))
    if not wrong:
        return ""
    return f"error + position is not the set point at joint{'s' if len(wrong) > 1 else ''} {', '.join(wrong)}"


def same_period(kept: Identity, period_ms: float, error_ms: float) -> str:
    """Why this control period is another controller's; empty if it may be the same, or none is known."""
    if not kept.period_ms:
        return ""
    allowed = CRYSTALS * kept.period_ms + 4 * (kept.period_error_ms**2 + error_ms**2) ** 0.5
    if abs(period_ms - kept.period_ms) <= allowed:
        return ""
    return f"its control period is {period_ms:.4f} ms, and was {kept.period_ms:.4f} ms"


def same_adapter(kept: Identity, adapter: str | None) -> str:
    """Why this adapter is another one; empty if it is the same, or either is unknown."""
    if kept.adapter is None or adapter is None or adapter == kept.adapter:
        return ""
    return f"its adapter has the serial number {adapter}, and it was {kept.adapter}"
