"""`daq robot check`: checks the line protocol's guarantees, as far as reading can show them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import typer

from daq.contracts import exit_codes
from daq.contracts.errors import SpecError
from daq_cli.app.context import JsonOption, invocation, print_json

if TYPE_CHECKING:
    from daq.driver import Controller

PERIODS = 25
"""Number of control periods that are read."""
AT_REST_COUNTS = 12
"""Largest difference (ADC counts) between two readings of an arm at rest: noise and slow creep."""

app = typer.Typer(add_completion=False, help="Check what a controller promises.", no_args_is_help=True)


@app.callback()
def robot() -> None:
    """Check what a controller promises."""


@dataclass(frozen=True)
class Checked:
    """One guarantee, whether it holds, and what was observed."""

    promise: str
    kept: bool
    seen: str


@app.command()
def check(context: typer.Context, json: JsonOption = False) -> None:
    """Check identity, order and wholeness of samples, refusals, reports and the memory of a controller. Only reads;
    nothing moves. Exit code 5 if a promise is broken."""
    from daq.config.robot_files import load_memory_map
    from daq.driver import Controller

    call = invocation(context)
    with Controller.connect(call.port, load_memory_map(call.settings.robot.memory_map)) as controller:
        if controller.link.scale.turn_bytes is not None:
            raise SpecError("robot check: checks the promises of PROTOCOL.md, and this port speaks another dialect")
        found = [one for part in CHECKS for one in part(controller)]
    if json:
        print_json([asdict(one) for one in found])
    else:
        for one in found:
            print(f"{'kept  ' if one.kept else 'BROKEN'}  {one.promise}: {one.seen}")
    if not all(one.kept for one in found):
        raise typer.Exit(exit_codes.FAULT)


def _identity(controller: Controller) -> Iterator[Checked]:
    from firmware_protocol.commands import PROTOCOL_VERSION, Capability, StatusFlag

    identity = controller.identity
    names = ", ".join(flag.name.lower() for flag in identity.capabilities if flag.name) or "none"
    yield Checked("speaks this version of the protocol", identity.version == PROTOCOL_VERSION, f"{identity.version}")
    yield Checked(
        "states a control period of 1 ms to 1 s", 1e-3 <= identity.period_s <= 1, f"{identity.period_s * 1e3:g} ms"
    )
    ring = (identity.ring_depth >= 8) == (Capability.SAMPLE in identity.capabilities)
    yield Checked("keeps 8 snapshots or more if it samples", ring, f"{identity.ring_depth}; capabilities: {names}")
    yield Checked("answers a repeated greeting alike", controller.hello() == identity, f"boots {identity.boots}")
    flags = controller.status().flags
    yield Checked("once greeted, has not restarted", StatusFlag.RESTARTED not in flags, str(flags.value))


def _samples(controller: Controller) -> Iterator[Checked]:
    from firmware_protocol.commands import Capability
    from firmware_protocol.units import ADC_COUNTS, POSTURE_UNITS, posture_to_counts

    snapshots = [controller.next_snapshot()]
    while len(snapshots) <= PERIODS:
        snapshots.append(controller.next_snapshot(snapshots[-1].tick))
    ticks = [snapshot.tick for snapshot in snapshots]
    rising = all(later > earlier for earlier, later in pairwise(ticks))
    yield Checked("delivers periods in order, each once", rising, f"ticks {ticks[0]} to {ticks[-1]}")
    if Capability.SAMPLE in controller.identity.capabilities:
        gaps = ticks[-1] - ticks[0] - PERIODS
        yield Checked("loses no period while it is asked in time", gaps == 0, f"{gaps} lost of {PERIODS}")
    readings = [(joint, reading) for snapshot in snapshots for joint, reading in snapshot.joints]
    wrong = [
        f"joint {joint}: {reading}"
        for joint, reading in readings
        if not 0 <= reading.position < ADC_COUNTS
        or not 0 <= reading.set_point < POSTURE_UNITS
        or reading.position + reading.error != posture_to_counts(reading.set_point)
    ]
    yield Checked("position + error is the set point", not wrong, wrong[0] if wrong else f"{len(readings)} readings")
    report = controller.errors_positions_powers()
    last = dict(snapshots[-1].joints)
    far = [j for j, one in report.items() if abs(one.position - last[j].position) > AT_REST_COUNTS]
    shown = f"joints {far} differ" if far else "within the noise of an arm at rest"
    yield Checked("reports the positions that it samples", not far, shown)


def _refusals(controller: Controller) -> Iterator[Checked]:
    from daq.link import RequestRefusedError
    from firmware_protocol.commands import Block, ReadBlock, Refusal

    memory_map = controller.memory_map
    last = memory_map.base + memory_map.size - 1
    for promise, address, count in (
        ("refuses a block before the memory", memory_map.base - 1, 1),
        ("refuses a block that ends behind the memory", last, 2),
    ):
        if not 0 <= address <= 0xFFFF:
            continue
        try:
            controller.link.request(ReadBlock(address, count), Block)
            yield Checked(promise, False, "it was answered")
        except RequestRefusedError as error:
            yield Checked(promise, error.reason == Refusal.BAD_ADDRESS, str(error))
    data = controller.link.request(ReadBlock(last, 1), Block).data
    yield Checked("reads the last byte of the memory", len(data) == 1, f"{last:04X}")


def _settings(controller: Controller) -> Iterator[Checked]:
    from daq.link import RequestRefusedError
    from firmware_protocol.commands import Refusal
    from firmware_protocol.units import GAIN_MAX

    if gains := controller.gains():
        above = [joint for joint, values in gains.items() if max(values) > GAIN_MAX]
        yield Checked(f"has gains from 0 to {GAIN_MAX}", not above, "; ".join(f"{j}: {g}" for j, g in gains.items()))
    if not controller.memory_map.has_process:
        return
    try:
        process = controller.process()
    except RequestRefusedError as error:
        if error.reason != Refusal.NOT_CAPABLE:
            raise
        return  # the bridge's memory map lacks them
    yield Checked("reports inputs, outputs and gripper", process.gripper in (0, 1), f"{process}")


CHECKS: tuple[Callable[[Controller], Iterator[Checked]], ...] = (_identity, _samples, _refusals, _settings)
"""The checks in order."""
