"""The page of all fields of a machine file, from its schema."""

from __future__ import annotations

import ast
import inspect
import types
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from daq.contracts import machine
from daq.contracts.quantity import Quantity
from daq.contracts.written_numbers import Units

PARTS: tuple[type[BaseModel], ...] = (
    machine.Machine,
    machine.Joint,
    machine.Geometry,
    machine.Cylinder,
    machine.Rod,
    machine.Body,
    machine.DcMotor,
    machine.CurrentDrive,
    machine.PlainGain,
    machine.Friction,
    machine.Sensor,
    machine.SampledPid,
    machine.BoardPid,
    machine.NoController,
)
MOST_UNITS = 3
"""Most units that the column lists; the field's own text tells more of them."""
BEGIN = f"""# The machine file, field by field

Made from the schema, `daq/contracts/machine.py`. [Your own machine](own-machine.md) shows how to write such a file.

A **number** is a text, `"0.8 ± 0.08 kg"`, and the comment behind it is its source. It may have bounds: `[0 to 2]`.
Other units are converted to those of the column below. In full, it is a table of `value`, `unit`, `source`,
`assumed` (a guess), `low`, `high` and `deviation`.

Behind ± stands the standard deviation expected between the file and the machine.
A number with a deviation is a tolerance: fits and diagnoses may move it, at a price.
Deviations can be stated of {machine.DEVIATIONS_ARE_USED_OF}.
For any other number of a modelled joint or of the controller they are an error: no method would use them.

A torque constant, resistance, gain or gear ratio sets the scale of all torques, which motion alone does not show. A
diagnosis names such a number if it is far off; a fit moves it only if you name it.

Only time limits the number of joints: a step of the simulation grows with its square, a probe of every effect on every
joint with its cube. CSV columns are numbered up to 99; the MA2000's board has six.
"""


def page() -> str:
    """The page as it should be."""
    told = _told()
    return "\n".join([BEGIN, *(_section(part, told) for part in PARTS)])


def _section(part: type[BaseModel], told: dict[tuple[str, str], str]) -> str:
    kind = part.model_fields.get("kind", part.model_fields.get("shape"))
    names = get_args(kind.annotation) if kind is not None else ()
    own = f" (`{names[0]}`)" if len(names) == 1 else ""
    text = " ".join((inspect.getdoc(part) or "").split())
    rows = [
        f"| `{name}` | {_unit(field)} | {_default(field)} | {told.get((part.__name__, name), '')} |"
        for name, field in part.model_fields.items()
        if not (own and name in ("kind", "shape"))
    ]
    table = ["| field | unit or value | default | meaning |", "|---|---|---|---|", *rows] if rows else []
    return "\n".join([f"## {part.__name__}{own}", "", text, *([""] if rows else []), *table, ""])


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "needed"
    if field.default in (None, ()) or isinstance(field.default, BaseModel):
        return "none"
    return f"`{field.default!r}`".replace("'", '"')


def _unit(field: FieldInfo) -> str:
    return _name(Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation)


def _name(kind: Any) -> str:
    """The unit of a number, or what a field may be."""
    origin, inside = get_origin(kind), get_args(kind)
    if origin is Annotated:
        marks = [getattr(getattr(note, "func", None), "units", note) for note in inside[1:]]
        units = [list(dict.fromkeys(u.allowed + u.sliding)) for u in marks if isinstance(u, Units)]
        return " or ".join(units[0]) if units and len(units[0]) <= MOST_UNITS else _name(inside[0])
    if origin is Literal:
        return ", ".join(f"`{value!r}`".replace("'", '"') for value in inside)  # as TOML writes them
    if origin in (Union, types.UnionType):
        return " or ".join(dict.fromkeys(_name(one) for one in inside if one is not type(None)))
    if origin is tuple:
        each = list(dict.fromkeys(_name(one) for one in inside if one is not Ellipsis))
        return f"list of {' and '.join(each)}"
    own = kind.__name__
    return {"str": "text", "int": "integer", "FiniteFloat": "float", Quantity.__name__: "number"}.get(own, own)


def _told() -> dict[tuple[str, str], str]:
    """Text under each field of the schema's source, by class and field."""
    found = {}
    for part in ast.parse(inspect.getsource(machine)).body:
        if isinstance(part, ast.ClassDef):
            for field, text in zip(part.body, part.body[1:], strict=False):
                named = isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
                said = isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant)
                if named and said:
                    found[part.name, field.target.id] = " ".join(str(text.value.value).split())
    return found
