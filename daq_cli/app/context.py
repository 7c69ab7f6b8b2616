"""Context of every subcommand: the settings, the port, the service, and printing of results."""

from __future__ import annotations

import json
import re
import shutil
import sys
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daq_cli.app.printable import printable as printable  # noqa: PLC0414  # re-exported

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from daq.config.settings import Settings
    from daq.contracts.trace_limits import TraceLimits

JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON, for programs.")]
YesOption = Annotated[bool, typer.Option("--yes", help="Consent to moving a real arm without being asked.")]


LABEL = 7
"""Widest indentation (columns) of text after a label."""
_TIED = "\xa0"
"""A space at which no line ends."""
_BEFORE_UNIT = re.compile(r"(?<=[\d±]) (?=\S)|(?<=\S) (?=±)")


@cache
def console() -> Console:
    """Returns the console for people: progress, questions and remarks on standard error. Results go to standard output.

    Text is printed literally: square brackets are not markup.
    """
    from rich.console import Console

    return Console(stderr=True, highlight=False, soft_wrap=True, markup=False)


def print_table(table: Table) -> None:
    """Prints a table on standard output, as wide as the terminal; brackets in its text are not markup."""
    from rich.console import Console

    from daq_cli.app.narrow_table import print_fitting

    print_fitting(table, Console(highlight=False, markup=False))


def print_prose(text: str, label: str = "", *, err: bool = False) -> None:
    """Prints sentences on standard output, wrapped to the terminal's width.

    Args:
        label: begins the first line; later lines are indented to its width. Numbers are not separated from their units.
        err: prints on standard error.
    """
    width = shutil.get_terminal_size().columns
    whole = _BEFORE_UNIT.sub(_TIED, printable(text))
    indent = " " * min(len(label), LABEL)
    lines = wrap(label + whole, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
    print("\n".join(lines).replace(_TIED, " "), file=sys.stderr if err else sys.stdout)


@dataclass
class Invocation:
    """One call of `daq`: the options before the subcommand. Settings are read on first use."""

    config_file: Path | None = None
    port_option: str | None = None
    server: str | None = None
    """URL of the service that owns the robot; None for a local robot."""
    server_by_default: bool = False
    """Whether `server` comes from DAQ_SERVER and not from the command line."""
    robot_option: str | None = None
    """Name of one of several robots."""
    _mock_announced: bool = field(default=False, repr=False)

    @property
    def stops_here(self) -> bool:
        """Whether a stop includes robots that this computer moves: always, unless the command line names a service."""
        return self.server is None or self.server_by_default

    @cached_property
    def configuration(self) -> Settings:
        """The whole configuration with all robots. Raises SpecError."""
        from daq.config.settings import load_settings

        return load_settings(self.config_file)[0]

    @cached_property
    def settings(self) -> Settings:
        """The settings of the robot named on the command line, or of the only one. Raises SpecError."""
        return self.configuration.of_robot(self.robot_option)

    @property
    def port(self) -> str:
        """The port of the command line or the configuration; by default the mock, which is announced once."""
        if self.port_option is not None:
            return self.port_option
        if self.settings.robot.port is None and not self._mock_announced:
            self._mock_announced = True
            console().print("No robot is configured: using the mock controller (no arm moves). See `daq config show`.")
        return self.settings.port

    @property
    def memory_map_text(self) -> str | None:
        """Text of the configured memory map; None for the packaged one. Raises SpecError."""
        path = self.settings.robot.memory_map
        if path is None:
            return None
        from daq.config.robot_files import load_memory_map
        from daq.contracts.documents import read_text

        load_memory_map(path)
        return read_text(path, f"memory map {path}")

    @property
    def trace_folder(self) -> Path:
        """The configured folder of traces. For a service's robot, it is that of a local robot with the same name, if
        any."""
        if self.server is not None and self.robot_option not in self.configuration.names:
            return self.configuration.traces.folder
        return self.settings.traces.folder

    @property
    def trace_limits(self) -> TraceLimits:
        """Limits for reading traces."""
        return self.configuration.traces.limits


def invocation(context: typer.Context) -> Invocation:
    """Returns this call's invocation, made from the global options."""
    found = context.find_object(Invocation)
    assert found is not None
    return found


def print_json(data: Any) -> None:
    """Prints data on standard output as one JSON document."""
    text = json.dumps(data, indent=2, ensure_ascii=False, default=str)
    # File names that are not UTF-8 contain surrogates in Python; JSON's escapes preserve them.
    sys.stdout.write(text.encode("utf-8", "backslashreplace").decode() + "\n")
