"""What a plug-in adds to the core, and where plug-ins are found.

A plug-in is an object `Plugin`, named by an entry point of the group `ma2000_daq.plugins`:

    [project.entry-points."ma2000_daq.plugins"]
    gripper = "gripper_plugin:PLUGIN"

It is a description: names, one-line helps, and references like "module:object", which are imported when they are used.
So the module that describes it imports nothing but this one, and `daq --help` stays fast. The core has the same
description of its own commands. docs/plugins.md shows a whole plug-in.
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
"""Headings of the help, in its order."""


@dataclass(frozen=True)
class Command:
    """A subcommand of `daq`."""

    name: str
    line: str
    """One line of help."""
    module: str
    """The module with the command: a Typer named `app`."""
    about: Literal["robot", "computer", "service"] = "robot"
    """What it is about: a robot, here or at a server; this computer alone, so that `--server` is refused; everything
    that one service has, so that `--robot` is refused, too."""
    needs: Extra = "robot"
    """The extra whose packages it needs here."""
    group: Group = "Set up"
    """The heading below which the help lists it."""


@dataclass(frozen=True)
class Name:
    """A name of the Python package `ma2000`."""

    name: str
    module: str
    needs: Extra | None = None
    """The extra whose packages it needs; none beside those that a client has."""


@dataclass(frozen=True)
class Importer:
    """Makes traces of recordings of others, for `daq traces import`."""

    what: str
    """What it makes a trace of: "the joint states in a bag"."""
    claims: str
    """"module:function" of a path and its first 16 bytes: whether the file is one for it."""
    read: str
    """"module:function" of a path, `TraceLimits` and `daq.contracts.import_choice.Choice`: returns a `Trace`."""


@dataclass(frozen=True)
class Plugin:
    """What a plug-in adds."""

    commands: tuple[Command, ...] = ()
    names: tuple[Name, ...] = ()
    importers: tuple[Importer, ...] = ()
    dialects: Mapping[str, str] = field(default_factory=dict)
    """Line protocols by the name that a port's URL has: "module:function" of the joints' numbers on the bus, which
    makes a `firmware_protocol.dialect.LinkDialect`."""
    settings: Mapping[str, str] = field(default_factory=dict)
    """Sections of daq.toml by name: classes `daq.config.section.Section`, as "module:Class"."""
    checks: tuple[str, ...] = ()
    """Functions of the `Settings`, as "module:function", that `daq config check` calls: each raises SpecError for what
    cannot be used."""
    migrations: Mapping[str, str] = field(default_factory=dict)
    """Packages of migrations (`server/store/schema.py`), by a name that no other plug-in uses. They make tables of the
    service's database, each named so that it begins with this name."""
    databases: Mapping[str, str] = field(default_factory=dict)
    """Kinds of databases beside SQLite, by SQLAlchemy's name: `server.store.databases.Database`, as "module:object"."""
    noted: tuple[str, ...] = ()
    """Functions of a session of the database and an `AuditNote`, as "module:function". They are called for each command
    beside the service that changes who may use it, within the command's transaction."""
    parts: tuple[str, ...] = ()
    """Parts of a running service: classes `server.parts.Part`, as "module:Class"."""
    sections: tuple[str, ...] = ()
    """Functions of a `Diagnosis` and its traces, as "module:function": a `model.blocks.Section` for its report, or
    None."""
    routes_at_root: tuple[str, ...] = ()
    """Routers whose addresses begin at the root, as "module:router"."""
    routes: tuple[str, ...] = ()
    """Routers below /api/v1, as "module:router": of `server.routes`, or FastAPI's."""


@cache
def plugins() -> tuple[Plugin, ...]:
    """Returns the plug-ins that are installed, by their names. One that cannot be loaded is left out with a warning: a
    robot must be stopped all the same."""
    found = (_loaded(name, reference) for name, reference in sorted(_entry_points().items()))
    return tuple(plugin for plugin in found if plugin is not None)


def report_sections(found: object, traces: Sequence[object]) -> list[Any]:
    """What plug-ins add to the report of a diagnosis of these traces, as sections."""
    made = (named(section)(found, traces) for plugin in plugins() for section in plugin.sections)
    return [section for section in made if section is not None]


def named(reference: str) -> Any:
    """Returns the object "module:object"."""
    module, _, name = reference.partition(":")
    return getattr(import_module(module), name)


def _entry_points() -> dict[str, str]:
    """The references of the group by name, from the same files as `importlib.metadata` reads: to import that takes a
    third of the time of `daq --help`."""
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
            return None  # its own package was taken away, as `extras/` may be
        plugin = error
    except Exception as error:  # noqa: BLE001 - somebody else's module may raise anything
        plugin = error
    if isinstance(plugin, Plugin):
        return plugin
    log.warning("plug-in %s (%s) is left out: %s", name, reference, plugin)
    return None
