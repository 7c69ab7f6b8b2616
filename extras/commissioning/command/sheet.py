"""Makes the acceptance sheet of an arm: results of its first day, as a page with pictures.

It also states the origin of each address of an arm's memory map.
"""

from __future__ import annotations

import json
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from daq.contracts.errors import SpecError
from extras.commissioning.command.bench import FINDINGS, MAP
from extras.commissioning.command.record import FILE, Record
from extras.commissioning.command.steps import STEPS
from firmware_protocol.memory_map import JOINTS

if TYPE_CHECKING:
    from firmware_protocol.memory_map import MemoryMap
    from model.blocks import Block, Report


FROM = ("found", "assumed", "by hand")
"""Origin of an address: evidence at the arm, a place that agrees with all readings, or a person who has entered (or
changed) it."""


def address_blocks(findings: dict[str, Any], path: Path) -> list[Block]:
    """Returns the results of the proof by command, and a table of the addresses by register; without a memory map only
    the first.

    findings: those of `daq memory find`. Raises for a damaged file: KeyError, ValueError, TypeError.
    """
    from daq.config.robot_files import load_memory_map
    from model.blocks import Cell, Table, Text

    proved = [
        str(one["joint"]) for one in findings.get("proved_by_command", []) if one["proved"] and not one["problem"]
    ]
    blocks: list[Block] = [Text(f"Set points proved by command: joints {', '.join(proved) or 'none'}.")]
    if not path.exists():
        return blocks
    memory_map = load_memory_map(path)
    rows = [
        (Cell(name.replace("_", " ")), *(Cell(", ".join(one[kind])) for kind in FROM))
        for name, one in addresses_of(findings, memory_map).items()
    ]
    rows += [
        (Cell(name.replace("_", " ")), Cell("left out: no place is known"), Cell(""), Cell(""))
        for name in memory_map.absent
    ]
    return [*blocks, Table(("register", "found at this arm", "assumed", "filled in by hand"), tuple(rows))]


def addresses_of(findings: dict[str, Any], memory_map: MemoryMap) -> dict[str, dict[str, list[str]]]:
    """Returns register → origin of its addresses (`FROM`) → these addresses, joint by joint, the low byte first."""
    known = {(one["register"], one.get("joint") or 1): one for one in findings["findings"]}
    result: dict[str, dict[str, list[str]]] = {}
    for name, register in memory_map.registers.items():
        kinds: dict[str, list[str]] = {kind: [] for kind in FROM}
        for index, low in enumerate(register.low):
            places = [low] if register.high is None else [low, register.high[index]]
            finding = known.get((name, index + 1), {})
            told = [int(finding[half], 16) for half in ("low", "high") if half in finding]
            kind = "by hand" if told != places else "assumed" if finding["verdict"] == "assumed" else "found"
            kinds[kind].append("+".join(f"{place:04X}" for place in places))
        result[name] = kinds
    return result


