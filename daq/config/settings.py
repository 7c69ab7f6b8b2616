"""Strict TOML configuration. An unknown key is an error, and every error names key, value and what is allowed."""

from __future__ import annotations

import logging
import os
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import platformdirs
from pydantic import BaseModel, Field, ValidationError, create_model, field_validator
from pydantic_settings import (
    BaseSettings,
    EnvSettingsSource,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
    SettingsError,
)

from daq.config.limits import merged_limits
from daq.config.section import Section
from daq.config.service import ServiceSettings, TrueOrFalse
from daq.contracts.documents import parse_toml, read_text, shown
from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace_limits import TraceLimits
from daq.plugins import named, plugins
from firmware_protocol.invalid import first_invalid

S = TypeVar("S", bound=Section)
log = logging.getLogger(__name__)
APP = "ma2000-daq"
LOCAL_FILE = "daq.toml"
MOCK_URL = "mock://"
SERVER_VARIABLE = "DAQ_SERVER"
"""Environment variable of the command line: URL of a service. It does not configure the section `[server]`."""


RobotName = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]{0,31}$")]
MOST_ROBOTS = 32
"""Largest number of robots of one service: an assumption. Each has a process of its own, and a dozen threads."""


class RobotSettings(FrozenRecord):
    """The arm: its name in files and addresses, its machine file, its port."""

    name: RobotName = "ma2000"
    """Name of the arm in files and addresses."""
    machine: str = "ma2000"
    """A machine of the package, or a machine file."""
    port: str | None = None
    """URL of the port; without one, runs use a mock."""
    memory_map: Path | None = None
    """File of the memory map; without one, that of the package, whose addresses are mostly assumed."""
    limits: Limits | None = None
    """Each limit that is given here replaces the machine file's; the others stay. None keeps all."""
    owners: tuple[Annotated[str, Field(min_length=1, max_length=64)], ...] = ()
    """Names of those with the role owner who are responsible for this arm; none for all of them."""
    review: Literal["off", "operator", "owner"] = "off"
    """Whose approval each experiment needs before it moves this arm, a real one: nobody's, that of an operator who did
    not submit it, or that of an owner of the arm who did not."""


class FleetRobotSettings(FrozenRecord):
    """Table `[robots.NAME]`: one of several robots (docs/fleet.md)."""

    machine: str = "ma2000"
    """A machine of the package, or a machine file."""
    port: str | None = None
    """URL of its port; without one, runs use a mock."""
    memory_map: Path | None = None
    """File of its memory map; without one, that of the package."""
    limits: Limits | None = None
    """Each limit that is given here replaces the machine file's; the others stay. None keeps all."""
    owners: tuple[Annotated[str, Field(min_length=1, max_length=64)], ...] = ()
    """Names of those with the role owner who are responsible for this arm; none for all of them."""
    review: Literal["off", "operator", "owner"] = "off"
    """Whose approval each experiment needs before it moves this arm, a real one: nobody's, that of an operator who did
    not submit it, or that of an owner of the arm who did not."""
    traces: Path | None = None
    """Folder of its traces; None for the folder of its name in that of `[traces]`."""
    unattended: TrueOrFalse = False
    """Whether the queue may move this arm, a real one, while no operator has confirmed being present."""

    @field_validator("traces")
    @classmethod
    def _expanded(cls, folder: Path | None) -> Path | None:
        return None if folder is None else folder.expanduser()


class TraceSettings(FrozenRecord):
    """Where traces are kept, and how large they may be."""

    folder: Path = Path("traces")
    """Folder that runs write to, and that commands read."""
    limits: TraceLimits = TraceLimits()
    """Limits for files that are read, whatever their origin."""
    warn_at: Annotated[float, Field(gt=0, le=1)] = 0.9
    """Share of the disk of the traces, and of `archive.keep_size`, from which the service warns."""

    @field_validator("folder")
    @classmethod
    def _expanded(cls, folder: Path) -> Path:
        return folder.expanduser()


