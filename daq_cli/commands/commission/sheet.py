"""The acceptance sheet of an arm: what was found on its first day, as a page with pictures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daq.contracts.errors import SpecError
from daq_cli.commands.commission.bench import FINDINGS
from daq_cli.commands.commission.record import FILE, Record
from daq_cli.commands.commission.steps import STEPS

if TYPE_CHECKING:
    from model.reports.page import Block, Report

SHEET = "acceptance.html"
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
"""Letters of each register in the picture of the memory."""
LEGEND = (
    "The shared memory: w set point, x position, e error, u power, P I D gains, each with its joint, + a high byte; "
    "in and out process signals, g gripper. Filled: found; outlined: assumed; empty: nothing of these."
)


def write_sheet(record: Record) -> Path:
    """Writes the page into the folder of the arm."""
    from model.reports.page import write_report

    return write_report(acceptance_sheet(record), record.folder / SHEET)


def acceptance_sheet(record: Record) -> Report:
    """The page of everything that is done, and what is open."""
    from model.reports.page import Report, Section, Text

    done = [step for step in STEPS if step.name in record.steps]
    open_steps = [step.title for step in STEPS if step.name not in record.steps]
    sections = []
    for step in done:
        result = record.steps[step.name]
        blocks: list[Block] = [
            Text(f"{step.does} Done {result['done']}.", "quiet"),
            *_pictures(record, step.name, result),
        ]
        blocks.append(_table(result))
        sections.append(Section(step.title, tuple(blocks)))
    answer = f"{len(done)} of {len(STEPS)} steps are done."
    if open_steps:
        answer += f" Open: {', '.join(open_steps)}."
    skipped = [one for one in done if record.steps[one.name].get("skipped")]
    if skipped:
        answer += f" Skipped: {', '.join(one.title for one in skipped)}."
    facts = (
        ("folder", record.folder.absolute().name),
        ("port", str(record.steps.get("line", {}).get("port", "not known"))),
    )
    return Report("Acceptance sheet", answer, facts, tuple(sections), errors="Intervals hold 95 %.")


def _table(result: dict[str, Any]) -> Block:
    from model.reports.page import Cell, Table

    rows = []
    for name, value in result.items():
        if name == "done":
            continue
        if isinstance(value, dict):
            rows += [(Cell(f"{name}: {key}"), Cell(_shown(one))) for key, one in value.items()]
        else:
            rows.append((Cell(name), Cell(_shown(value))))
    return Table(("what", "found"), tuple((Cell(c[0].text.replace("_", " ")), c[1]) for c in rows))


def _shown(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _pictures(record: Record, name: str, result: dict[str, Any]) -> list[Block]:
    from model.reports.page import Picture

    if name == "memory" and (record.folder / FINDINGS).exists():
        try:
            picture = memory_picture(json.loads((record.folder / FINDINGS).read_text("utf-8")))
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise SpecError(f"{record.folder / FINDINGS}: damaged ({type(error).__name__}): move it away") from error
        return [Picture(picture, LEGEND)]
    sensors = {key: value for key, value in result.items() if key.startswith("joint_") and isinstance(value, dict)}
    if name == "potentiometers" and sensors:
        for joint, sensor in sensors.items():
            counts, left = sensor.get("counts"), sensor.get("residuals_deg")
            if not (isinstance(counts, list) and isinstance(left, list) and len(counts) == len(left)):
                raise SpecError(f"{record.folder / FILE}: {joint} of potentiometers needs counts and residuals_deg")
        return [
            Picture(_sensor_picture(sensors), "Departure of the protractor's angles from each joint's straight line.")
        ]
    return []


def memory_picture(findings: dict[str, Any]) -> str:
    """The page as a grid of bytes, each with its register and joint."""
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