SHEET = "acceptance.html"
NO_REASON = "no reason was given"
NOT_SHOWN = ("done", "basis")
"""Entries of the record that only the program uses."""
INTERVALS = ("range_deg", "at_zero_deg", "bend_percent")
"""Values with half the width of their interval."""
UNITS = {"_deg": "°", "_percent": "%", "_ms": "ms"}
"""Ends of names that are units."""
LABELS = {
    "positions": "positions by the bridge's memory map (ADC counts, joints 1 to 6)",
    "frozen": "set points held by the stop (posture units, joints 1 to 6)",
    "confirmed_ms": "time from the request to the board's confirmation (ms)",
    "power": "power while pushed (DAC counts)",
    "error_counts": "error (ADC counts)",
    "moved_counts": "moved by itself within a second (ADC counts)",
    "error_in_floors": "error (multiples of the noise floor)",
    "beyond_the_reading": "the joint moves on where the reading ends (lower, upper end)",
    "readings": "readings there (ADC counts)",
    "volts_per_rad": "gain (V/rad)",
    "standard_error": "its standard error (V/rad)",
    "dac_counts_per_adc_count": "gain (DAC counts per ADC count)",
    "lowest": "lowest that agrees",
    "highest": "highest that agrees",
    "p": "gain P",
    "different_errors": "number of different errors",
    "absent": "left out of the memory map",
    "set_points_taken_late": "set points taken a period late, or not at all",
    "missing": "missing samples",
    "found": "registers found",
    "assumed": "registers assumed",
    "drive_signs": "signs of the drives (1: towards the set point)",
    "to_be_run_next": "most informative next experiment",
}
"""Names in the record that need more words, or units."""
DRAWN = ("counts", "angles_deg", "residuals_deg")
"""Signals in the pictures of potentiometers."""
MEASURED = {"potentiometers": "sensors", "end_stops": "end stops", "gain": "gain"}
"""Steps that measure joints one by one, and their measurements."""
RAMPS = ("first_ramp", "ramp")
"""Steps that show their record."""
COLUMNS, CELL = 16, 30
REGISTER_COLOURS = {
    "position": 1,
    "error": 2,
    "power": 3,
    "set_point": 4,
    "gain_p": 5,
    "gain_i": 5,
    "gain_d": 5,
    "process_inputs": 6,
    "process_outputs": 6,
    "gripper": 6,
}
"""Number of the page's colour for each register."""
LETTERS = {
    "position": "x",
    "error": "e",
    "power": "u",
    "set_point": "w",
    "gain_p": "P",
    "gain_i": "I",
    "gain_d": "D",
    "process_inputs": "in",
    "process_outputs": "out",
    "gripper": "g",
}
"""Letters for each register in the picture of the memory."""
LEGEND = (
    "The shared memory: w set point, x position, e error, u power, P I D gains, each with its joint, + a high byte; "
    "in and out process signals, g gripper. Filled: found; outlined: assumed; empty: no register."
)


def write_sheet(record: Record) -> Path:
    """Writes the page into the folder of the arm."""
    from model.reports.page import write_report

    return write_report(acceptance_sheet(record), record.folder / SHEET)


def acceptance_sheet(record: Record) -> Report:
    """Returns the page of all completed and open steps."""
    from model.blocks import Cell, Report, Section, Table

    sections = tuple(
        Section(step.title, tuple(_blocks(record, step.name, step.does))) for step in STEPS if step.name in record.steps
    )
    facts = (
        ("folder", record.folder.absolute().name),
        ("port", str(record.steps.get("line", {}).get("port", "not known"))),
        ("operator", record.operator or "not named: set `operator` in daq.toml"),
        ("software", f"ma2000-daq {version('ma2000-daq')}"),
        ("not measured", _not_measured(record)),
    )
    signed = Section("Accepted", (Table(("name", "date", "signature"), ((Cell("\u2003"), Cell(""), Cell("")),)),))
    return Report("Acceptance sheet", _answer(record), facts, (*sections, signed), errors="Intervals are 95 %.")


def _not_measured(record: Record) -> str:
    """Returns the joints that were not measured, by measurement."""
    parts = []
    for name, what in MEASURED.items():
        done = record.done.get(name, {})
        joints = [str(joint) for joint in range(1, JOINTS + 1) if f"joint_{joint}" not in done]
        if joints:
            parts.append(f"{what} of joints {', '.join(joints)}")
    return "; ".join(parts) or "nothing"


def _answer(record: Record) -> str:
    """Returns how many steps are done, left out and open."""
    done, left_out = [[step.title for step in STEPS if step.name in some] for some in (record.done, record.left_out)]
    still_open = [step.title for step in STEPS if step.name not in record.steps]
    answer = f"{len(done)} of {len(STEPS)} steps are done, {len(left_out)} are left out, {len(still_open)} are open."
    if left_out:
        answer += f" Left out: {', '.join(left_out)}."
    if still_open:
        answer += f" Open: {', '.join(still_open)}."
    return answer


