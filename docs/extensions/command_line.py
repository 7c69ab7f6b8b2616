"""The page of all commands and options, from typer itself."""

from __future__ import annotations

import re
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from importlib import import_module
from typing import Any

import typer.main

from daq_cli.app.command import app
from daq_cli.app.subcommands import subcommands

BEGIN = """# Every option

Made from the command line itself. [Command line](../command-line.md) shows every command with an example, and
the exit codes. `daq COMMAND --help` prints the same. Every command takes `--help`.
"""
OWN_HELP = {"mock": (("mock_controller",), ("mock_controller.servos",))}
"""Commands that hand what they are given to other programs, whose help is shown."""


def page() -> str:
    """The page as it should be."""
    whole = typer.main.get_command(app)
    parts = [BEGIN, "## Before the command\n", *_parameters(whole, "daq")]
    for name, known in subcommands().items():
        command = typer.main.get_command(import_module(known.module).app)
        parts.append(f"## daq {name}\n")
        parts += _command(command, f"daq {name}", 3)
        for (program,) in OWN_HELP.get(name, ()):
            shown = subprocess.run(
                [sys.executable, "-m", program, "--help"], check=True, capture_output=True, text=True, timeout=60
            )
            parts.append(f"```text\n{shown.stdout.rstrip()}\n```\n")
    return "\n".join(parts)


def _command(command: Any, words: str, level: int) -> Iterator[str]:
    yield f"{plain(textwrap.dedent(command.help or ''))}\n"
    inner = getattr(command, "commands", {})
    if not inner or command.invoke_without_command:
        yield f"```text\n{_usage(command, words)}\n```\n"
        yield from _parameters(command, words)
    for name, sub in inner.items():
        yield f"{'#' * level} {words} {name}\n"
        yield from _command(sub, f"{words} {name}", level + 1)


def _usage(command: Any, words: str) -> str:
    context = command.make_context(words, [], resilient_parsing=True)
    return " ".join([words, *command.collect_usage_pieces(context)])


def _parameters(command: Any, words: str) -> Iterator[str]:
    """A list of what the command takes, as its help shows it."""
    context = command.make_context(words, [], resilient_parsing=True)
    for parameter in command.params:
        record = parameter.get_help_record(context)
        if record is not None and "--help" not in parameter.opts:
            shown, text = record
            yield f"`{shown.strip()}`\n: {plain(text) or 'needed'}\n"


def plain(text: str) -> str:
    """Text in which nothing but code is marked up."""
    parts = re.split(r"(`[^`]+`)", text)
    return "".join(part if part.startswith("`") else re.sub(r"([\\*_<>\[\]#|$])", r"\\\1", part) for part in parts)
