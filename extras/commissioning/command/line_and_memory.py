"""Commissioning steps for line, memory and bridge; only the memory's search needs a person's hand."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from daq_cli.app.context import console
from extras.commissioning.command.arm import note_adapter, note_memory
from extras.commissioning.command.bench import FINDINGS, MAP, Bench, NotCommissionedError, connected
from extras.commissioning.person.safe_release import typical

if TYPE_CHECKING:
    from daq.driver import Controller
    from extras.commissioning.memory.commands import CommandProof
    from extras.commissioning.memory.findings import Findings
    from firmware_protocol.message import Reply, Request

R = TypeVar("R", bound="Reply")

ROUND_TRIPS = 200
"""Number of single bytes read to judge the line."""
SAME_READING = 12
"""Largest difference (ADC counts) between a position by the bridge's memory map and by the one that was found."""
GAINS, SIGNALS = ("gain_p", "gain_i", "gain_d"), ("process_inputs", "process_outputs")

GIVE_IT = (
    "Load this one: for a board `make firmware MAP={map}`, loaded as docs/hardware.md says (for a mock: "
    "--memory-map {map}); then run `daq commission` again"
)
"""Advice for a bridge with another memory map."""


def line(bench: Bench) -> dict[str, Any]:
    """Measures round trips, repeats and damage of the line, and reads the bridge's description of itself."""
    from firmware_protocol.commands import Capability

    with _page(bench) as page:
        times = []
        for _ in range(ROUND_TRIPS):
            begun = time.perf_counter()
            page.read_byte(page.base)
            times.append(1e3 * (time.perf_counter() - begun))
        counters = page.link.counters.numbers()
        hello = page.hello
    bench.configure()
    adapter = bench.adapter()
    note_adapter(bench, adapter)
    capabilities = [flag.name.lower() for flag in Capability(hello.capabilities) if flag.name]
    return {
        "port": bench.call.port,
        "adapter": adapter or "has no serial number",
        "protocol": hello.version,
        "capabilities": capabilities,
        "period_stated_ms": hello.period_us / 1e3,
        "round_trip_median_ms": round(float(np.median(times)), 3),
        "round_trip_worst_ms": round(max(times), 3),
        "repeated": int(counters.get("retries", 0)),
        "damaged": int(counters.get("damaged", 0)),
    }


def memory(bench: Bench) -> dict[str, Any]:
    """Finds the memory map, by `daq memory find`. An earlier one, its findings and its record stay if this search ends
    early."""
    from extras.commissioning.memory_command import (
        adopt,
        findings_text,
        keep_map,
        search,
        until_complete,
        what_is_absent,
        why_no_map,
    )

    path, findings = bench.folder / MAP, bench.folder / FINDINGS

    def when_found(found: Findings) -> None:
        if keep_map(found, new_map) and new_map == path:
            bench.configure()
            note_memory(bench)
            bench.record.keep("memory", _memory_result(found, []))

    with _page(bench) as page:
        new_map, new_findings = until_complete(path, findings, bench.operator)
        found, proofs = search(
            bench.call,
            page,
            bench.operator,
            bench.consent,
            new_findings,
            inputs=True,
            commands=True,
            when_found=when_found,
            pressed=bench.record.note_stop,
        )
    bench.operator.show(findings_text(found, proofs))
    complete = adopt(found, {new_map: path, new_findings: findings})
    bench.configure()
    if not complete:
        raise NotCommissionedError(f"{why_no_map(found, bench.folder / MAP)}; then continue with --skip memory")
    if absent := what_is_absent(found, bench.folder / MAP):
        bench.operator.show(absent)
    note_memory(bench)
    return _memory_result(found, proofs)


def _memory_result(found: Findings, proofs: Sequence[CommandProof]) -> dict[str, Any]:
    verdicts = [one.verdict for one in found.all]
    set_points = [found.of("set_point", joint).is_found for joint in range(1, 7)]
    return {
        "map": MAP,
        "findings": FINDINGS,
        "found": sum(one.is_found for one in found.all),
        "assumed": verdicts.count("assumed"),
        "absent": list(found.absent()),
        "contradicts_the_documented": verdicts.count("contradicts"),
        "set_points_at_power_up": "the measured posture" if all(set_points) else "not seen",
        "proved_by_command": [proof.joint for proof in proofs if proof.proved and not proof.problem],
        "drive_signs": [proof.sign for proof in proofs],
    }


def bridge(bench: Bench) -> dict[str, Any]:
    """Checks whether the bridge uses the memory map that was found."""
    from extras.commissioning.person.memory_page import open_page
    from firmware_protocol.commands import Gains, Process, ReadProcess, ReportGains

    memory_map, give_it = bench.memory_map(), GIVE_IT.format(map=bench.folder / MAP)
    with open_page(bench.call.port, memory_map) as page:
        own = {name: typical(page, memory_map, name, 5) for name in ("set_point", "position", "error", "power")}
        names = (*(GAINS if memory_map.has_gains else ()), *(SIGNALS if memory_map.has_process else ()))
        still = {name: typical(page, memory_map, name, 5) for name in names}
    with connected(bench) as controller:
        told = controller.errors_positions_powers()
        told_gains = _of_the_bridge(controller, ReportGains(), Gains)
        gains = dict(enumerate(told_gains.gains if told_gains else (), start=1))
        process = _of_the_bridge(controller, ReadProcess(), Process)
    for what, there, wanted in (
        ("gains", bool(gains), memory_map.has_gains),
        ("process signals", process is not None, memory_map.has_process),
    ):
        if there != wanted:  # the bridge must not write to a place that the arm's map leaves out
            raise NotCommissionedError(f"the bridge {'has' if there else 'lacks'} {what}, unlike {MAP}. {give_it}")
    far = [
        f"{name.replace('_', ' ')} {joint}"
        for name, values in own.items()
        for joint, value in values.items()
        if abs(getattr(told[joint], name) - value) > (SAME_READING if name != "set_point" else 0)
    ]
    far += [
        f"{name.replace('_', ' ')} {joint}"
        for index, name in enumerate(GAINS if gains else ())
        for joint, value in still[name].items()
        if gains[joint][index] != value
    ]
    if process is not None:
        signals = (process.inputs, process.outputs)
        far += [name.replace("_", " ") for name, value in zip(SIGNALS, signals, strict=True) if still[name][1] != value]
    if far:
        raise NotCommissionedError(
            f"the bridge reads {', '.join(far[:6])} elsewhere than {MAP} says: it uses another map. {give_it}"
        )
    return {"positions": [round(value) for _, value in sorted(own["position"].items())]}


def _of_the_bridge(controller: Controller, request: Request, wanted: type[R]) -> R | None:
    """Returns the bridge's reading by its own memory map; None if that leaves out the registers.

    The controller would not request registers that the arm's map leaves out. Whether the bridge has them all the same
    is the question here.
    """
    from daq.link import RequestRefusedError
    from firmware_protocol.commands import Refusal

    try:
        return controller.link.request(request, wanted)
    except RequestRefusedError as error:
        if error.reason != Refusal.NOT_CAPABLE:
            raise
        return None


def _page(bench: Bench) -> Any:
    from extras.commissioning.person.memory_page import open_page

    console().print(f"    {bench.call.port}")
    return open_page(bench.call.port, bench.memory_map())