def _blocks(record: Record, name: str, does: str) -> list[Block]:
    """Returns the content of a section: the result of a completed step, or why it was left out."""
    from model.blocks import Text

    result = record.steps[name]
    when = _when(str(result["done"]))
    if name in record.left_out:
        left_out: list[Block] = [Text(f"Left out on {when}: {result.get('reason', NO_REASON)}.", "warning")]
        return left_out + (_pictures(record, name, result) if name == "memory" else [])
    if "trace" in result:
        result = result | {"trace": _beside(record.folder, str(result["trace"]))}
    return [Text(f"{does} Done on {when}.", "quiet"), *_pictures(record, name, result), *_tables(result)]


def _beside(folder: Path, path: str) -> str:
    """Returns a path relative to the folder of the arm if it is inside, else unchanged."""
    whole = folder.absolute()
    return str(Path(path).relative_to(whole)) if Path(path).is_relative_to(whole) else path


def _when(iso: str) -> str:
    """Formats a time as 2026-11-23 08:15 UTC."""
    return f"{iso[:16].replace('T', ' ')} UTC" if iso.endswith("+00:00") else iso


def _tables(result: dict[str, Any]) -> list[Block]:
    """Returns the result of a step: a table of its single values, and one with a row for each joint."""
    from model.blocks import Cell, Table

    joints = {name: one for name, one in result.items() if name.startswith("joint_") and isinstance(one, dict)}
    single = {name: one for name, one in result.items() if name not in joints and name not in NOT_SHOWN}
    tables: list[Block] = []
    if single:
        rows = []
        for name, value in single.items():
            parts = value.items() if isinstance(value, dict) else [("", value)]
            rows += [(Cell(_words(f"{name} {part}")), Cell(_shown(one))) for part, one in parts]
        tables.append(Table(("what", "found"), tuple(rows)))
    if joints:
        columns = list(dict.fromkeys(key for one in joints.values() for key in one if key not in DRAWN))
        body = [
            (Cell(_words(name)), *(Cell(_shown(one.get(key, ""), key in INTERVALS), number=True) for key in columns))
            for name, one in joints.items()
        ]
        tables.append(Table(("joint", *map(_words, columns)), tuple(body)))
    return tables


def _words(name: str) -> str:
    """Returns a name of the record in words."""
    name = name.strip()
    if name in LABELS:
        return LABELS[name]
    for suffix, unit in UNITS.items():
        if name.endswith(suffix):
            return f"{name.removesuffix(suffix).replace('_', ' ')} ({unit})"
    return name.replace("_", " ")


