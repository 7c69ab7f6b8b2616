"""State of the service itself, and the identity of the caller."""

from __future__ import annotations

from typing import Literal

from pydantic import AwareDatetime

from daq.contracts.service.base import Wire
from daq.contracts.service.queue import Role


def stop_port_after(port: int) -> int:
    """Port of the stop listener that belongs to a service at `port`, unless the configuration names another."""
    return port + 1 if port < 65535 else port - 1


class Health(Wire):
    """Whether the service answers, and can take experiments. `checks`: one line each; empty if the check succeeded."""

    status: Literal["ok", "not ready"]
    version: str
    checks: dict[str, str]


class Me(Wire):
    """The caller as the service identified it."""

    name: str
    role: Role
    owner_of: tuple[str, ...] = ()
    """Robots of which they are an owner: there they may change and cancel everybody's experiments."""
    is_known: bool = True
    """Whether a token or a session says who they are. A user of this computer without one cannot approve experiments:
    nobody can tell them from whoever submitted them."""
    session_until: AwareDatetime | None = None
    """When they must sign in again; None for a token, and for a user of this computer."""


class OpenIdWay(Wire):
    """A provider of OpenID Connect. `start`: the address at this service that a browser opens to sign in."""

    label: str
    start: str


class LoginWays(Wire):
    """How people sign in besides by a token. `openid` is None where no provider is configured."""

    openid: OpenIdWay | None = None


class SignedOut(Wire):
    """The session has ended. `provider`: where the provider's own session is left, if it has such an address."""

    provider: str | None = None


class StorageStatus(Wire):
    """Where data are stored, and how much space is free (bytes)."""

    traces_folder: str
    traces_free: int
    traces_reserve: int
    """New experiments are refused if less than this is free."""
    traces_size: int
    """Size of the disk of the traces (bytes)."""
    traces: int
    """Number of traces in the catalogue."""
    database: str
    database_size: int | None


class SystemStatus(Wire):
    """The service: version, uptime, storage, clients."""

    version: str
    uptime: float
    """Time (s) since the service started."""
    storage: StorageStatus
    warnings: tuple[str, ...] = ()
    """What will need somebody soon, one line each: a disk that fills, an archive that is away."""
    live_clients: int
    live_dropped: int
    jobs_at_once: int
    short_jobs_at_once: int
    """Number of further workers, for short jobs only."""
    unattended: bool
    stop_port: int
    """Port of the stop listener, which answers even while the service is too busy."""
