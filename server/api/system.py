"""Routes of the service itself: health, readiness, and the caller's own role."""

from __future__ import annotations

import shutil
import tempfile
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path

from fastapi import Request, Response
from sqlalchemy import func, select
from sqlalchemy.exc import SQLAlchemyError

from daq.contracts.service.system import Health, Me, StorageStatus, SystemStatus
from daq.plugins import plugins
from daq.traces.room import RESERVE
from server.access.caller import caller_of
from server.api.dependencies import ServicesDep, Viewer
from server.catalogue.room import room_of
from server.database_errors import one_line
from server.jobs.lanes import SHORT_LANE_WORKERS
from server.problems import PROBLEMS
from server.routes import Router
from server.services import Services
from server.store.tables import TraceRow

plain = Router(tags=["system"])
router = Router(tags=["system"], responses=PROBLEMS)
VERSION = version("ma2000-daq")
NOT_WELL = "not well: details need a token"


@plain.get("/healthz")
async def healthz() -> Health:
    """Answers 200 while the service runs."""
    return Health(status="ok", version=VERSION, checks={})


@plain.get("/readyz", responses={503: {"model": Health}})
async def readyz(request: Request, services: ServicesDep, response: Response) -> Health:
    """Answers 200 while the database and the folders of traces are writable. The robots need not be connected.

    Callers who may see the robot get the details. The answer may be up to a second old.
    """
    problems = await services.readiness.check(lambda: _checks(services))
    if caller_of(request) is None:
        problems = {name: problem and NOT_WELL for name, problem in problems.items()}
    folders = [problem for name, problem in problems.items() if name.startswith("traces")]
    if problems["database"] or all(folders):
        response.status_code = 503
        return Health(status="not ready", version=VERSION, checks=problems)
    return Health(status="ok", version=VERSION, checks=problems)


@router.get("/me")
async def get_me(services: ServicesDep, caller: Viewer) -> Me:
    """Returns the name and the role of the caller."""
    owned = tuple(rig.robot.name for rig in services.robots() if caller.owns(rig.owners))
    return Me(
        name=caller.name,
        role=caller.role,
        owner_of=owned,
        is_known=caller.token is not None,
    )


@router.get("/system")
def get_system(services: ServicesDep, _: Viewer) -> SystemStatus:
    """Returns version, uptime, storage and live clients of the service."""
    # Even if a disk fails, the page must learn the port of the stop listener.
    room = room_of(rig.catalogue.folder for rig in services.robots())
    with services.store.reading() as session:
        count = session.scalar(select(func.count()).select_from(TraceRow)) or 0
    return SystemStatus(
        version=VERSION,
        uptime=services.clock.monotonic() - services.begun,
        storage=StorageStatus(
            traces_folder=", ".join(str(rig.catalogue.folder) for rig in services.robots()),
            traces_free=room.free,
            traces_reserve=RESERVE,
            traces_size=room.size,
            traces=count,
            database_size=_size_of(services.store.file),
        ),
        warnings=tuple(services.warnings()),
        live_clients=sum(rig.hub.clients for rig in services.robots()),
        live_dropped=sum(rig.hub.dropped for rig in services.robots()),
        jobs_at_once=services.settings.server.jobs_at_once,
        short_jobs_at_once=SHORT_LANE_WORKERS,
        unattended=any(rig.unattended for rig in services.robots()),
        stop_port=services.stop_port,
        panels={title: path for plugin in plugins() for title, path in plugin.panels.items()},
        pages=tuple(page for plugin in plugins() for page in plugin.pages),
    )


def _size_of(file: Path) -> int | None:
    """Returns the size (bytes) of SQLite's file and of the log beside it, which contains the newest changes."""
    sizes = []
    for path in (file, file.with_name(f"{file.name}-wal")):
        with suppress(FileNotFoundError):
            sizes.append(path.stat().st_size)
    return sum(sizes) if sizes else None


def _checks(services: Services) -> dict[str, str]:
    checks = {"database": ""}
    try:
        _require_writable(services.store.file.parent)
        services.store.require_writable()
    except (SQLAlchemyError, OSError) as error:
        checks["database"] = one_line(error)
    checks["disk space"] = "; ".join(services.storage_warnings())
    for part in services.parts:
        checks |= part.checks()
    for rig in services.robots():
        name = "traces" if len(services.robots()) == 1 else f"traces of {rig.robot.name}"
        checks[name] = _problem_of_folder(rig.catalogue.folder)
        arm = rig.robot.arm
        checks[f"robot {rig.robot.name}"] = rig.robot.problem if arm is None else arm.unheard
    return checks


def _problem_of_folder(folder: Path) -> str:
    """Returns why no trace can be written to a folder; empty if it can."""
    try:
        _require_writable(folder)
        free = shutil.disk_usage(folder).free
    except OSError as error:
        return str(error)
    return f"{free / 1e6:.0f} MB are free, {RESERVE / 1e6:.0f} MB stay free" if free < RESERVE else ""


def _require_writable(folder: Path) -> None:
    """Raises OSError if nothing can be written. The probe is an unnamed file, so nobody sees it."""
    with tempfile.TemporaryFile(dir=folder) as probe:
        probe.write(b"written")
