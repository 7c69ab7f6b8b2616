"""Writes a machine as a TOML file in the short form, from which it can be loaded again."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from daq.config.toml_text import toml_value
from daq.contracts.machine import Machine
from daq.contracts.machine_form import DEFAULT, DOWN
from daq.contracts.written_numbers import NUMBERS, UNSTATED, number_text, read_number

WIDTH = 118
"""Most characters per line; a longer table gets one line per number."""
_NUMBER = {"value", "unit", "source"}


OTHER_UNITS = {"rad": ("deg", 180.0 / math.pi), "s": ("ms", 1e3), "m": ("mm", 1e3)}
"""Units that may be shorter to write, with their factors."""
ALIKE = ("drive", "friction", "sensor")
"""Parts of a joint that may be copied from another by `like`."""


def machine_text(machine: Machine, drives: Mapping[int, str] | None = None) -> str:
    """Returns the text of a machine file. Defaults are left out; sources are comments after their numbers.

    drives: names from the library by joint (from 1), written in place of drive, friction and sensor; if all joints
    have one, the controller is that of the servos.
    """
    named = drives or {}
    data = machine.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
    joints, limits = data.pop("joints"), data.pop("limits", None)
    notes = str(data.pop("notes", ""))
    for name, default in (
        ("version", 1),
        ("title", machine.name),
        ("gravity", DOWN),
        ("modelled_joints", list(range(1, len(joints) + 1))),
        ("controller", {"kind": "none"}),
    ):
        if data.get(name) == default:
            del data[name]
    controller = data.pop("controller", None) if set(named) != set(range(1, len(joints) + 1)) else None
    lines = [line for key, value in data.items() for line in _entry(key, value)]
    if notes and "\n" not in notes and len(notes) < WIDTH - len("notes = ''"):
        lines.append(f"notes = {toml_value(notes)}")
    elif notes:
        lines += ['notes = """', *(toml_value(line)[1:-1] for line in notes.split("\n"))]
        lines[-1] += '"""'
    if controller is not None:
        lines += _table("controller", controller, "")
    if limits:
        lines += ["", "[limits]", *(line for key, value in limits.items() for line in _entry(key, value))]
    for k, joint in enumerate(joints):
        if k + 1 in named:
            joint |= {"drive": named[k + 1], "friction": {}, "sensor": {}}
        alike = next((one for one in joints[:k] if all(one.get(part) == joint.get(part) for part in ALIKE)), None)
        lines += ["", "[[joints]]", *_joint(joint, alike)]
    return "\n".join(lines) + "\n"


def _joint(joint: dict[str, Any], alike: dict[str, Any] | None) -> list[str]:
    geometry = {k: v for k, v in joint["geometry"].items() if not _is_plain_zero(v)}
    link = {k: v for k, v in joint["link"].items() if k != "shape"}
    if joint["link"]["shape"] == "body":
        products = link["inertia"][3:]
        if all(map(_is_plain_zero, products)):
            link["inertia"] = link["inertia"][:3]
        link = {k: v for k, v in link.items() if not (isinstance(v, list) and all(map(_is_default, v)))}
        if not {"centre", "inertia"} & set(link):
            link["shape"] = "body"
    parts = {"geometry": geometry, "link": link}
    own = [f"name = {toml_value(joint['name'])}"]
    if joint["kind"] != "revolute":
        own.append(f"kind = {toml_value(joint['kind'])}")
    if isinstance(joint["drive"], str):
        own.append(f"drive = {toml_value(joint['drive'])}")
    elif alike is None:
        parts |= {"drive": _drive(joint["drive"]), "friction": joint.get("friction", {})}
        parts["sensor"] = {k: v for k, v in joint.get("sensor", {}).items() if not _is_default(v)}
    else:
        own.append(f"like = {toml_value(alike['name'])}")
    tables = [_table(name, table, "joints.") for name, table in parts.items() if table]
    inline = [lines for lines in tables if lines[0]]
    return [*own, *(line for lines in (*inline, *(t for t in tables if not t[0])) for line in lines)]


