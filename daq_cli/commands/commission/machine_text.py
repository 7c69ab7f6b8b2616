"""The machine file of one arm: the shipped text with the sensors that were measured."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib import resources

from daq.commissioning.potentiometer import Potentiometer
from daq.contracts.machine import parse_machine


def measured_machine_text(sensors: Sequence[Potentiometer], text: str | None = None) -> str:
    """A machine file with these sensors in it; it is parsed once, so that it can be loaded. Raises SpecError."""
    text = text or (resources.files("daq.contracts") / "machines" / "ma2000.toml").read_text("utf-8")
    head, *joints = re.split(r"(?m)^(?=\[\[joints\]\])", text)
    for sensor in sensors:
        joints[sensor.joint - 1] = _with_sensor(joints[sensor.joint - 1], sensor)
    result = head + "".join(joints)
    parse_machine(result, "machine file")
    return result


def _with_sensor(joint: str, sensor: Potentiometer) -> str:
    before, table, after = joint.partition("[joints.sensor]\n")
    source = f"measured at {len(sensor.counts)} postures"
    values = {
        name: f'{{ value = {found.value!r}, unit = "rad", source = "{source}, ± {found.half_width:.4f} rad" }}'
        for name, found in (("range", sensor.range), ("at_zero", sensor.at_zero))
    }
    values["direction"] = str(sensor.direction)
    for name, value in values.items():
        found = re.search(rf"(?m)^{name} = .*\n", after)
        start, end = found.span() if found else (0, 0)
        after = f"{after[:start]}{name} = {value}\n{after[end:]}"
    return before + table + after