def _shown(value: Any, interval: bool = False) -> str:
    """Formats a value for people."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if interval and isinstance(value, list):
        return " ± ".join(map(str, value))
    if isinstance(value, list) and value and all(isinstance(one, bool) for one in value):
        return ", ".join(map(_shown, value))
    return (", ".join(map(str, value)) or "none") if isinstance(value, list) else str(value)


def _pictures(record: Record, name: str, result: dict[str, Any]) -> list[Block]:
    from model.blocks import Picture

    if name == "memory" and (record.folder / FINDINGS).exists():
        try:
            found = json.loads((record.folder / FINDINGS).read_text("utf-8"))
            return [Picture(memory_picture(found), LEGEND), *address_blocks(found, record.folder / MAP)]
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise SpecError(f"{record.folder / FINDINGS}: damaged ({type(error).__name__}): move it away") from error
    sensors = {key: value for key, value in result.items() if key.startswith("joint_") and isinstance(value, dict)}
    if name == "potentiometers" and sensors:
        for joint, sensor in sensors.items():
            counts, left = sensor.get("counts"), sensor.get("residuals_deg")
            if not (isinstance(counts, list) and isinstance(left, list) and len(counts) == len(left)):
                raise SpecError(f"{record.folder / FILE}: {joint} of potentiometers needs counts and residuals_deg")
        return [
            Picture(_sensor_picture(sensors), "Departure of the protractor's angles from each joint's straight line.")
        ]
    if name in RAMPS and (record.folder / result["trace"]).exists():
        caption = "Set points (grey) and positions, relative to each joint's first."
        return [Picture(_ramp_picture(record.folder / result["trace"]), caption)]
    return []


def memory_picture(findings: dict[str, Any]) -> str:
    """Draws the page as a grid of bytes, each with its register and joint."""
    base, size = int(findings["base"], 16), int(findings["size"])
    owner: dict[int, tuple[dict[str, Any], str]] = {}
    for one in findings["findings"]:
        for half in ("low", "high"):
            if half in one:
                owner[int(one[half], 16)] = (one, half)
    rows = -(-size // COLUMNS)
    view = f"0 0 {COLUMNS * CELL + 50} {rows * CELL + 4}"
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{view}" role="img" font-family="monospace" font-size="10">'
    )
    parts = [head]
    for offset in range(size):
        x, y = 46 + offset % COLUMNS * CELL, offset // COLUMNS * CELL
        if offset % COLUMNS == 0:
            parts.append(f'<text x="0" y="{y + 19}" fill="var(--ink)">{base + offset:04X}</text>')
        style, text = 'fill="none" stroke="var(--grid)"', ""
        if base + offset in owner:
            one, half = owner[base + offset]
            colour = f"var(--colour-{REGISTER_COLOURS[one['register']]})"
            filled = one["verdict"] in ("found", "contradicts")
            style = f'fill="{colour}" fill-opacity="{0.35 if filled else 0}" stroke="{colour}"'
            text = f"{LETTERS[one['register']]}{one.get('joint', '')}{'' if half == 'low' else '+'}"
            parts.append(f"<g><title>{one['register']} {one.get('joint', '')} {half}: {one['verdict']}</title>")
        parts.append(f'<rect x="{x}" y="{y + 2}" width="{CELL - 3}" height="{CELL - 3}" rx="3" {style}/>')
        if text:
            parts.append(f'<text x="{x + 3}" y="{y + 19}" fill="var(--ink)">{text}</text></g>')
    return "".join(parts) + "</svg>"


def _sensor_picture(sensors: dict[str, Any]) -> str:
    from model.reports.figures import COLOURS, drawn

    def draw(figure: Any) -> None:
        axes = figure.subplots()
        for index, (name, sensor) in enumerate(sorted(sensors.items())):
            order = sorted(range(len(sensor["counts"])), key=lambda k: sensor["counts"][k])
            axes.plot(
                [sensor["counts"][k] for k in order],
                [sensor["residuals_deg"][k] for k in order],
                "o-",
                color=COLOURS[index % len(COLOURS)],
                label=name.replace("_", " "),
            )
        axes.set_xlabel("reading, ADC counts")
        axes.set_ylabel("angle − line, degrees")
        axes.legend()

    return drawn(draw, 2.6)


def _ramp_picture(path: Path) -> str:
    from daq.traces.reader import read_trace
    from model.reports.figures import COLOURS, drawn

    trace = read_trace(path)
    moved = trace.joints if trace.record.spec is None else trace.record.spec.joints

    def draw(figure: Any) -> None:
        panels = figure.subplots(1, len(moved), sharey=True, squeeze=False)[0]  # one per joint: joints move alike
        for number, (axes, joint) in enumerate(zip(panels, moved, strict=True)):
            column = trace.column(joint)
            begin = trace.position[0, column]
            if trace.set_point is not None:
                axes.plot(trace.time, np.rad2deg(trace.set_point[:, column] - begin), color="0.6")
            colour = COLOURS[number % len(COLOURS)]
            axes.plot(trace.time, np.rad2deg(trace.position[:, column] - begin), color=colour)
            axes.set_title(f"joint {joint}")
            axes.set_xlabel("time, s")
        panels[0].set_ylabel("from the start, degrees")

    return drawn(draw, 2.6)