def _drive(drive: dict[str, Any]) -> dict[str, Any]:
    gear = drive.get("gear_ratio")
    told = {k: v for k, v in drive.items() if not _is_default(v) and k != "kind"}
    if gear is not None and gear["value"] == 1.0 and not set(gear) - _NUMBER:
        told.pop("gear_ratio", None)
    if not {"gain", "resistance", "torque_constant"} & set(told):
        told = {"kind": drive["kind"], **told}
    return told


def _table(name: str, table: dict[str, Any], above: str) -> list[str]:
    """Writes a table on one line, if it fits and all its numbers have one source; otherwise one line per number."""
    sources = {one["source"] for value in table.values() for one in _numbers(value)}
    assumed = {bool(one.get("assumed")) for value in table.values() for one in _numbers(value)}
    if len(sources) < 2 and len(assumed) < 2:
        line = f"{name} = {{ {', '.join(f'{key} = {_value(value)}' for key, value in table.items())} }}"
        line += next((_comment(one) for value in table.values() for one in _numbers(value)), "")
        if len(line) <= WIDTH:
            return [line]
    line = f"{name} = {{ {', '.join(f'{key} = {_value(value, sourced=True)}' for key, value in table.items())} }}"
    if len(line) <= WIDTH:
        return [line]
    return ["", f"[{above}{name}]", *(line for key, value in table.items() for line in _entry(key, value))]


def _entry(key: str, value: Any) -> list[str]:
    """Writes an entry; a list of numbers with different sources gets one line per number."""
    numbers = _numbers(value)
    comments = [_comment(one) for one in numbers]
    line = f"{key} = {_value(value)}"
    if len(set(comments)) < 2 and len(line) <= WIDTH:
        return [line + (comments[0] if comments else "")]
    if not isinstance(value, list):
        return [line + (comments[0] if comments else "")]
    behind = comments or [""] * len(value)
    return [f"{key} = [", *(f"    {_value(one)},{own}" for one, own in zip(value, behind, strict=True)), "]"]


def _value(value: Any, *, sourced: bool = False) -> str:
    if _is_number(value):
        comment = _comment(value).removeprefix("  # ") if sourced else ""
        return toml_value(_short(value) + (f", {comment}" if comment else ""))
    if isinstance(value, list) and value:
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{key} = {_value(one)}' for key, one in value.items())} }}"
    return toml_value(value)


def _short(number: dict[str, Any]) -> str:
    """Writes a number, in a smaller unit if that is shorter and reads back as the same value."""
    plain = number_text(number)
    unit, factor = OTHER_UNITS.get(number["unit"], ("", 0.0))
    if not unit or number["value"] == 0.0:
        return plain
    names = [name for name in NUMBERS if number.get(name) is not None]
    turned = number_text(number | {"unit": unit} | {n: round(number[n] * factor, 10) for n in names})
    back = read_number(turned, "", (number["unit"],))
    same = all(back.get(name) == number[name] for name in names if not (name == "low" and number[name] == 0.0))
    return turned if same and len(turned) < len(plain) else plain


def _comment(number: dict[str, Any]) -> str:
    source = " ".join(number["source"].split())
    if number.get("assumed") and not source.startswith("guess"):
        source = f"assumed: {source}"
    return "" if source == UNSTATED else f"  # {source}"


def _numbers(value: Any) -> list[dict[str, Any]]:
    if _is_number(value):
        return [value]
    return [one for one in value if _is_number(one)] if isinstance(value, list) else []


def _is_number(value: Any) -> bool:
    return isinstance(value, dict) and set(value) >= _NUMBER


def _is_default(value: Any) -> bool:
    return _is_number(value) and value["source"] == DEFAULT


def _is_plain_zero(number: dict[str, Any]) -> bool:
    """Whether a number is 0 without any other property."""
    return bool(number["value"] == 0.0) and not set(number) - _NUMBER - {"assumed"}
