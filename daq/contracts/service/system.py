"""State of the service itself, and the identity of the caller."""

from __future__ import annotations

from typing import Literal

from daq.contracts.service.base import Wire
from daq.contracts.service.queue import Role


def stop_port_after(port: int) -> int:
    """Returns the port of the stop listener for a service at `port`, unless the configuration sets another."""
    return port + 1 if port < 65535 else port - 1


class Health(Wire):
    """Whether the service works and accepts experiments. `checks`: one line each; empty if the check succeeded."""

    status: Literal["ok", "not ready"]
    version: str
    checks: dict[str, str]


class Me(Wire):
    """The caller as the service identified it."""

    name: str
    role: Role
    owner_of: tuple[str, ...] = ()
    """Robots that the caller owns. An owner may change and cancel all experiments of the robot."""
    is_known: bool = True
    """Whether a token identifies the caller. A local user without one cannot approve experiments, since this
    user might have submitted them."""


class StorageStatus(Wire):
    """Where data are stored, and how much space is free (bytes)."""

    traces_folder: str
    traces_free: int
    traces_reserve: int
    """New experiments are refused if less than this is free (bytes)."""
    traces_size: int
    """Size of the disk of the traces (bytes)."""
    traces: int
    """Number of traces in the catalogue."""
    database_size: int | None


class SystemStatus(Wire):
    """The service: version, uptime, storage, clients."""

    version: str
    uptime: float
    """Time (s) since the service started."""
    storage: StorageStatus
    warnings: tuple[str, ...] = ()
    """Things that will soon need a person, one line each: a disk that fills."""
    live_clients: int
    live_dropped: int
    jobs_at_once: int
    short_jobs_at_once: int
    """Number of additional workers for short jobs."""
    unattended: bool
    stop_port: int
    """Port of the stop listener, which answers even if the service is too busy."""
    panels: dict[str, str] = {}
    """Panels of plug-ins for the Live page, by title: paths of modules."""
    pages: tuple[str, ...] = ()
    """Parts of the page whose routes plug-ins have."""
