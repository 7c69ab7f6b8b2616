"""The machine file of one arm: a text that ships or was configured, with what was measured at this arm in it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path

from daq.contracts.documents import read_text
from daq.contracts.errors import SpecError
from daq.contracts.machine import parse_machine, shipped_machines
from extras.commissioning.potentiometer import Potentiometer


def machine_file_text(name_or_path: str) -> str:
    """The text of a machine that ships, or of any file. Raises SpecError."""
    if name_or_path in shipped_machines():
        return (resources.files("daq.contracts") / "machines" / f"{name_or_path}.toml").read_text("utf-8")
    return read_text(Path(name_or_path), f"machine file {name_or_path}")


def with_sensors(text: str, sensors: Sequence[Potentiometer]) -> str:
    """A machine file with these sensors in it. Raises SpecError."""
    head, *joints = re.split(r"(?m)^(?=\[\[joints\]\])", text)
    for sensor in sensors:
        if sensor.joint > len(joints):
            raise SpecError(f"machine file: it has no joint {sensor.joint}")
        joints[sensor.joint - 1] = _with_sensor(joints[sensor.joint - 1], sensor)
    return _loadable(head + "".join(joints))


def _with_sensor(joint: str, sensor: Potentiometer) -> str:
    before, table, after = joint.partition("[joints.sensor]\n")
    source = f"measured at {len(sensor.counts)} postures"
    values = {
        name: f'{{ value = {found.value!r}, unit = "rad", source = "{source}, ± {found.half_width:.4f} rad" }}'
        for name, found in (("range", sensor.range), ("at_zero", sensor.at_zero))
    }
    values["direction"] = str(sensor.direction)
    for name, value in values.items():
        after = _with_line(after, name, value)
    return before + table + after


def with_limits(text: str, limits: Mapping[int, tuple[float, float]]) -> str:
    """A machine file whose joint limits (rad) are nowhere wider than these. Raises SpecError."""
    machine = parse_machine(text, "machine file")
    rows = [
        {name: getattr(row, name) for name in ("low", "high", "speed") if getattr(row, name) is not None}
        for row in machine.limits.joints
    ]
    for joint, (low, high) in limits.items():
        row = rows[joint - 1]
        row |= {"low": max(row.get("low", low), low), "high": min(row.get("high", high), high)}
    lines = [", ".join(f"{name} = {float(value)!r}" for name, value in row.items()) for row in rows]
    array = "[\n" + "".join(f"    {{ {line} }},\n" for line in lines) + "]"
    before, table, after = text.partition("[limits]\n")
    found = re.search(r"(?ms)^joints = \[.*?^\]", after)
    if not table or found is None:
        raise SpecError("machine file: [limits] has no joints = [ … ] to write the end stops to")
    return _loadable(f"{before}{table}{after[: found.start()]}joints = {array}{after[found.end() :]}")


def with_controller(text: str, values: Mapping[str, str]) -> str:
    """A machine file with these lines, as TOML, in its table of the controller. Raises SpecError."""
    before, table, after = text.partition("[controller]\n")
    if not table:
        raise SpecError("machine file: it has no [controller]")
    for name, value in values.items():
        after = _with_line(after, name, value)
    return _loadable(before + table + after)


def _with_line(table: str, name: str, value: str) -> str:
    """A table whose line `name = …` is replaced, or is new at its beginning."""
    end = re.search(r"(?m)^\[", table)
    own, rest = (table, "") if end is None else (table[: end.start()], table[end.start() :])
    found = re.search(rf"(?m)^{name} = .*\n", own)
    start, stop = found.span() if found else (0, 0)
    return f"{own[:start]}{name} = {value}\n{own[stop:]}{rest}"


def _loadable(text: str) -> str:
    """The text, parsed once."""
    parse_machine(text, "machine file")
    return text
