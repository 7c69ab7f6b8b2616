"""Strict TOML configuration. An unknown key is an error, and every error names key, value and what is allowed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

import platformdirs
from pydantic import BaseModel, Field, ValidationError, field_validator
from pydantic_settings import (
    BaseSettings,
    EnvSettingsSource,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
    SettingsError,
)

from daq.config.limits import merged_limits
from daq.config.service import ServiceSettings
from daq.contracts.documents import parse_toml, read_text, shown
from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace_limits import TraceLimits
from firmware_protocol.invalid import first_invalid

APP = "ma2000-daq"
LOCAL_FILE = "daq.toml"
MOCK_URL = "mock://"
SERVER_VARIABLE = "DAQ_SERVER"
"""Environment variable of the command line: URL of a service. It does not configure the section `[server]`."""


class RobotSettings(FrozenRecord):
    """The arm: its name in files and addresses, its machine file, its port."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]{0,31}$")] = "ma2000"
    """Name of the arm in files and addresses."""
    machine: str = "ma2000"
    """A machine of the package, or a machine file."""
    port: str | None = None
    """URL of the port; without one, runs use a mock."""
    memory_map: Path | None = None
    """File of the memory map; without one, that of the package, whose addresses are mostly assumed."""
    limits: Limits | None = None
    """Each limit that is given here replaces the machine file's; the others stay. None keeps all."""


class TraceSettings(FrozenRecord):
    """Where traces are kept, and how large they may be."""

    folder: Path = Path("traces")
    """Folder that runs write to, and that commands read."""
    limits: TraceLimits = TraceLimits()
    """Limits for files that are read, whatever their origin."""

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

    @property
    def port(self) -> str:
        """The configured port, or the mock when none is configured."""
        return self.robot.port or MOCK_URL

    def machine(self) -> Machine:
        """The machine file, with this configuration's limits in it. Raises SpecError."""
        machine = load_machine(self.robot.machine)
        if self.robot.limits is None:
            return machine
        return machine.model_copy(update={"limits": merged_limits(machine, self.robot.limits)})


def config_files(explicit: Path | None = None) -> list[Path]:
    """Candidates for the configuration file, in order: the one requested, ./daq.toml, the user's."""
    if explicit is not None:
        return [explicit]
    if "DAQ_CONFIG" in os.environ:
        return [Path(os.environ["DAQ_CONFIG"])]
    return [Path(LOCAL_FILE), Path(platformdirs.user_config_dir(APP)) / "config.toml"]


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
    server = data.get("server")
    given = server.get("unattended") if isinstance(server, dict) else None
    if isinstance(given, str):  # only the environment, which holds nothing but text, may give text
        raise SpecError(f"{what}: server.unattended = {shown(given)}: must be true or false, without quotation marks")
    return _validated(data, str(path))


def _validated(data: dict[str, Any], origin: str) -> Settings:
    try:
        return Settings(**data)
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
        value = "" if isinstance(first.value, dict) else f" = {shown(first.value)}"
        raise SpecError(f"{where}: {first.where()}{value}: {message}") from error


def _variable_of(where: tuple[int | str, ...]) -> str | None:
    """The environment variable that overrides the file at this key; None where there is none."""
    name = "DAQ_" + "__".join(str(part) for part in where).upper()
    found = next((one for one in os.environ if one.upper() == name != SERVER_VARIABLE), None)
    return None if found is None else f"environment {found}"


def _keys_at(where: tuple[int | str, ...]) -> list[str]:
    model: type[BaseModel] = Settings
    for part in where:
        annotation = model.model_fields[str(part)].annotation if str(part) in model.model_fields else None
        candidates = [annotation, *getattr(annotation, "__args__", ())]
        model = next((c for c in candidates if isinstance(c, type) and issubclass(c, BaseModel)), model)
    return sorted(model.model_fields)