class Settings(BaseSettings):
    """Everything that can be configured. Environment variables (`DAQ_ROBOT__PORT=…`) override the file."""

    model_config = SettingsConfigDict(
        env_prefix="DAQ_",
        env_nested_delimiter="__",
        extra="forbid",
        frozen=True,
        nested_model_default_partial_update=True,
    )

    robot: RobotSettings = RobotSettings()
    """The only robot, unless there are several."""
    robots: Annotated[dict[RobotName, FleetRobotSettings], Field(max_length=MOST_ROBOTS)] = {}
    """Several robots, by name, in place of `robot`. `of_robot` has the settings of one of them."""
    traces: TraceSettings = TraceSettings()
    server: ServiceSettings = ServiceSettings()
    operator: Annotated[str, Field(max_length=100)] | None = None
    """Who runs the experiments; recorded in every trace."""

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,
        file_secret_settings: PydanticBaseSettingsSource,
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """The environment, then the file's values (given to the constructor)."""
        del settings_cls, dotenv_settings, file_secret_settings
        assert isinstance(env_settings, EnvSettingsSource)
        env_settings.env_vars = {k: v for k, v in env_settings.env_vars.items() if k.upper() != SERVER_VARIABLE}
        return env_settings, init_settings

    def section(self, kind: type[S]) -> S:
        """The section of a plug-in that is of this class."""
        return next((section for section in self.sections() if isinstance(section, kind)), kind())

    def sections(self) -> tuple[Section, ...]:
        """The sections of plug-ins."""
        return tuple(value for _, value in self if isinstance(value, Section))

    @property
    def port(self) -> str:
        """The configured port, or the mock when none is configured."""
        return self.robot.port or MOCK_URL

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all robots."""
        return tuple(self.robots) or (self.robot.name,)

    def of_robot(self, name: str | None = None) -> Settings:
        """The settings of one robot, as if it were the only one. Without a name, there must be no other.

        Raises SpecError with the names that there are.
        """
        if name is None and len(self.names) > 1:
            raise SpecError(f"several robots are configured: say which one with --robot: {', '.join(self.names)}")
        name = self.names[0] if name is None else name
        if name not in self.names:
            raise SpecError(f"robot {shown(name)}: is not configured; there is {', '.join(self.names)}")
        if not self.robots:
            return self
        table = self.robots[name]
        own = table.model_dump(exclude={"limits", "traces", "unattended"}, exclude_unset=True)
        folder = table.traces or self.traces.folder / name
        return self.model_copy(
            update={
                "robot": RobotSettings(name=name, **own, limits=table.limits),
                "robots": {},
                "traces": self.traces.model_copy(update={"folder": folder}),
                "server": self.server.model_copy(update={"unattended": table.unattended}),
            }
        )

    def each_robot(self) -> tuple[Settings, ...]:
        """The settings of every robot."""
        return tuple(self.of_robot(name) for name in self.names)

    def machine(self) -> Machine:
        """The machine file, with this configuration's limits in it. Raises SpecError."""
        machine = load_machine(self.robot.machine)
        if self.robot.limits is None:
            return machine
        return machine.model_copy(update={"limits": merged_limits(machine, self.robot.limits)})


@cache
def settings_type() -> type[Settings]:
    """`Settings` with the sections that plug-ins add. One that cannot be loaded is left out with a warning."""
    found: dict[str, Any] = {}
    for plugin in plugins():
        for name, reference in plugin.settings.items():
            try:
                kind = named(reference)
                found[name] = (kind, kind())
            except Exception as error:  # noqa: BLE001 - somebody else's module may raise anything
                log.warning("section [%s] (%s) is left out: %s", name, reference, error)
    return create_model("Settings", __base__=Settings, **found)


def config_files(explicit: Path | None = None) -> list[Path]:
    """Candidates for the configuration file, in order: the one requested, ./daq.toml, that of a user who has a home."""
    if explicit is not None:
        return [explicit]
    if "DAQ_CONFIG" in os.environ:
        return [Path(os.environ["DAQ_CONFIG"])]
    with suppress(RuntimeError):  # somebody of whom the system knows neither a name nor a home
        return [Path(LOCAL_FILE), Path(platformdirs.user_config_dir(APP)) / "config.toml"]
    return [Path(LOCAL_FILE)]


