"""Plug-ins: what they can add, and how they are found.

A plug-in is an object `Plugin`, named by an entry point of the group `ma2000_daq.plugins`:

    [project.entry-points."ma2000_daq.plugins"]
    gripper = "gripper_plugin:PLUGIN"

The object is a description: names, one-line helps, and references like "module:object", which are imported on first
use. Its module need import nothing but this one, so `daq --help` stays fast. The core describes its own commands in the
same way. docs/plugins.md shows a complete plug-in.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

from daq.contracts.extras import Extra

GROUP = "ma2000_daq.plugins"
log = logging.getLogger(__name__)


Group = Literal["Run", "Look", "Model", "Service", "Set up"]
"""Headings of the help, in order."""


@dataclass(frozen=True)
class Command:
    """A subcommand of `daq`."""

    name: str
    line: str
    """Help, one line."""
    module: str
    """Module of the command: a Typer app named `app`."""
    about: Literal["robot", "computer", "service"] = "robot"
    """Subject of the command. `robot`: a robot, local or at a server. `computer`: this computer, so `--server` is
    refused. `service`: a whole service, so `--robot` is refused too."""
    needs: Extra = "robot"
    """The extra whose packages the command needs here."""
    group: Group = "Set up"
    """Its heading in the help."""


@dataclass(frozen=True)
class Name:
    """A name of the Python package `ma2000`."""

    name: str
    module: str
    needs: Extra | None = None
    """The extra whose packages it needs; none if a client has them."""


@dataclass(frozen=True)
class Importer:
    """Converts recordings of other programs to traces, for `daq traces import`."""

    what: str
    """Text about its input: "the joint states in a bag"."""
    claims: str
    """"module:function" with the arguments path and its first 16 bytes: whether it can read the file."""
    read: str
    """"module:function" with the arguments path, `TraceLimits` and `daq.contracts.import_choice.Choice`: returns a
    `Trace`."""


@dataclass(frozen=True)
class Plugin:
    """Everything that a plug-in adds."""

    commands: tuple[Command, ...] = ()
    names: tuple[Name, ...] = ()
    importers: tuple[Importer, ...] = ()
    dialects: Mapping[str, str] = field(default_factory=dict)
    """Line protocols by their name in port URLs. "module:function" gets the joints' IDs on the bus and returns a
    `firmware_protocol.dialect.LinkDialect`."""
    drivers: Mapping[str, str] = field(default_factory=dict)
    """Python drivers of robots by the scheme of their URLs. "module:function" gets what follows the scheme and the
    URL's options (a dict of texts), and returns a `daq.contracts.robot_driver.RobotDriver`."""
    settings: Mapping[str, str] = field(default_factory=dict)
    """Sections of daq.toml by name: subclasses of `daq.config.section.Section`, as "module:Class"."""
    checks: tuple[str, ...] = ()
    """Functions for `daq config check`, as "module:function". Each gets the `Settings`, and raises SpecError for
    unusable values."""
    migrations: Mapping[str, str] = field(default_factory=dict)
    """Packages of migrations (`server/store/schema.py`), by a name that no other plug-in uses. The names of their
    database tables must begin with this name."""
    noted: tuple[str, ...] = ()
    """Functions called with a database session and an `AuditNote`, as "module:function". They are called within the
    transaction of every command, outside the service, that changes its users."""
    parts: tuple[str, ...] = ()
    """Parts of a running service: classes `server.parts.Part`, as "module:Class"."""
    sections: tuple[str, ...] = ()
    """Functions for the report of a diagnosis, as "module:function". Each gets the `Diagnosis` and its traces, and
    returns a `model.blocks.Section`, or None."""
    routes_at_root: tuple[str, ...] = ()
    """Routers with paths at the root, as "module:router"."""
    routes: tuple[str, ...] = ()
    """Routers below /api/v1, as "module:router": from `server.routes`, or FastAPI's."""
    panels: Mapping[str, str] = field(default_factory=dict)
    """Panels for the Live page, by title: paths of ES modules that a route at the root serves. The default export
    gets an HTML element and `{machine, sample}` (`PluginPanel.svelte`), draws, and may return what ends it."""
    pages: tuple[str, ...] = ()
    """Parts of the service's own page that need its routes: those of Experiments, `layouts`, `camera`, `hide`."""


@cache
def plugins() -> tuple[Plugin, ...]:
    """Returns the installed plug-ins by name. A plug-in that cannot be loaded is left out with a warning, so that a
    robot can still be stopped."""
    found = (_loaded(name, reference) for name, reference in sorted(_entry_points().items()))
    return tuple(plugin for plugin in found if plugin is not None)


def report_sections(found: object, traces: Sequence[object]) -> list[Any]:
    """Returns the sections that plug-ins add to the report of a diagnosis. `found`: the `Diagnosis` of `traces`."""
    made = (named(section)(found, traces) for plugin in plugins() for section in plugin.sections)
    return [section for section in made if section is not None]


def named(reference: str) -> Any:
    """Imports and returns "module:object"."""
    module, _, name = reference.partition(":")
    return getattr(import_module(module), name)


def _entry_points() -> dict[str, str]:
    """Returns the references of the group by name, from the files that `importlib.metadata` reads. That module's import
    would take a third of the time of `daq --help`."""
    found: dict[str, str] = {}
    for folder in sys.path:
        for file in sorted(Path(folder).glob("*.dist-info/entry_points.txt")):
            _, _, group = f"\n{file.read_text('utf-8', 'replace')}".partition(f"\n[{GROUP}]\n")
            for line in group.partition("\n[")[0].splitlines():
                name, is_entry, reference = line.partition("=")
                if is_entry and not line.startswith(("#", ";")):
                    found.setdefault(name.strip(), reference.strip())
    return found


def _loaded(name: str, reference: str) -> Plugin | None:
    try:
        plugin = named(reference)
    except ModuleNotFoundError as error:
        if error.name is not None and f"{reference.partition(':')[0]}.".startswith(f"{error.name}."):
            return None  # the plug-in's own package was removed, as `extras/` may be
        plugin = error
    except Exception as error:  # noqa: BLE001  # another package's module may raise any error
        plugin = error
    if isinstance(plugin, Plugin):
        return plugin
    log.warning("plug-in %s (%s) is left out: %s", name, reference, plugin)
    return None
