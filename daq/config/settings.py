"""Strict TOML configuration. An unknown key is an error; each error names the key, its value and what is allowed."""

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

from daq.config.section import Section
from daq.config.service import ServiceSettings, TrueOrFalse
from daq.contracts.documents import parse_toml, read_text, shown
from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from daq.contracts.limits import JointLimits, Limits
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace_limits import TraceLimits
from daq.plugins import named, plugins
from firmware_protocol.invalid import first_invalid


def merged_limits(machine: Machine, given: Limits) -> Limits:
    """Returns the machine's limits, replaced by those in `given`, joint by joint. Raises SpecError.

    To remove a limit, use a machine file without it.
    """
    changes: dict[str, object] = {name: getattr(given, name) for name in given.model_fields_set - {"joints"}}
    if given.joints:
        count = len(machine.joints)
        if len(given.joints) != count:
            raise SpecError(f"robot.limits.joints has {len(given.joints)} entries; {machine.name} has {count} joints")
        changes["joints"] = tuple(_merged(machine, number, own) for number, own in enumerate(given.joints, start=1))
    return machine.limits.model_copy(update=changes)


def _merged(machine: Machine, number: int, given: JointLimits) -> JointLimits:
    merged = machine.limits.joint(number).model_copy(update={n: getattr(given, n) for n in given.model_fields_set})
    if merged.low is not None and merged.high is not None and merged.low >= merged.high:
        raise SpecError(f"robot.limits.joints of joint {number}: low {merged.low} must be below high {merged.high}")
    return merged


S = TypeVar("S", bound=Section)
log = logging.getLogger(__name__)
APP = "ma2000-daq"
LOCAL_FILE = "daq.toml"
MOCK_URL = "mock://"
SERVER_VARIABLE = "DAQ_SERVER"
"""Environment variable of the command line: URL of a service. It does not configure the section `[server]`."""


RobotName = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]{0,31}$")]
MOST_ROBOTS = 32
"""Most robots of one service (an assumption). Each has its own process and a dozen threads."""


class RobotSettings(FrozenRecord):
    """The arm: its name, its machine file, its port."""

    name: RobotName = "ma2000"
    """Name of the arm in files and addresses."""
    machine: str = "ma2000"
    """Name of a packaged machine, or path of a machine file."""
    port: str | None = None
    """URL of the port; without it, runs use a mock."""
    memory_map: Path | None = None
    """File of the memory map; None for the packaged one, whose addresses are mostly assumptions."""
    limits: Limits | None = None
    """Each limit given here replaces the machine file's. None keeps all."""
    owners: tuple[Annotated[str, Field(min_length=1, max_length=64)], ...] = ()
    """Names of the users with role owner who are responsible for this arm; empty for all of them."""
    review: Literal["off", "operator", "owner"] = "off"
    """Whose approval each experiment needs before it moves a real arm: nobody's, another operator's (not the
    submitter's), or another owner's."""


class FleetRobotSettings(FrozenRecord):
    """Table `[robots.NAME]`: one of several robots (docs/fleet.md)."""

    machine: str = "ma2000"
    """Name of a packaged machine, or path of a machine file."""
    port: str | None = None
    """URL of its port; without it, runs use a mock."""
    memory_map: Path | None = None
    """File of its memory map; None for the packaged one."""
    limits: Limits | None = None
    """Each limit given here replaces the machine file's. None keeps all."""
    owners: tuple[Annotated[str, Field(min_length=1, max_length=64)], ...] = ()
    """Names of the users with role owner who are responsible for this arm; empty for all of them."""
    review: Literal["off", "operator", "owner"] = "off"
    """Whose approval each experiment needs before it moves a real arm: nobody's, another operator's (not the
    submitter's), or another owner's."""
    traces: Path | None = None
    """Folder of its traces; None for a subfolder of `[traces]` with its name."""
    unattended: TrueOrFalse = False
    """Whether the queue may move a real arm without an operator who has confirmed being present."""

    @field_validator("traces")
    @classmethod
    def _expanded(cls, folder: Path | None) -> Path | None:
        return None if folder is None else folder.expanduser()


class TraceSettings(FrozenRecord):
    """Folder of traces, and limits of their size."""

    folder: Path = Path("traces")
    """Folder to which runs are written and from which commands read."""
    limits: TraceLimits = TraceLimits()
    """Limits for reading files of any origin."""
    warn_at: Annotated[float, Field(gt=0, le=1)] = 0.9
    """Used share of the disk of the traces, at which the service warns."""

    @field_validator("folder")
    @classmethod
    def _expanded(cls, folder: Path) -> Path:
        return folder.expanduser()


