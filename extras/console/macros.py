"""Macros: lines with values in place of parameters, read in the console's language. Pure."""

from __future__ import annotations

import shlex
import tomllib
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine
from extras.console.language import read_words
from extras.console.messages import PLACE, ConsoleOrder, Macro, MacroParameter, MacroReading, Value
from firmware_protocol.invalid import first_invalid

EXAMPLES = Path(__file__).with_name("examples.toml")
TYPES: dict[str, Any] = {"number": float, "integer": int, "text": str}


@cache
def examples() -> tuple[Macro, ...]:
    """Returns the macros that the package brings as a start."""
    found = tomllib.loads(EXAMPLES.read_text("utf-8"))["macro"]
    return tuple(Macro.model_validate(one) for one in found)


def form_of(macro: Macro) -> type[BaseModel]:
    """Returns the model of a macro's values: its JSON Schema makes the form, and it checks what comes back."""
    fields: dict[str, Any] = {one.name: (_type(one), _field(one)) for one in macro.parameters}
    return create_model(macro.name, __config__=ConfigDict(extra="forbid", validate_default=True), **fields)


def expand(macro: Macro, values: dict[str, Value], machine: Machine) -> MacroReading:
    """Returns the lines of a macro with these values, and what they ask for. Raises a one-line SpecError.

    A value fills its place within one word, so it cannot add an option or a command.
    """
    form = form_of(macro)
    try:
        filled = form.model_validate(values).model_dump()
    except ValidationError as error:
        first = first_invalid(error)
        raise SpecError(f"{macro.name}: {'.'.join(map(str, first.place))}: {first.message}") from None
    texts = {name: f"{value:g}" if isinstance(value, float) else str(value) for name, value in filled.items()}
    lines, orders = [], []
    for number, line in enumerate(macro.lines, 1):
        where = f"{macro.name}, line {number}"
        words = [PLACE.sub(lambda place: texts[place[1]], word) for word in _split(line, where)]
        lines.append(shlex.join(words))
        orders.append(_order(words, where, f"{macro.name}.{number}", machine))
    return MacroReading(parameters=form.model_json_schema(), lines=tuple(lines), orders=tuple(orders))


def _order(words: list[str], where: str, name: str, machine: Machine) -> ConsoleOrder:
    alone = f"{where}: a macro has lines of `run` alone, without --dry-run"
    if words[:1] != ["run"]:
        raise SpecError(f"{alone}, not {' '.join(words)[:40]!r}")
    try:
        order = read_words(words, machine)
    except SpecError as error:
        raise SpecError(f"{where}: {error}") from None
    if order.spec is None or order.dry_run:
        raise SpecError(alone)
    named = order.spec if order.spec.name else order.spec.model_copy(update={"name": name})
    return order.model_copy(update={"spec": named})


def _split(line: str, where: str) -> list[str]:
    try:
        words = shlex.split(line)
    except ValueError as error:
        raise SpecError(f"{where}: {str(error).lower()}") from None
    return words[1:] if words[:1] == ["daq"] else words


def _type(one: MacroParameter) -> Any:
    if one.type != "text":
        return TYPES[one.type]
    return Literal[one.choices] if one.choices else Annotated[str, Field(max_length=100)]


def _field(one: MacroParameter) -> Any:
    bounds: dict[str, Any] = {} if one.type == "text" else {"ge": one.minimum, "le": one.maximum}
    default = int(one.default) if one.type == "integer" and isinstance(one.default, float) else one.default
    extra: dict[str, Any] | None = {"unit": one.unit} if one.unit else None
    return Field(default=default, title=one.title or one.name.replace("_", " "), json_schema_extra=extra, **bounds)
