"""Reads lines of the command line's language. The commands are those of `daq`, with its own parser and help.

Allowed are commands that the service carries out through its routes. Options about this computer (`--folder`), about
printing (`--json`) and about consent (`--yes`: the page asks) are left out.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from datetime import datetime
from functools import cache
from importlib import import_module
from typing import Any

import typer
import typer.main
from typer.exceptions import TyperException

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import Machine
from daq_cli.app.completion import JOINTS, PRESETS
from daq_cli.app.subcommands import CORE
from daq_cli.commands.run import KINDS, spec_of
from daq_cli.robot.experiment import cron_of
from extras.console.messages import ConsoleCommand, ConsoleOption, ConsoleOrder
from server.experiments.schedule import Plan, first, in_words, zone_here

ALLOWED = {
    "run": (*KINDS, "preset", "diagnostic"),
    "stop": (),
    "reset": (),
    "status": (),
    "gains": ("show",),
    "queue": ("show", "pause", "resume", "schedules", "unschedule"),
    "traces": ("ls",),
}
"""Commands, and their subcommands if they have any."""
LEFT_OUT = frozenset(["folder", "place", "json", "yes", "operator", "robot", "here"])
"""Options that a page has no use for. `here` is in the arm's panel, beside the posture that it takes."""
CHOICES = {"joints": JOINTS, "record": JOINTS, ("preset", "name"): PRESETS}


@cache
def commands() -> tuple[ConsoleCommand, ...]:
    """Returns the commands with their options, for completion and help."""
    return tuple(_described(words, command) for words, command in _leaves())


def read(line: str, machine: Machine) -> ConsoleOrder:
    """Returns what a line asks for. Raises a one-line SpecError."""
    try:
        words = shlex.split(line)
    except ValueError as error:
        raise SpecError(f"{line!r:.60}: {str(error).lower()}") from None
    return read_words(words[1:] if words[:1] == ["daq"] else words, machine)


def read_words(words: list[str], machine: Machine) -> ConsoleOrder:
    """Returns what the words of a line ask for. Raises a one-line SpecError."""
    known = dict(_leaves())
    found = next((key for key in (tuple(words[:2]), tuple(words[:1])) if key in known), None)
    if found is None:
        raise SpecError(_unknown(words))
    try:
        context = known[found].make_context(" ".join(found), words[len(found) :], help_option_names=[])
    except TyperException as error:
        text = error.format_message() if hasattr(error, "format_message") else str(error)
        raise SpecError(f"{' '.join(found)}: {text[:1].lower()}{text[1:]}") from None
    values: dict[str, Any] = context.params
    if found[0] != "run":
        return ConsoleOrder(words=found, values=values)
    return ConsoleOrder(
        words=found,
        values=values,
        spec=_spec(found[1], values, machine),
        cron=cron_of(values["daily"], values["cron"]),
        dry_run=values["dry_run"],
    )


def with_rule(order: ConsoleOrder, now: datetime) -> ConsoleOrder:
    """Returns an order with the rule in words and the first run that a schedule made `now` would have. Raises a 422
    for an expression that says no times."""
    if order.cron is None:
        return order
    plan = Plan(now, 0.0, None, order.cron, zone_here())
    return order.model_copy(update={"next": first(plan), "rule": in_words(plan)})


def _spec(kind: str, values: dict[str, Any], machine: Machine) -> ExperimentSpec:
    if kind in KINDS:
        return spec_of(KINDS[kind], {**values, "operator": None}, None, lambda: machine)
    from daq.trajectories.presets import preset

    return preset(values.get("name", "diagnostic")).spec


def _unknown(words: list[str]) -> str:
    if words[:1] and words[0] in ALLOWED:
        wrong = f", not {words[1][:40]!r}" if words[1:] else ""
        return f"{words[0]}: needs one of {', '.join(ALLOWED[words[0]])}{wrong}"
    if words and words[0] in CORE:
        return f"{words[0]}: not in the console; type it in a terminal. Here are {', '.join(ALLOWED)}, macro"
    return f"{' '.join(words)[:40]!r}: no such command; there are help, {', '.join(ALLOWED)}, macro"


@cache
def _leaves() -> tuple[tuple[tuple[str, ...], Any], ...]:
    return tuple(_made())


def _made() -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yields the allowed commands by their words, without the options that are left out."""
    for name, subs in ALLOWED.items():
        command: Any = typer.main.get_command(import_module(CORE[name].module).app)
        found: list[tuple[tuple[str, ...], Any]] = [((name, sub), command.commands[sub]) for sub in subs]
        for words, leaf in found or [((name,), command)]:
            leaf.params = [one for one in leaf.params if one.name not in LEFT_OUT]
            yield words, leaf


def _described(words: tuple[str, ...], command: Any) -> ConsoleCommand:
    line = command.short_help or (command.help or "").strip().partition("\n\n")[0].replace("\n", " ")
    options = tuple(_option(words, one) for one in command.params if not one.hidden)
    return ConsoleCommand(words=words, help=line, options=options)


def _option(words: tuple[str, ...], one: Any) -> ConsoleOption:
    is_argument = one.param_type_name == "argument"
    choices = CHOICES.get(one.name, CHOICES.get((words[-1], one.name), ()))
    return ConsoleOption(
        name=one.name,
        flags=() if is_argument else tuple(one.opts),
        takes_value=not getattr(one, "is_flag", False),
        help=one.help or "",
        default="" if one.default in (None, False) else str(one.default),
        choices=choices,
    )
