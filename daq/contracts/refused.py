"""What a data model refused in a file, in one plain line: the field, what was found, what is allowed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from difflib import get_close_matches
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ValidationError

from daq.contracts.documents import shown
from firmware_protocol.invalid import Invalid, invalid_of

_TYPES = {
    "bool": "true or false",
    "dict": "a table",
    "float": "a number",
    "int": "a whole number",
    "list": "a list",
    "model": "a table",
    "string": "text",
    "tuple": "a list",
}
"""What is allowed, by the first word of pydantic's name for a value of another type."""


def refused_words(error: ValidationError, model: type[BaseModel], whole: str) -> str:
    """The first refused value of data that were read as `model`: its place, indices from 1, and what is allowed there.

    whole: what is said in place of the place, where all of the data are refused.
    """
    first = _first(error)
    place, models = _walk(first.place[:-1] if first.kind == "extra_forbidden" else first.place, model)
    if first.kind == "extra_forbidden":
        name = str(first.place[-1])
        fields = list(dict.fromkeys(field for m in models for field in m.model_fields))
        return f"{'.'.join((*place, name))}: {_unknown_field(name, fields)}"
    return f"{'.'.join(place) or whole}: {_words(first)}"


def _first(error: ValidationError) -> Invalid:
    """The first refused value; of a value that may be of several kinds, the error of the kind that fits furthest. A
    field with a wrong name is told rather than the one that is therefore missing."""
    errors = error.errors()
    if errors[0]["type"] == "missing":
        beside = [e for e in errors if e["type"] == "extra_forbidden" and e["loc"][:-1] == errors[0]["loc"][:-1]]
        errors = [*beside, *errors]
    place = errors[0]["loc"]
    kind = next((k for k, part in enumerate(place) if _is_kind(part)), None)
    if kind is None:
        return invalid_of(errors[0])
    alike = [e for e in errors if e["loc"][:kind] == place[:kind]]
    return invalid_of(max(alike, key=lambda e: len(e["loc"])))


def _is_kind(part: int | str) -> bool:
    """Whether a part of a place is pydantic's name for one of several kinds that a value may be of."""
    return isinstance(part, str) and ("[" in part or part == "Quantity")


def _walk(place: Sequence[int | str], model: type[BaseModel]) -> tuple[list[str], list[type[BaseModel]]]:
    """A place as it stands in the file, without the kinds of which a value might have been; and the models of the table
    there."""
    named: list[str] = []
    models: list[type[BaseModel]] = [model]
    for part in place:
        if isinstance(part, int):
            named.append(str(part + 1))
        elif _is_kind(part):
            continue
        elif narrowed := _of_kind(models, part):
            models = narrowed
        else:
            named.append(part)
            models = [inner for m in models if part in m.model_fields for inner in _models_at(m, part)]
    return named, models


def _words(first: Invalid) -> str:
    """What was found, and what is allowed."""
    if first.kind in _WORDS:
        return _WORDS[first.kind](first)
    kind, _, rest = first.kind.partition("_")
    if kind in _TYPES and rest in ("type", "parsing", "from_float", "parsing_size", "attributes_type"):
        return f"found {_found(first.value)}, must be {_TYPES[kind]}"
    return first.message


def _found(value: object) -> str:
    if isinstance(value, dict):
        return "a table"
    return "a list" if isinstance(value, list | tuple) else shown(value)


def _unknown_field(name: str, fields: Sequence[str]) -> str:
    near = get_close_matches(name, fields, n=1)
    meant = f"; did you mean {near[0]!r}?" if near else ""
    return f"there is no such field here{meant} (there are {', '.join(fields)})"


def _length(first: Invalid) -> str:
    least, most = first.bounds.get("min_length"), first.bounds.get("max_length")
    wanted = f"at least {least}" if least is not None else f"at most {most}"
    return f"has {first.bounds.get('actual_length', len(first.value))} entries, must have {wanted}"


_WORDS: dict[str, Callable[[Invalid], str]] = {
    "finite_number": lambda e: f"found {_found(e.value)}, must be a finite number",
    "greater_than": lambda e: f"found {_found(e.value)}, must be above {e.bounds['gt']}",
    "greater_than_equal": lambda e: f"found {_found(e.value)}, must be at least {e.bounds['ge']}",
    "less_than": lambda e: f"found {_found(e.value)}, must be below {e.bounds['lt']}",
    "less_than_equal": lambda e: f"found {_found(e.value)}, must be at most {e.bounds['le']}",
    "literal_error": lambda e: f"found {_found(e.value)}, must be {e.bounds['expected']}",
    "missing": lambda _: "is missing",
    "string_pattern_mismatch": lambda e: f"found {_found(e.value)}, must match {e.bounds['pattern']}",
    "too_long": _length,
    "too_short": _length,
    "union_tag_invalid": lambda e: (
        f"{e.bounds['discriminator'].strip(chr(39))} is {shown(e.bounds['tag'])}, must be one of "
        f"{e.bounds['expected_tags']}"
    ),
    "union_tag_not_found": lambda e: f"its {e.bounds['discriminator'].strip(chr(39))} is missing",
}
"""By pydantic's name of the rule that is broken."""


def _of_kind(models: Sequence[type[BaseModel]], tag: str) -> list[type[BaseModel]]:
    """Those of several models that a tag stands for; none where the part of a place is a field."""
    if len(models) < 2:
        return []
    return [m for m in models if any(_is_tag(field.annotation, tag) for field in m.model_fields.values())]


def _is_tag(annotation: Any, tag: str) -> bool:
    return get_origin(annotation) is Literal and get_args(annotation) == (tag,)


def _models_at(model: type[BaseModel], field: str) -> Iterator[type[BaseModel]]:
    """The data models that the value of a field may be."""
    waiting: list[Any] = [model.model_fields[field].annotation]
    while waiting:
        annotation = waiting.pop(0)
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            yield annotation
        waiting += get_args(annotation)