class Settings(BaseSettings):
    """The whole configuration. Environment variables (`DAQ_ROBOT__PORT=…`) override the file."""

    model_config = SettingsConfigDict(
        env_prefix="DAQ_",
        env_nested_delimiter="__",
        extra="forbid",
        frozen=True,
        nested_model_default_partial_update=True,
    )

    robot: RobotSettings = RobotSettings()
    """The only robot, unless `robots` is given."""
    robots: Annotated[dict[RobotName, FleetRobotSettings], Field(max_length=MOST_ROBOTS)] = {}
    """Several robots by name, in place of `robot`. `of_robot` returns the settings of one."""
    traces: TraceSettings = TraceSettings()
    server: ServiceSettings = ServiceSettings()
    operator: Annotated[str, Field(max_length=100)] | None = None
    """Person who runs the experiments; recorded in every trace."""

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,
        file_secret_settings: PydanticBaseSettingsSource,
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """The environment, then the file's values (passed to the constructor)."""
        del settings_cls, dotenv_settings, file_secret_settings
        assert isinstance(env_settings, EnvSettingsSource)
        env_settings.env_vars = {k: v for k, v in env_settings.env_vars.items() if k.upper() != SERVER_VARIABLE}
        return env_settings, init_settings

    def section(self, kind: type[S]) -> S:
        """Returns the section of a plug-in with this class."""
        return next((section for section in self.sections() if isinstance(section, kind)), kind())

    def sections(self) -> tuple[Section, ...]:
        """Returns the sections of plug-ins."""
        return tuple(value for _, value in self if isinstance(value, Section))

    @property
    def port(self) -> str:
        """The configured port; the mock if none is configured."""
        return self.robot.port or MOCK_URL

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all robots."""
        return tuple(self.robots) or (self.robot.name,)

    def of_robot(self, name: str | None = None) -> Settings:
        """Returns the settings of one robot, as if it were the only one. Without a name, there must be only one.

        Raises SpecError with the existing names.
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
        """Returns the settings of every robot."""
        return tuple(self.of_robot(name) for name in self.names)

    def machine(self) -> Machine:
        """Returns the machine, with this configuration's limits. Raises SpecError."""
        machine = load_machine(self.robot.machine)
        if self.robot.limits is None:
            return machine
        return machine.model_copy(update={"limits": merged_limits(machine, self.robot.limits)})


@cache
def settings_type() -> type[Settings]:
    """Returns `Settings` with the sections of plug-ins. A section that cannot be loaded is left out with a warning."""
    found: dict[str, Any] = {}
    for plugin in plugins():
        for name, reference in plugin.settings.items():
            try:
                kind = named(reference)
                found[name] = (kind, kind())
            except Exception as error:  # noqa: BLE001  # another package's module may raise any error
                log.warning("section [%s] (%s) is left out: %s", name, reference, error)
    return create_model("Settings", __base__=Settings, **found)


def config_files(explicit: Path | None = None) -> list[Path]:
    """Returns the candidates for the configuration file in order: the requested one, ./daq.toml, the user's."""
    if explicit is not None:
        return [explicit]
    if "DAQ_CONFIG" in os.environ:
        return [Path(os.environ["DAQ_CONFIG"])]
    with suppress(RuntimeError):  # the user has no home folder
        return [Path(LOCAL_FILE), Path(platformdirs.user_config_dir(APP)) / "config.toml"]
    return [Path(LOCAL_FILE)]


def load_settings(explicit: Path | None = None) -> tuple[Settings, Path | None]:
    """Returns the settings and their file (None if there is none).

    Raises a one-line SpecError: the file, the key, its value, what is allowed.
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
        if isinstance(given, str):  # only environment variables may give text, since they have no other type
            allowed = "must be true or false, without quotation marks"
            raise SpecError(f"{what}: {name}.unattended = {shown(given)}: {allowed}")
    return _validated(data, str(path))


def _validated(data: dict[str, Any], origin: str) -> Settings:
    try:
        settings = settings_type()(**data)
    except SettingsError as error:
        # An environment variable for a whole section must contain JSON; the error names the variable.
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
    """Raises SpecError for several robots that share a table, a port or a folder."""
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
    """Whether a wrong value may be a secret, or an address that contains one. It must not appear in a log, even if it
    is under the wrong key."""
    field = settings_type().model_fields.get(str(where[0])) if where else None
    kind = None if field is None else field.annotation
    return isinstance(kind, type) and issubclass(kind, Section) and where[-1] not in kind.SHOWN


def _variable_of(where: tuple[int | str, ...]) -> str | None:
    """The environment variable that overrides the file at this key; None if there is none."""
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
