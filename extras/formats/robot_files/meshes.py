"""The meshes of a URDF, placed in the frames of a machine, and the routes by which the page's 3-D gets them.

The URDF lies beside the machine file and has its name: arm.toml, arm.urdf. Clients name a mesh by its number, never by
a path, and files outside the machine file's folder are left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal
from xml.etree import ElementTree as Xml

import numpy as np
from fastapi import Path as InPath
from fastapi import Response

from daq.contracts.documents import read_text
from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine, shipped_machines
from daq.contracts.service.base import Wire
from server.api.dependencies import RobotDep, ServicesDep, Viewer
from server.problems import PROBLEMS, not_found
from server.routes import Router

if TYPE_CHECKING:
    from model.arrays import Floats

router = Router(prefix="/robots/{robot}/meshes", tags=["robots"], responses=PROBLEMS)
KINDS: dict[str, Literal["stl", "dae", "obj"]] = {".stl": "stl", ".dae": "dae", ".obj": "obj"}
MOST_MESHES, LARGEST = 200, 32 << 20
"""Most meshes of a robot, and bytes of one."""
APART = 1e-3
"""Distance (m) and sine of the angle of an axis from the machine's, from which the URDF is another arm's."""


class Mesh(Wire):
    """A mesh on the arm. `joint`: the one with which it moves, 0 for the base. `pose`: 4 × 4 by rows, from the file's
    coordinates to that joint's Denavit–Hartenberg frame in m."""

    number: int
    joint: int
    kind: Literal["stl", "dae", "obj"]
    pose: tuple[float, ...]


class Meshes(Wire):
    """All meshes of a machine, and why some or all are missing; empty if none is."""

    machine: str
    meshes: tuple[Mesh, ...]
    problem: str


@dataclass(frozen=True)
class _Found:
    meshes: tuple[Mesh, ...]
    files: tuple[Path, ...]
    problem: str = ""


@router.get("")
def get_meshes(rig: RobotDep, services: ServicesDep, _: Viewer) -> Meshes:
    """Returns the meshes of the URDF beside the robot's machine file."""
    found = _of(services.settings.of_robot(rig.robot.name).robot.machine, rig.robot.machine)
    return Meshes(machine=rig.robot.machine.name, meshes=found.meshes, problem=found.problem)


@router.get("/{number}", response_class=Response, responses={200: {"content": {"application/octet-stream": {}}}})
def get_mesh(
    rig: RobotDep, services: ServicesDep, _: Viewer, number: Annotated[int, InPath(ge=0, lt=MOST_MESHES)]
) -> Response:
    """Returns the file of a mesh."""
    files = _of(services.settings.of_robot(rig.robot.name).robot.machine, rig.robot.machine).files
    if number >= len(files):
        raise not_found(f"mesh {number}", f"there are {len(files)}")
    return Response(files[number].read_bytes(), media_type="application/octet-stream")


def _of(machine_file: str, machine: Machine) -> _Found:
    urdf = Path(machine_file).with_suffix(".urdf")
    if machine_file in shipped_machines() or not urdf.is_file():
        return _Found((), (), f"there is no {urdf.name} beside the machine file")
    return _placed(urdf, urdf.stat().st_mtime_ns, machine)


@cache
def _placed(urdf: Path, _changed: int, machine: Machine) -> _Found:
    try:
        return placed_meshes(urdf, machine)
    except SpecError as error:
        return _Found((), (), str(error))


def placed_meshes(urdf: Path, machine: Machine) -> _Found:
    """Returns the meshes of a URDF in the frames of a machine. Raises SpecError for a URDF of another arm."""
    from extras.formats.robot_files.denavit_hartenberg import frames_of, transform
    from extras.formats.robot_files.serial_arm import serial_arm
    from extras.formats.robot_files.urdf_reader import parse_urdf

    text = read_text(urdf, f"URDF {urdf.name}", xml=True)
    names = [joint.name for joint in machine.joints]
    arm = serial_arm(parse_urdf(text, urdf.name), names)
    base = frames_of([j.point for j in arm.joints], [j.direction for j in arm.joints], arm.tip, names)
    frames = [_matrix(base.axes[0], base.origins[0])]
    for own in machine.joints:
        sizes = own.geometry
        frames.append(frames[-1] @ transform(sizes.theta.value, sizes.d.value, sizes.a.value, sizes.alpha.value))
    for number, (frame, joint) in enumerate(zip(frames, arm.joints, strict=False), start=1):
        across = np.cross(frame[:3, 2], joint.direction), np.cross(joint.point - frame[:3, 3], joint.direction)
        if max(map(np.linalg.norm, across)) > APART:
            raise SpecError(f"{urdf.name}: axis of joint {number} is not where the machine file has it")
    meshes: list[Mesh] = []
    files: list[Path] = []
    left_out = 0
    for link, pose, scale, name in _visuals(text):
        place, moves_with = arm.places[link]
        file = _file(urdf.parent, name)
        if file is None or len(files) == MOST_MESHES:
            left_out += 1
            continue
        whole = np.linalg.inv(frames[moves_with]) @ place @ pose @ np.diag([*scale, 1.0])
        numbers = tuple(float(one) for one in whole.ravel())
        meshes.append(Mesh(number=len(files), joint=moves_with, kind=KINDS[file.suffix.lower()], pose=numbers))
        files.append(file)
    problem = f"{urdf.name}: {left_out} meshes are not in its folder, or are no STL, COLLADA or OBJ" if left_out else ""
    return _Found(tuple(meshes), tuple(files), problem)


def _visuals(text: str) -> Iterator[tuple[str, Floats, list[float], str]]:
    """Yields link, pose (4, 4) in its frame, scale and file name of each visual mesh of a checked URDF."""
    for link in Xml.fromstring(text).iter("link"):
        for visual in link.findall("visual"):
            mesh = visual.find("geometry/mesh")
            if mesh is not None:
                scale = _numbers(mesh, "scale", 1.0)
                yield link.get("name", ""), _pose(visual.find("origin")), scale, mesh.get("filename", "")


def _pose(origin: Xml.Element | None) -> Floats:
    roll, pitch, yaw = _numbers(origin, "rpy", 0.0)
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(angle), math.cos(angle)) for angle in (roll, pitch, yaw))
    turn = np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
    return _matrix(turn, np.array(_numbers(origin, "xyz", 0.0)))


def _numbers(element: Xml.Element | None, name: str, default: float) -> list[float]:
    given = "" if element is None else element.get(name, "")
    try:
        found = [float(one) for one in given.split()] or [default] * 3
    except ValueError:
        found = []
    if len(found) != 3 or not all(map(math.isfinite, found)):
        raise SpecError(f"URDF: {name} of a visual is {given!r}; three numbers are needed")
    return found


def _matrix(turn: Floats, place: Floats) -> Any:
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = turn, place
    return whole


def _file(folder: Path, name: str) -> Path | None:
    """Returns the file of a mesh, if it lies in a folder: `package://NAME/PATH` is PATH or NAME/PATH there."""
    whole = name.removeprefix("package://").removeprefix("file://")
    within = folder.resolve()
    for path in (whole, whole.partition("/")[2]):
        file = (folder / path).resolve()
        if path and file.is_relative_to(within) and file.suffix.lower() in KINDS and file.is_file():
            return file if file.stat().st_size <= LARGEST else None
    return None
