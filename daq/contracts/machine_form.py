"""Expands the short form of a machine file, as people write it, to the full form of the data model.

In the short form, zeros are left out, drives are named from the library, and numbers are texts with units.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from typing import Any, get_args

from pydantic import BaseModel

from daq.contracts.drive_library import LibraryDrive, library_drive
from daq.contracts.errors import SpecError
from daq.contracts.quantity import Quantity
from daq.contracts.toml_places import Path, Places
from daq.contracts.written_numbers import Units, converted, read_number

DEFAULT = "default"
"""Source of a number that the file leaves out."""
DOWN = [0.0, 0.0, -9.81]
TURN = {"value": 6.283185307179586, "unit": "rad"}


class SpelledOut:
    """The full data of a machine file.

    Attributes:
        data: as the data model requires. problems: unreadable entries, by path.
        elsewhere: parts that were copied from another place of the file, and that place.
    """

    def __init__(self, data: Mapping[str, Any], model: type[BaseModel], places: Places) -> None:
        self.problems: list[tuple[Path, str]] = []
        self.elsewhere: dict[Path, Path] = {}
        self._places = places
        self.data: Any = copy.deepcopy(dict(data))
        self._machine(self.data)
        self.data = self._numbers(self.data, [model], (), slides=False)

    def _machine(self, machine: dict[str, Any]) -> None:
        joints = [joint for joint in _list(machine.get("joints")) if isinstance(joint, dict)]
        machine.setdefault("version", 1)
        machine.setdefault("gravity", list(DOWN))
        if isinstance(machine.get("name"), str):
            machine.setdefault("title", machine["name"])
        if "joints" in machine:
            machine.setdefault("modelled_joints", list(range(1, len(joints) + 1)))
        self._take_over(joints)
        servos = [self._joint(joint, ("joints", k)) for k, joint in enumerate(joints)]
        controller = machine.get("controller", {"kind": "servo" if servos and all(servos) else "none"})
        controller = {"kind": controller} if isinstance(controller, str) else controller
        if isinstance(controller, dict):
            if controller.get("kind") == "servo":
                controller = self._servo(controller, servos)
            if controller.get("kind") in ("pid", "board_pid"):
                controller.setdefault("delay", _default(0.0, "s"))
            for name in ("gains", "velocity_gains"):
                if _is_row(controller.get(name)):
                    controller[name] = [list(controller[name])] * len(joints)
        machine["controller"] = controller

    def _take_over(self, joints: list[dict[str, Any]]) -> None:
        """Copies the parts of another joint to a joint that is `like` it, except those that it states itself."""
        for k, joint in enumerate(joints):
            if "like" not in joint:
                continue
            name = joint.pop("like")
            own = next((j for j, one in enumerate(joints[:k]) if one.get("name") == name), None)
            if own is None:
                named = ", ".join(str(one.get("name")) for one in joints[:k]) or "none"
                self.problems.append((("joints", k, "like"), f"found {name!r:.80}, must be a joint before: {named}"))
                self.elsewhere["joints", k, "drive"] = ("joints", k, "like")
            else:
                parts = {part: joints[own][part] for part in ("drive", "friction", "sensor") if part in joints[own]}
                for part in set(parts) - set(joint):
                    self.elsewhere["joints", k, part] = self.elsewhere.get(("joints", own, part), ("joints", own, part))
                joint.update(copy.deepcopy(parts | joint))

    def _joint(self, joint: dict[str, Any], path: Path) -> dict[str, Any] | None:
        """Adds the parts that a joint leaves out. Returns the library's data on its servo's controller."""
        slides = joint.setdefault("kind", "revolute") == "prismatic"
        servo = self._drive(joint, (*path, "drive"))
        geometry = joint.setdefault("geometry", {})
        if isinstance(geometry, dict):
            for name, unit in (("a", "m"), ("alpha", "rad"), ("d", "m"), ("theta", "rad")):
                geometry.setdefault(name, _default(0.0, unit, assumed=False))
        link = joint.get("link")
        if isinstance(link, dict):
            _fill_link(link)
        sensor = joint.get("sensor")
        if isinstance(sensor, str) and sensor.removesuffix("s").removesuffix(" bit").isdecimal():
            sensor = joint["sensor"] = {"bits": int(sensor.split()[0])}
        if isinstance(sensor, dict) and not slides:
            sensor.setdefault("range", TURN | {"source": DEFAULT})
            whole = self._number(sensor["range"], ("rad",), (*path, "sensor", "range"))
            if isinstance(whole, dict) and isinstance(whole.get("value"), float):
                sensor.setdefault("at_zero", _default(-whole["value"] / 2, "rad"))
        return servo

    def _drive(self, joint: dict[str, Any], path: Path) -> dict[str, Any] | None:
        drive = joint.get("drive")
        drive = {"model": drive} if isinstance(drive, str) else drive
        if not isinstance(drive, dict):
            return None
        servo = None
        name = drive.pop("model", None)
        if name is not None:
            try:
                known = library_drive(str(name))
            except SpecError as error:
                self.problems.append((path, str(error)))
                joint["drive"] = None
                return None
            servo = self._at_supply(known, drive.get("supply_limit"), (*path, "supply_limit"))
            drive = {**known.drive, **drive}
            own = joint.get("friction", {})
            joint["friction"] = {**known.friction, **own} if isinstance(own, dict) else own
            if known.sensor:
                joint.setdefault("sensor", dict(known.sensor))
        joint["drive"] = drive
        if "kind" not in drive:
            for field, kind in (("gain", "gain"), ("resistance", "dc_motor"), ("torque_constant", "current")):
                if field in drive:
                    drive.setdefault("kind", kind)
        if drive.get("kind") in ("dc_motor", "current"):
            drive.setdefault("gear_ratio", _default(1.0, "1", assumed=False))
        if drive.get("kind") == "dc_motor":
            self._fill_motor(drive, path)
        return servo

    def _at_supply(self, known: LibraryDrive, supply: Any, path: Path) -> dict[str, Any]:
        """Returns the library's data on a servo's controller, whose volts are shares of the supply."""
        servo = dict(known.servo)
        if supply is None or not servo:
            return servo
        own, usual = self._number(supply, ("V",), path), self._number(known.drive["supply_limit"], ("V",), path)
        if isinstance(own, dict) and isinstance(usual, dict):
            ratio = own["value"] / usual["value"]
            servo["per_gain"] = [ratio * gain for gain in servo["per_gain"]]
            for name in ("output_limit", "drive_resolution"):
                if name in servo:
                    servo[name] = self._scaled(servo[name], ratio, f"of a supply of {own['value']:g} V")
        return servo

    def _scaled(self, number: Any, factor: float, source: str) -> Any:
        whole = self._number(number, ("V",), ("controller",))
        return number if not isinstance(whole, dict) else {**whole, "value": factor * whole["value"], "source": source}

    def _fill_motor(self, motor: dict[str, Any], path: Path) -> None:
        """Adds defaults, and values that follow from a motor's stated numbers."""
        for name, unit, other in (
            ("torque_constant", "N·m/A", "back_emf_constant"),
            ("back_emf_constant", "V·s/rad", "torque_constant"),
        ):
            if name not in motor and other in motor:
                stated = self._number(motor[other], ("N·m/A", "V·s/rad"), (*path, other))
                if isinstance(stated, dict):
                    motor[name] = stated | {"unit": unit, "source": f"as the {other.replace('_', ' ')}"}
        motor.setdefault("rotor_inertia", _default(0.0, "kg·m²"))
        motor.setdefault("inductance", _default(0.0, "H"))
        motor.setdefault("amplifier_gain", _default(1.0, "1", assumed=False))
        if "supply_limit" in motor:
            motor.setdefault("dac_full_scale", motor["supply_limit"])

    def _servo(self, stated: Mapping[str, Any], servos: list[dict[str, Any] | None]) -> dict[str, Any]:
        """Returns the sampled PID of the servos' firmware, from gains as in the servos' registers."""
        unread = {path[1] for path, _ in self.problems if path[2:] == ("drive",)}
        without = [k + 1 for k, servo in enumerate(servos) if not servo and k not in unread]
        if without:
            where = ", ".join(map(str, without))
            self.problems.append((("controller",), f"kind is 'servo', but no position servo drives joint {where}"))
        known = [servo for servo in servos if servo]
        own = {k: v for k, v in stated.items() if k not in ("kind", "gains", "pwm_limit")}
        gains = stated.get("gains")
        rows = [gains] * len(known) if _is_row(gains) else gains or [servo["gains"] for servo in known]
        found: dict[str, Any] = {"kind": "pid", "gains": rows}
        if isinstance(rows, list) and len(rows) == len(known) and all(map(_is_row, rows)):
            scales = [servo["per_gain"] for servo in known]
            found["gains"] = [
                [float(f"{g * s:.10g}") for g, s in zip(r, scale, strict=False)]
                for r, scale in zip(rows, scales, strict=True)
            ]
        for name in ("period", "delay"):
            if known and name in known[0]:
                found[name] = known[0][name]
        for name in ("output_limit", "drive_resolution", "set_point_resolution", "dead_band", "gain_error"):
            stated_of = [servo.get(name) for servo in known]
            if all(stated_of) and stated_of:
                found[name] = stated_of[0] if stated_of.count(stated_of[0]) == len(known) else stated_of
        if "pwm_limit" in stated and "output_limit" in found:
            found["output_limit"] = self._share(found["output_limit"], stated["pwm_limit"])
        return found | own

    def _share(self, limit: Any, stated: Any) -> Any:
        if isinstance(limit, list):
            return [self._share(one, stated) for one in limit]
        share = self._number(stated, ("1",), ("controller", "pwm_limit"))
        return self._scaled(limit, share["value"], f"PWM limit of {stated}") if isinstance(share, dict) else limit

    def _numbers(self, value: Any, notes: list[Any], path: Path, *, slides: bool) -> Any:
        """Returns the value with every number in its full form. notes: its type, and the type's marks."""
        models, units = _kinds(notes)
        allowed = next((u.sliding if slides and u.sliding else u.allowed for u in units), ())
        if isinstance(value, list):
            return [self._numbers(one, notes, (*path, k), slides=slides) for k, one in enumerate(value)]
        if isinstance(value, bool) or not isinstance(value, str | int | float | dict):
            return value
        if Quantity in models and not (isinstance(value, dict) and "value" not in value):
            return self._number(value, allowed, path)
        if not isinstance(value, dict):
            number = self._number(value, allowed, path) if allowed and isinstance(value, str) else value
            return number["value"] if isinstance(number, dict) else number
        fits = [m for m in models if _fits(m, value)]
        found = {}
        for name, inner in value.items():
            field = next((m.model_fields[name] for m in fits if name in m.model_fields), None)
            own = slides or value.get("kind") == "prismatic"
            notes = [] if field is None else [field.annotation, *field.metadata]
            found[name] = self._numbers(inner, notes, (*path, name), slides=own) if notes else inner
        return found

    def _number(self, value: Any, allowed: tuple[str, ...], path: Path) -> Any:
        """Returns the fields of a number; an unreadable value is returned unchanged and noted as a problem."""
        written = self.elsewhere.get(path[:3])
        comment = self._places.comment(path if written is None else (*written, *path[3:]))
        if isinstance(value, dict):
            try:
                whole = value if "source" in value or not comment else {**value, "source": comment}
                return converted(whole, allowed)
            except (ValueError, TypeError, KeyError):
                return value  # the data model reports the error, or gives the unit of its joint
        try:
            return read_number(value, comment, allowed)
        except ValueError as error:
            if written is None:
                self.problems.append((path, str(error)))
            return None


