"""Checks whether the controller at the port is the one that was commissioned. Controllers have no serial number.

It compares, only by reading:

- bytes of the memory that neither motion nor power cycles changed while the memory map was found;
- error + position, which must be the set point at the addresses that were found;
- the control period, which depends on the board's crystal;
- the serial number of the adapter.

Two controllers with the same program at the same adapter differ only in the crystal.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from daq.contracts.errors import SafetyError, SpecError
from daq_cli.app.context import console
from extras.commissioning.command.bench import CONFIG, FINDINGS, MACHINE, MAP, Bench, connected
from extras.commissioning.command.periods import followed_periods
from extras.commissioning.command.record import FILE, Record
from firmware_protocol.memory_map import MemoryMap
from firmware_protocol.units import POSTURE_UNITS, posture_to_counts

FEWEST_CONSTANTS = 4
"""Least number of constant bytes that is evidence."""
OTHERS = 0.2
"""Share of constant bytes that may have changed on the same controller: a slow counter may have stood still while the
map was found. On another controller most differ."""
ALLOWED_COUNTS = 12
"""Largest difference (ADC counts) between error + position and the set point: a joint may move between two bytes."""
CRYSTALS = 1e-3
"""Largest relative difference of the control period on one controller: two quartz crystals differ by a tenth of it."""


@dataclass(frozen=True)
class Identity:
    """Known properties of a controller; unknown ones are empty, 0 or None.

    constants: address → byte that nothing changed
    period_ms: control period by the host's clock, and its standard error
    adapter:   serial number of the USB adapter
    """

    constants: Mapping[int, int]
    period_ms: float = 0.0
    period_error_ms: float = 0.0
    adapter: str | None = None

    def as_data(self) -> dict[str, Any]:
        """Returns plain data for TOML."""
        data: dict[str, Any] = {"constants": {f"{at:04X}": value for at, value in sorted(self.constants.items())}}
        if self.period_ms:
            data |= {"period_ms": self.period_ms, "period_error_ms": self.period_error_ms}
        return data if self.adapter is None else data | {"adapter": self.adapter}

    @staticmethod
    def of_data(data: Mapping[str, Any]) -> Identity:
        """Returns the identity from plain data. Raises ValueError, TypeError, AttributeError for other data."""
        constants = {int(at, 16): int(value) for at, value in data.get("constants", {}).items()}
        period, error = (float(data.get(name, 0.0)) for name in ("period_ms", "period_error_ms"))
        adapter = data.get("adapter")
        return Identity(constants, period, error, None if adapter is None else str(adapter))


def without_registers(constants: Mapping[int, int], memory_map: MemoryMap) -> dict[int, int]:
    """Returns the constant bytes that belong to no register: a host may change registers."""
    taken = {address for register in memory_map.registers.values() for address in register.addresses}
    return {at: value for at, value in constants.items() if at not in taken}


def same_bytes(kept: Identity, base: int, pages: Sequence[bytes]) -> tuple[Identity, str]:
    """Compares bytes of the memory with those that were constant.

    Returns the identity without bytes that have changed after all, and why the readings are of another controller;
    empty if they may be of the same.
    """
    changed = [at for at, value in kept.constants.items() if all(page[at - base] != value for page in pages)]
    count = len(kept.constants)
    if count >= FEWEST_CONSTANTS and len(changed) > max(1, OTHERS * count):
        return kept, f"{len(changed)} of {count} bytes that nothing changed are different"
    left = {at: value for at, value in kept.constants.items() if at not in changed}
    return replace(kept, constants=left), ""


def same_registers(set_points: Mapping[int, float], positions: Mapping[int, float], errors: Mapping[int, float]) -> str:
    """Returns why these values are not set points, positions and errors; empty if they agree."""
    wrong = []
    for joint, posture in set_points.items():
        valid = 0 <= posture < POSTURE_UNITS
        if not valid or abs(positions[joint] + errors[joint] - posture_to_counts(round(posture))) > ALLOWED_COUNTS:
            wrong.append(str(joint))
    if not wrong:
        return ""
    return f"error + position is not the set point at joint{'s' if len(wrong) > 1 else ''} {', '.join(wrong)}"


def same_period(kept: Identity, period_ms: float, error_ms: float) -> str:
    """Returns why this control period is another controller's; empty if it may be the same, or none is known."""
    if not kept.period_ms:
        return ""
    allowed = CRYSTALS * kept.period_ms + 4 * (kept.period_error_ms**2 + error_ms**2) ** 0.5
    if abs(period_ms - kept.period_ms) <= allowed:
        return ""
    return f"its control period is {period_ms:.4f} ms, but was {kept.period_ms:.4f} ms"


