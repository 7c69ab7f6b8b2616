"""Messages of the console, the macros and the calendar."""

from __future__ import annotations

import re
from typing import Annotated, Literal, Self

from pydantic import AwareDatetime, Field, FiniteFloat, model_validator

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.service.base import UserWire, Wire

NAME = r"^[a-z0-9][a-z0-9-]{0,62}$"
PLACE = re.compile(r"\{([a-z][a-z0-9_]*)\}")
"""A parameter's place in a line: `{amplitude}`."""
Line = Annotated[str, Field(min_length=1, max_length=2000)]
Value = bool | int | float | str
"""An option's value as typed, or a parameter's."""


class ConsoleOption(Wire):
    """An option or an argument of a command."""

    name: str
    flags: tuple[str, ...]
    """Empty for an argument."""
    takes_value: bool
    help: str
    default: str
    choices: tuple[str, ...]
    """Usual values; others are allowed."""


class ConsoleCommand(Wire):
    """A command of the console, such as `run ramp`."""

    words: tuple[str, ...]
    help: str
    options: tuple[ConsoleOption, ...]


class ConsoleLine(UserWire):
    """A line, without `daq` at its beginning."""

    line: Line


class ConsoleOrder(Wire):
    """What a line asks for. The client carries it out through the routes of the service."""

    words: tuple[str, ...]
    """The command."""
    values: dict[str, Value | None]
    """Its options by name."""
    spec: ExperimentSpec | None = None
    """The experiment of a `run`."""
    cron: str | None = None
    """When it is repeated; None for once."""
    rule: str = ""
    """The same in words."""
    next: AwareDatetime | None = None
    """The first run, if it were planned now."""
    dry_run: bool = False


class MacroParameter(UserWire):
    """A parameter of a macro, with the type and the bounds that its form has."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,31}$")]
    title: Annotated[str, Field(max_length=60)] = ""
    unit: Annotated[str, Field(max_length=20)] = ""
    """Unit that the lines expect, for people."""
    type: Literal["number", "integer", "text"] = "number"
    default: FiniteFloat | Annotated[str, Field(max_length=100)]
    minimum: FiniteFloat | None = None
    maximum: FiniteFloat | None = None
    choices: Annotated[tuple[Annotated[str, Field(max_length=100)], ...], Field(max_length=50)] = ()
    """Allowed values of a text; empty allows all."""


class Macro(UserWire):
    """A named sequence of experiments: lines of `run`, in which `{name}` stands for the value of a parameter."""

    name: Annotated[str, Field(pattern=NAME)]
    description: Annotated[str, Field(max_length=300)] = ""
    parameters: Annotated[tuple[MacroParameter, ...], Field(max_length=20)] = ()
    lines: Annotated[tuple[Line, ...], Field(min_length=1, max_length=50)]

    @model_validator(mode="after")
    def _parameters_have_places(self) -> Self:
        names = [one.name for one in self.parameters]
        if len(set(names)) < len(names):
            raise ValueError("two parameters have one name")
        used = {name for line in self.lines for name in PLACE.findall(line)}
        if unknown := sorted(used - set(names)):
            raise ValueError(f"{{{unknown[0]}}} is no parameter; make it one, or write a value in its place")
        if idle := sorted(set(names) - used):
            raise ValueError(f"no line uses {{{idle[0]}}}; remove the parameter, or use it")
        return self


class KeptMacro(Wire):
    """A stored macro; a change states the `revision` that was edited."""

    macro: Macro
    revision: int
    changed: AwareDatetime
    changed_by: str


class Macros(Wire):
    """The stored macros, most recently changed first, and examples to begin with."""

    kept: tuple[KeptMacro, ...]
    examples: tuple[Macro, ...]


class MacroValues(UserWire):
    """Values of a macro's parameters; those left out have their defaults."""

    values: dict[str, Value] = {}


class MacroReading(Wire):
    """A macro with values in place of its parameters."""

    parameters: dict[str, object]
    """JSON Schema of the parameters, for a form."""
    lines: tuple[str, ...]
    orders: tuple[ConsoleOrder, ...]


class WrittenLine(Wire):
    """The line that asks for an experiment."""

    line: str


class PlannedRun(Wire):
    """An experiment that will be submitted, or begin, at a time. Whether the arm then moves depends on the queue."""

    at: AwareDatetime
    name: str
    seconds: float
    """Duration of its record, at least."""
    joints: tuple[int, ...]
    by: str
    spec: ExperimentSpec
    schedule: str | None = None
    experiment: str | None = None
    """The waiting experiment, if it is one."""
