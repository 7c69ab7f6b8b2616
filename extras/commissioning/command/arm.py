"""Whether the arm at the port is the one that the folder belongs to."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

from daq.contracts.errors import SafetyError, SpecError
from daq_cli.app.context import console
from extras.commissioning.command.bench import CONFIG, FINDINGS, MACHINE, MAP, Bench, connected
from extras.commissioning.command.periods import followed_periods
from extras.commissioning.command.record import FILE, Record
from extras.commissioning.identity import (
    Identity,
    same_adapter,
    same_bytes,
    same_period,
    same_registers,
    without_registers,
)

Said = Literal["new", "same"]
READINGS = 5
OF_THE_ARM = (FILE, MAP, FINDINGS, MACHINE, CONFIG, "acceptance.html", "diagnosis.html", "next_experiment.json")
"""Files of a folder that belong to one arm; its traces say themselves of which machine they are."""


class OtherArmError(SafetyError):
    """The arm at the port is not the one of the folder."""


def identity_of(record: Record) -> Identity:
    """What is known of the arm of a folder. Raises SpecError for a damaged record."""
    try:
        return Identity.of_data(record.identity)
    except (ValueError, TypeError, AttributeError) as error:
        raise SpecError(f"{record.folder / FILE}: identity is damaged ({error}): give --arm new or mend it") from error


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
    """Compares the arm at the port with what is known of that of the folder; only reads.

    said: what the operator says of an arm that differs: that it is `same` one, of which a part was exchanged
    Raises OtherArmError, and what connecting raises.
    """
    if not bench.record.identity:
        return
    kept = identity_of(bench.record)
    left, why, misplaced = _compared(bench, kept)
    if why and (said != "same" or misplaced):
        exchanged = "" if misplaced else ", or --arm same if a part of it was exchanged"
        raise OtherArmError(
            f"{bench.call.port}: this is not the arm of {bench.folder}: {why}; for a new arm give --arm new, which "
            f"begins anew{exchanged}"
        )
    if why:
        console().print(f"Taken for the same arm, as you say: {why}")
        left = Identity({})
    if left != kept:
        bench.record.identify(left.as_data())


def begin_anew(folder: Path) -> Record:
    """An empty record; what belongs to the arm before is moved into a folder beside it. An emergency stop that was not
    released safely stays noted."""
    pressed = Record.of(folder).stop_pressed
    found = [folder / name for name in OF_THE_ARM if (folder / name).exists()]
    if found:
        old = folder / f"before-{datetime.now(UTC):%Y%m%d-%H%M%S}"
        try:
            old.mkdir()
            for path in found:
                path.rename(old / path.name)
        except OSError as error:
            raise SpecError(f"{old}: the files of the arm before cannot be moved: {error.strerror}") from error
        console().print(f"The results of the arm before are in {old}")
    record = Record.of(folder)
    if pressed:
        record.note_stop(True)
    return record


def _compared(bench: Bench, kept: Identity) -> tuple[Identity, str, bool]:
    """What remains known; why the arm is another one, empty if it may be the same; and whether that is because its
    registers lie elsewhere, so that nothing that was found may be relied on."""
    from extras.commissioning.memory.procedure import is_alive
    from extras.commissioning.person.memory_page import open_page
    from extras.commissioning.person.safe_release import typical

    memory_map = bench.memory_map()
    with open_page(bench.call.port, memory_map) as page:
        pages = [page.read().data for _ in range(READINGS)]
        if not any(map(is_alive, pages)):
            return kept, "", False  # without supply nothing can be compared; every step that needs it says so
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
