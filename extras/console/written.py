"""Writes the line that asks for an experiment: the inverse of `language.read`."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping
from typing import Any

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.joint_text import slides
from daq.contracts.machine import Machine
from daq_cli.app.quantities import parse_angle
from daq_cli.commands.run import KINDS
from extras.console.language import read

DIGITS = range(1, 18)
"""Digits with which a number is tried, until it reads back as the same."""


def line_of(spec: ExperimentSpec, machine: Machine) -> str:
    """Returns a line that `read` reads as `spec`. Raises SpecError for a motion that no line describes, such as a
    path."""
    wanted = spec.model_copy(update={"operator": None})
    words = _preset(wanted) or _words(wanted, machine)
    line = shlex.join(words)
    if words[-1:] == [""] or read(line, machine).spec != wanted:
        raise SpecError(f"a {spec.trajectory.kind} has no line; run it again from the form, or as a file")
    return line


def _preset(spec: ExperimentSpec) -> list[str]:
    from daq.trajectories.presets import PRESETS

    return next((["run", "preset", name] for name, one in PRESETS.items() if one.spec == spec), [])


def _words(spec: ExperimentSpec, machine: Machine) -> list[str]:
    name = spec.trajectory.kind.replace("_", "-")
    if name not in KINDS:
        raise SpecError(f"a {spec.trajectory.kind} has no line; run it again from the form, or as a file")
    words = ["run", name]
    trajectory = spec.trajectory
    for field, info in KINDS[name].model_fields.items():
        value = getattr(trajectory, field)
        if field == "kind" or value == info.default:
            continue
        if isinstance(value, bool):
            words.append(f"--{field}" if value else f"--no-{field}")
        else:
            words += [f"--{field}", _trajectory_text(field, value, machine, spec.joints)]
    plain = ExperimentSpec()
    if spec.joints != plain.joints:
        words += ["--joints", ",".join(map(str, spec.joints))]
    if spec.start:
        words += ["--start", _angles(spec.start, machine)]
    if spec.gains:
        words += ["--gains", ",".join(f"{joint}={p}/{i}/{d}" for joint, (p, i, d) in spec.gains.items())]
    if spec.record is not None:
        words += ["--record", ",".join(map(str, spec.record))]
    for field in ("settle", "hold", "repeats", "name", "notes"):
        if (value := getattr(spec, field)) != getattr(plain, field):
            words += [f"--{field}", str(value)]
    return words


def _trajectory_text(field: str, value: Any, machine: Machine, joints: tuple[int, ...]) -> str:
    if field == "points":
        return ";".join(_angles(point, machine) if isinstance(point, Mapping) else _angle(point) for point in value)
    if field == "times":
        return ",".join(map(repr, value))
    if isinstance(value, Mapping):
        return _angles(value, machine)
    if field in ("amplitude", "speed", "phase"):
        if field != "phase" and all(slides(machine, joint) for joint in joints):
            return f"{value!r}m" + "/s" * (field == "speed")
        return _angle(value)
    return str(value)


def _angles(values: Mapping[int, float], machine: Machine) -> str:
    shown = {joint: f"{value!r}m" if slides(machine, joint) else _angle(value) for joint, value in values.items()}
    return ",".join(f"{joint}={text}" for joint, text in shown.items())


def _angle(value: float) -> str:
    """Returns the shortest number of degrees that reads back as exactly this angle (rad), else the angle in rad."""
    for digits in DIGITS:
        if parse_angle(text := f"{math.degrees(value):.{digits}g}", "angle") == value:
            return text
    return f"{value!r}rad"
