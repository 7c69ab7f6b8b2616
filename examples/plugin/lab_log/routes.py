"""A route below /api/v1; its parameter states who may call it."""

from fastapi import APIRouter

from server.api.dependencies import ServicesDep, Viewer

router = APIRouter(prefix="/lab-log", tags=["lab log"])


@router.get("/robots")
def count_robots(services: ServicesDep, _: Viewer) -> int:
    """Returns the number of robots."""
    return len(services.robots())