def _kinds(notes: list[Any]) -> tuple[list[type[BaseModel]], list[Units]]:
    """Returns the data models that a value may have, and its units."""
    models, units = [], []
    waiting = list(notes)
    while waiting:
        note = waiting.pop(0)
        note = getattr(getattr(note, "func", None), "units", note)
        if isinstance(note, Units):
            units.append(note)
        elif isinstance(note, type) and issubclass(note, BaseModel):
            models.append(note)
        else:
            waiting += get_args(note)
    return models, units


def _fits(model: type[BaseModel], table: Mapping[str, Any]) -> bool:
    """Whether a table may belong to a model: if both state a kind, the kinds agree."""
    for name in ("kind", "shape"):
        field = model.model_fields.get(name)
        if field is not None and name in table and len(get_args(field.annotation)) == 1:
            return table[name] in get_args(field.annotation)
    return True


def _fill_link(link: dict[str, Any]) -> None:
    """Adds a link's shape, as its numbers imply, and zeros."""
    if "shape" not in link:
        body = "centre" in link or "inertia" in link
        link["shape"] = "cylinder" if "radius" in link else "body" if body else "rod"
    if link["shape"] == "body":
        link.setdefault("centre", [_default(0.0, "m") for _ in range(3)])
        stated = link.setdefault("inertia", [_default(0.0, "kg·m²") for _ in range(3)])
        if isinstance(stated, list) and len(stated) == 3:
            link["inertia"] = [*stated, *(_default(0.0, "kg·m²", assumed=False) for _ in range(3))]


def _default(value: float, unit: str, *, assumed: bool = True) -> dict[str, Any]:
    number = {"value": value, "unit": unit, "source": DEFAULT}
    return number | {"assumed": True} if assumed else number


def is_machine_file(data: Mapping[str, Any]) -> bool:
    """Whether the data of a TOML file are meant as a machine: only there, joints are tables."""
    return any(isinstance(joint, dict) for joint in _list(data.get("joints")))


def _is_row(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(isinstance(one, int | float) for one in value)


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def defaults_of(machine: BaseModel) -> Iterator[str]:
    """Yields the places of assumed numbers that a file leaves out."""
    waiting: list[tuple[str, Any]] = [("", machine)]
    while waiting:
        place, part = waiting.pop(0)
        if isinstance(part, Quantity):
            if part.source == DEFAULT and part.assumed:
                yield f"{place.lstrip('.')} {part.value:g} {part.unit}"
        elif isinstance(part, BaseModel):
            waiting += [(f"{place}.{name}", getattr(part, name)) for name in type(part).model_fields]
        elif isinstance(part, tuple):
            waiting += [(f"{place}.{k + 1}", one) for k, one in enumerate(part)]