def same_adapter(kept: Identity, adapter: str | None) -> str:
    """Returns why this adapter is another one; empty if it is the same, or either is unknown."""
    if kept.adapter is None or adapter is None or adapter == kept.adapter:
        return ""
    return f"its adapter has the serial number {adapter}, but it was {kept.adapter}"


Said = Literal["new", "same"]
READINGS = 5
OF_THE_ARM = (FILE, MAP, FINDINGS, MACHINE, CONFIG, "acceptance.html", "diagnosis.html", "next_experiment.json")
"""Files of a folder that belong to one arm; traces contain their machine."""


def identity_of(record: Record) -> Identity:
    """Returns the identity of a folder's arm. Raises SpecError for a damaged record."""
    try:
        return Identity.of_data(record.identity)
    except (ValueError, TypeError, AttributeError) as error:
        raise SpecError(
            f"{record.folder / FILE}: identity is damaged ({error}): give --arm new or repair it"
        ) from error


def note_memory(bench: Bench) -> None:
    """Keeps the bytes that nothing has changed while the memory map was found."""
    data = json.loads((bench.folder / FINDINGS).read_text("utf-8"))
    constants = {int(at, 16): int(value) for at, value in data.get("unchanged", {}).items()}
    own = without_registers(constants, bench.memory_map())
    bench.record.identify(replace(identity_of(bench.record), constants=own).as_data())


def note_adapter(bench: Bench, serial_number: str | None) -> None:
    """Keeps the serial number of the adapter at the port."""
    if serial_number is not None:
        bench.record.identify(replace(identity_of(bench.record), adapter=serial_number).as_data())


def note_period(bench: Bench, period_ms: float, error_ms: float) -> None:
    """Keeps the measured control period."""
    known = replace(identity_of(bench.record), period_ms=period_ms, period_error_ms=error_ms)
    bench.record.identify(known.as_data())


def require_same_arm(bench: Bench, said: Said | None) -> None:
    """Compares the arm at the port with the folder's; only reads.

    said: the operator's answer if the arm differs: it is the `same` one with an exchanged part, or `new` Raises
    SafetyError, and the errors of connecting.
    """
    if not bench.record.identity:
        return
    kept = identity_of(bench.record)
    left, why, misplaced = _compared(bench, kept)
    if why and (said != "same" or misplaced):
        exchanged = "" if misplaced else ", or --arm same if a part of it was exchanged"
        raise SafetyError(
            f"{bench.call.port}: this is not the arm of {bench.folder}: {why}; for a new arm give --arm new, which "
            f"starts over{exchanged}"
        )
    if why:
        console().print(f"Assumed to be the same arm, as you stated: {why}")
        left = Identity({})
    if left != kept:
        bench.record.identify(left.as_data())


def begin_anew(folder: Path) -> Record:
    """Returns an empty record; moves the files of the previous arm into a folder beside it.

    An emergency stop that was not released safely stays noted.
    """
    pressed = Record.of(folder).stop_pressed
    found = [folder / name for name in OF_THE_ARM if (folder / name).exists()]
    if found:
        old = folder / f"before-{datetime.now(UTC):%Y%m%d-%H%M%S}"
        try:
            old.mkdir()
            for path in found:
                path.rename(old / path.name)
        except OSError as error:
            raise SpecError(f"{old}: the files of the previous arm cannot be moved: {error.strerror}") from error
        console().print(f"The results of the previous arm are in {old}")
    record = Record.of(folder)
    if pressed:
        record.note_stop(True)
    return record


def _compared(bench: Bench, kept: Identity) -> tuple[Identity, str, bool]:
    """Returns the identity that remains; why the arm is another one, empty if it may be the same; and whether its
    registers are elsewhere, so that no earlier result is valid."""
    from extras.commissioning.memory.procedure import is_alive
    from extras.commissioning.person.memory_page import open_page
    from extras.commissioning.person.safe_release import typical

    memory_map = bench.memory_map()
    with open_page(bench.call.port, memory_map) as page:
        pages = [page.read().data for _ in range(READINGS)]
        if not any(map(is_alive, pages)):
            return kept, "", False  # without supply nothing can be compared; every step that needs it reports that
        if (bench.folder / MAP).exists():
            registers = (typical(page, memory_map, name, READINGS) for name in ("set_point", "position", "error"))
            if why := same_registers(*registers):
                return kept, why, True
    left, why = same_bytes(kept, memory_map.base, pages)
    why = why or same_adapter(kept, bench.adapter())
    if not why and kept.period_ms and "bridge" in bench.record.done:
        with connected(bench) as controller:
            found = followed_periods(controller)
        why = "" if found.problem else same_period(kept, found.period_ms, found.error_ms)
    return left, why, False