def load_settings(explicit: Path | None = None) -> tuple[Settings, Path | None]:
    """The settings, and the file they came from (None: nothing is configured).

    Raises SpecError with one line: the file, the key, its value, what is allowed.
    """
    asked_for = explicit is not None or "DAQ_CONFIG" in os.environ
    for path in config_files(explicit):
        if os.path.isfile(path):  # Path.is_file raises for a name that is too long
            return _parse(path), path
        if asked_for:
            raise SpecError(f"configuration {path}: {'is not a file' if os.path.exists(path) else 'no such file'}")
    return _validated({}, "environment"), None


def _parse(path: Path) -> Settings:
    what = f"configuration {path}"
    data = parse_toml(read_text(path, what), what)
    robots = data.get("robots")
    tables = {"server": data.get("server")}
    tables |= {f"robots.{name}": table for name, table in robots.items()} if isinstance(robots, dict) else {}
    for name, table in tables.items():
        given = table.get("unattended") if isinstance(table, dict) else None
        if isinstance(given, str):  # only the environment, which holds nothing but text, may give text
            allowed = "must be true or false, without quotation marks"
            raise SpecError(f"{what}: {name}.unattended = {shown(given)}: {allowed}")
    return _validated(data, str(path))


def _validated(data: dict[str, Any], origin: str) -> Settings:
    try:
        settings = settings_type()(**data)
    except SettingsError as error:
        # An environment variable of a whole section must hold JSON; its name is in the error's text.
        raise SpecError(f"environment: {error}; write single keys, such as DAQ_ROBOT__PORT") from error
    except RecursionError:
        raise SpecError("environment: a section is nested too deeply; write keys, such as DAQ_ROBOT__PORT") from None
    except ValidationError as error:
        first = first_invalid(error)
        message = first.message
        if first.kind == "extra_forbidden":
            message = f"no such key; allowed here: {', '.join(_keys_at(first.place[:-1]))}"
        where = _variable_of(first.place) or f"configuration {origin}"
        value = "" if isinstance(first.value, dict) or _is_secret(first.place) else f" = {shown(first.value)}"
        raise SpecError(f"{where}: {first.where()}{value}: {message}") from error
    _require_apart(settings, f"configuration {origin}")
    return settings


def _require_apart(settings: Settings, what: str) -> None:
    """Raises SpecError for several robots that one table is about, or that share a port or a folder."""
    if not settings.robots:
        return
    if "robot" in settings.model_fields_set:
        raise SpecError(f"{what}: robot and robots: give one of them; [robots.NAME] has all that [robot] has")
    if settings.server.unattended:
        raise SpecError(
            f"{what}: server.unattended: with several robots each says so for itself: robots.NAME.unattended"
        )
    taken: dict[str, str] = {}
    for own in settings.each_robot():
        name, port = own.robot.name, own.robot.port or MOCK_URL
        apart = [f"folder of traces {os.path.realpath(own.traces.folder)}"]
        if not port.startswith(MOCK_URL):
            apart.append(f"port {port.partition('?')[0]}")
        for one in apart:
            if (other := taken.setdefault(one, name)) != name:
                raise SpecError(f"{what}: robots {other} and {name} have the same {one}")


def _is_secret(where: tuple[int | str, ...]) -> bool:
    """Whether a wrong value may be a secret, or an address with one in it: who writes a key of the archive into the
    wrong place shall not find it in a log."""
    field = settings_type().model_fields.get(str(where[0])) if where else None
    kind = None if field is None else field.annotation
    return isinstance(kind, type) and issubclass(kind, Section) and where[-1] not in kind.SHOWN


def _variable_of(where: tuple[int | str, ...]) -> str | None:
    """The environment variable that overrides the file at this key; None where there is none."""
    name = "DAQ_" + "__".join(str(part) for part in where).upper()
    found = next((one for one in os.environ if one.upper() == name != SERVER_VARIABLE), None)
    return None if found is None else f"environment {found}"


def _keys_at(where: tuple[int | str, ...]) -> list[str]:
    model: type[BaseModel] = settings_type()
    for part in where:
        annotation = model.model_fields[str(part)].annotation if str(part) in model.model_fields else None
        candidates = [annotation, *getattr(annotation, "__args__", ())]
        model = next((c for c in candidates if isinstance(c, type) and issubclass(c, BaseModel)), model)
    return sorted(model.model_fields)
