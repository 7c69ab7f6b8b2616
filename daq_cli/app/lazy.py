"""Imports subcommands on first use, so that `daq --help` starts fast."""

from __future__ import annotations

from importlib import import_module
from typing import Any, get_args

import typer.core
import typer.main

from daq.plugins import Group
from daq_cli.app.subcommands import subcommand, subcommands


class LazyGroup(typer.core.TyperGroup):
    """Lists subcommands with one line each; imports only the one that is called."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names in the table's order."""
        del ctx
        return list(subcommands())

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Returns an imported command; for all others, only name and help line."""
        found = super().get_command(ctx, cmd_name)
        if found is None and (known := subcommand(cmd_name)) is not None:
            return typer.core.TyperCommand(cmd_name, help=known.line)
        return found

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Writes the commands under their headings, each with its full help line."""
        del ctx
        known = subcommands().values()
        for group in get_args(Group):
            rows = [(command.name, command.line) for command in known if command.group == group]
            if rows:
                with formatter.section(group):
                    formatter.write_dl(rows)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Imports the command named in `args`."""
        if args and (known := subcommand(args[0])) is not None:
            command = typer.main.get_command(import_module(known.module).app)
            command.name = args[0]
            _without_rich(command)
            self.add_command(command, args[0])
        return super().resolve_command(ctx, args)


def _without_rich(command: Any) -> None:
    """Gives help the same layout on every level, without loading rich."""
    command.rich_markup_mode = None
    for sub in getattr(command, "commands", {}).values():
        _without_rich(sub)
