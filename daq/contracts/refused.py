"""Formats pydantic's errors about a file: the field, what was found, what is allowed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from difflib import get_close_matches
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

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
"""What is allowed, by the first word of pydantic's name of a type error."""


def refused_words(error: ValidationError, model: type[BaseModel], whole: str) -> str:
    """Returns the text about the first invalid value in data read as `model`: its place (indices from 1), and what is
    allowed there.

    whole: used instead of the place if all of the data are rejected.
    """
    return next(refusals(error, model, whole))[1]


def refusals(error: ValidationError, model: type[BaseModel], whole: str) -> Iterator[tuple[tuple[int | str, ...], str]]:
    """Yields every invalid value: its path in the data, and the text of `refused_words`."""
    for found in _told(error.errors()):
        unknown = found.kind == "extra_forbidden"
        place, path, models = _walk(found.place[:-1] if unknown else found.place, model)
        if unknown:
            name = str(found.place[-1])
            fields = list(dict.fromkeys(field for m in models for field in m.model_fields))
            yield (*path, name), f"{'.'.join((*place, name))}: {_unknown_field(name, fields)}"
        else:
            yield tuple(path), f"{'.'.join(place) or whole}: {_words(found)}"


def _told(errors: Sequence[ErrorDetails]) -> Iterator[Invalid]:
    """Yields one error per invalid value. If a value may have several types, it is the error of the best-fitting type.
    A misspelt field is reported instead of the field that is therefore missing."""
    told: set[tuple[int | str, ...]] = set()
    for error in errors:
        place = error["loc"]
        beside = [e for e in errors if e["type"] == "extra_forbidden" and e["loc"][:-1] == place[:-1]]
        inside = [e for e in errors if len(e["loc"]) > len(place) and e["loc"][: len(place)] == place]
        if (error["type"] == "missing" and beside) or (
            error["type"] == "too_short" and inside
        ):  # counts the valid ones
            continue
        kind = next((k for k, part in enumerate(place) if _is_kind(part)), None)
        key = place if kind is None else place[:kind]
        if key in told:
            continue
        told.add(key)
        alike = [error] if kind is None else [e for e in errors if e["loc"][:kind] == key]
        yield invalid_of(max(alike, key=lambda e: len(e["loc"])))


def _is_kind(part: int | str) -> bool:
    """Whether a part of a place is pydantic's name for one of several types of a value."""
    return isinstance(part, str) and ("[" in part or part == "Quantity")


def _walk(
    place: Sequence[int | str], model: type[BaseModel]
) -> tuple[list[str], list[int | str], list[type[BaseModel]]]:
    """Returns a place in words and as a path, without the names of possible types; and the models of the table
    there."""
    named: list[str] = []
    path: list[int | str] = []
    models: list[type[BaseModel]] = [model]
    for part in place:
        if isinstance(part, int):
            named.append(str(part + 1))
            path.append(part)
        elif _is_kind(part):
            continue
        elif narrowed := _of_kind(models, part):
            models = narrowed
        else:
            named.append(part)
            path.append(part)
            models = [inner for m in models if part in m.model_fields for inner in _models_at(m, part)]
    return named, path, models


def _words(first: Invalid) -> str:
    """Returns what was found, and what is allowed."""
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


def nearest(name: str, known: Iterable[str], most: int = 3) -> str:
    """Returns a clause that asks for the known names most like this one; empty without any."""
    names = list(known)
    near = get_close_matches(name, names, n=most) or [one for one in names if name and name.lower() in one][:most]
    return f"; did you mean {' or '.join(map(repr, near))}?" if near else ""


def _unknown_field(name: str, fields: Sequence[str]) -> str:
    return f"there is no such field here{nearest(name, fields, 1)} (there are {', '.join(fields)})"


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
"""Messages by pydantic's error type."""


def _of_kind(models: Sequence[type[BaseModel]], tag: str) -> list[type[BaseModel]]:
    """Returns the models with this tag; empty if the part of the place is a field."""
    if len(models) < 2:
        return []
    return [m for m in models if any(_is_tag(field.annotation, tag) for field in m.model_fields.values())]


def _is_tag(annotation: Any, tag: str) -> bool:
    return get_origin(annotation) is Literal and get_args(annotation) == (tag,)


def _models_at(model: type[BaseModel], field: str) -> Iterator[type[BaseModel]]:
    """Yields the data models that a field's value may have."""
    waiting: list[Any] = [model.model_fields[field].annotation]
    while waiting:
        annotation = waiting.pop(0)
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            yield annotation
        waiting += get_args(annotation)
