"""The configuration of the service: its address, its data, and what it may do unattended."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, field_validator

from daq.contracts.frozen import FrozenRecord

DEFAULT_PORT = 8300


def _true_or_false(given: object) -> object:
    """Raises ValueError for all values but true and false, given as text in an environment variable."""
    if isinstance(given, bool) or given in ("true", "false"):
        return given
    raise ValueError("must be true or false")


TrueOrFalse = Annotated[bool, BeforeValidator(_true_or_false)]
"""A consent that may move an arm: only `true`, and no other truthy value."""


class ServiceSettings(FrozenRecord):
    """Section `[server]`."""

    host: Annotated[str, Field(min_length=1, max_length=253)] = "127.0.0.1"
    """Address to listen at. All but loopback require tokens (`daq token add`)."""
    tokens: Literal["remote", "always"] = "remote"
    """Who needs a token: remote clients, or everybody. Use `always` behind a proxy on this computer, which makes remote
    clients look local."""
    port: Annotated[int, Field(ge=0, le=65535)] = DEFAULT_PORT
    """Port; 0 for any free one, which is printed."""
    stop_port: Annotated[int, Field(ge=0, le=65535)] | None = None
    """Port of the stop listener; None for the one after `port`, 0 for any free one."""
    folder: Path = Path("service")
    """Folder of the database, the models and the jobs' results."""
    connect_at_start: bool = True
    """Whether the service connects to the robot when it starts; connecting moves nothing."""
    unattended: TrueOrFalse = False
    """Whether the queue may move a real arm without an operator who has confirmed being present."""
    jobs_at_once: Annotated[int, Field(ge=1, le=64)] = 1
    """Worker processes for fits and diagnoses; short jobs have a separate one."""
    history: Annotated[float, Field(ge=10, le=3600)] = 300.0
    """Time span (s) of past samples that a client can request."""
    upload_size: Annotated[int, Field(ge=1, le=65536)] = 512
    """Largest size (MB) of an uploaded trace."""
    upload_memory: Annotated[int, Field(ge=64, le=1 << 20)] = 2048
    """Memory limit (MB) of the process that reads an upload."""
    upload_time: Annotated[float, Field(ge=1, le=3600)] = 60.0
    """Time limit (s) of that process."""
    names: tuple[Annotated[str, Field(max_length=253)], ...] = ()
    """Names by which browsers reach this service besides its address; other names are refused."""

    @property
    def database(self) -> Path:
        """The file of the database."""
        return self.folder.absolute() / "service.sqlite"

    @field_validator("folder")
    @classmethod
    def _expanded(cls, folder: Path) -> Path:
        return folder.expanduser()
