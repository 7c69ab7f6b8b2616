"""Writes a machine as the TOML file from which it can be loaded again, to the digit."""

from __future__ import annotations

from typing import Any

from daq.config.toml_text import toml_value
from daq.contracts.machine import Machine


def machine_text(machine: Machine) -> str:
    """A machine file: a table for each joint, and a line for each number."""
    data = machine.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
    notes = str(data.pop("notes", ""))
    joints, limits = data.pop("joints"), data.pop("limits", None)
    lines = [f"{key} = {toml_value(value)}" for key, value in data.items()]
    if notes:
        lines += ['notes = """', *(toml_value(line)[1:-1] for line in notes.split("\n"))]
        lines[-1] += '"""'
    if limits:
        lines += ["", "[limits]", *(f"{key} = {toml_value(value)}" for key, value in limits.items())]
    for joint in joints:
        lines += ["", "[[joints]]", *_joint(joint)]
    return "\n".join(lines) + "\n"


def _joint(joint: dict[str, Any]) -> list[str]:
    lines = [f"{key} = {toml_value(value)}" for key, value in joint.items() if not isinstance(value, dict)]
    for part, table in joint.items():
        if isinstance(table, dict) and table:
            lines += ["", f"[joints.{part}]"]
            for key, value in table.items():
                lines += _entry(key, value)
    return lines


def _entry(key: str, value: Any) -> list[str]:
    """A list of numbers with their sources has a line for each."""
    if isinstance(value, list):
        return [f"{key} = [", *(f"    {toml_value(one)}," for one in value), "]"]
    return [f"{key} = {toml_value(value)}"]
