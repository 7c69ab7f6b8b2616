"""Routes of the camera."""

from __future__ import annotations

import time
from typing import Annotated

from fastapi import Query, Response

from extras.camera.part import Cameras, CameraStatus
from server.api.dependencies import RobotDep, Viewer, part
from server.problems import PROBLEMS
from server.routes import Router

router = Router(prefix="/robots/{robot}/camera", tags=["camera"], responses=PROBLEMS)
CamerasDep = Annotated[Cameras, part(Cameras)]
NUMBER, AGE = "Camera-Picture", "Camera-Age"
"""Headers of a picture: its number, and its age (s) when it was sent."""


@router.get("")
def get_camera(rig: RobotDep, cameras: CamerasDep, _: Viewer) -> CameraStatus:
    """Returns what gives the pictures, and why there are none."""
    return cameras.of(rig.robot.name).status()


@router.get(
    "/picture",
    response_class=Response,
    responses={200: {"content": {"image/jpeg": {}}}, 204: {"description": "There is none newer."}},
)
def get_camera_picture(
    rig: RobotDep,
    cameras: CamerasDep,
    _: Viewer,
    after: Annotated[int, Query(ge=0, lt=2**63, description="Number of the picture that the client has.")] = 0,
) -> Response:
    """Returns the newest picture, a JPEG, or nothing (204) if it is the one that the client has."""
    found = cameras.of(rig.robot.name).after(after)
    if found is None:
        return Response(status_code=204)
    number, one = found
    headers = {NUMBER: str(number), AGE: f"{time.monotonic() - one.time:.3f}", "Cache-Control": "no-store"}
    return Response(one.jpeg, media_type="image/jpeg", headers=headers)
