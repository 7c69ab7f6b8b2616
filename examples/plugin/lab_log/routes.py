"""A route below /api/v1; who may call it is said by its parameter."""

from fastapi import APIRouter

from server.api.dependencies import ServicesDep, Viewer

router = APIRouter(prefix="/lab-log", tags=["lab log"])


@router.get("/robots")
def count_robots(services: ServicesDep, _: Viewer) -> int:
    """Returns the number of robots."""
    return len(services.robots())
