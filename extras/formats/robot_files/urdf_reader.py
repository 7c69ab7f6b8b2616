"""Reads a URDF. MuJoCo's reader parses frames and inertias; its compiler, which merges, balances and rounds them, is
not run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from daq.contracts.documents import read_text
from daq.contracts.errors import SpecError
from extras.formats.robot_files.description import DescribedJoint, DescribedLink, Description
from extras.formats.robot_files.urdf_text import MOVING, CheckedUrdf, checked_urdf
from model.arrays import Floats


def read_urdf(path: Path) -> Description:
    """Returns the robot in a URDF file; meshes are not read. Raises SpecError with one line."""
    return parse_urdf(read_text(path, f"URDF {path}", xml=True), str(path))


def parse_urdf(text: str, origin: str) -> Description:
    """Returns the robot in a URDF's text; `origin` names the file in errors. Raises SpecError with one line."""
    checked = checked_urdf(text, origin)
    spec = _spec(text, origin)
    links: list[DescribedLink] = []
    index: dict[str, int] = {}
    waiting = [spec.worldbody] if checked.root == spec.worldbody.name else list(spec.worldbody.bodies)
    while waiting:
        body = waiting.pop(0)
        index[body.name] = len(links)
        links.append(_link(body, checked, index))
        waiting += body.bodies
    if len(links) != len(checked.parents) + 1:
        raise SpecError(f"{origin}: MuJoCo reads {len(links)} of its {len(checked.parents) + 1} links")
    return Description(origin, checked.name, tuple(links), np.array(spec.option.gravity), checked.doubts)


def _spec(text: str, origin: str) -> Any:
    """Returns the result of MuJoCo's reader, not compiled.

    Its warnings, which would be written to a file in the working folder, concern only unused parts.
    """
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        return mujoco.MjSpec.from_string(text)
    except ValueError as error:
        raise SpecError(f"{origin}: {' '.join(str(error).split())}") from error
    finally:
        mujoco.set_mju_user_warning(before)


def _link(body: Any, checked: CheckedUrdf, index: dict[str, int]) -> DescribedLink:
    name = body.name
    parent = checked.parents.get(name)
    full = np.nan_to_num(np.array(body.fullinertia))  # not a number where the file states none
    xx, yy, zz, xy, xz, yz = full
    turn = _rotation(body.iquat)
    return DescribedLink(
        name,
        None if parent is None else index[parent],
        np.array(body.pos),
        _rotation(body.quat),
        _joint(body, name, checked),
        float(body.mass),
        np.nan_to_num(np.array(body.ipos)),
        turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T,
    )


def _joint(body: Any, link: str, checked: CheckedUrdf) -> DescribedJoint | None:
    name = checked.joint_of.get(link)
    if name is None or checked.joints[name].kind == "fixed":
        return None
    text = checked.joints[name]
    axis = np.array(body.joints[0].axis)
    return DescribedJoint(
        name,
        "prismatic" if MOVING[text.kind] == "prismatic" else "revolute",
        axis / np.linalg.norm(axis),
        text.low,
        text.high,
        text.speed,
        text.effort,
        text.damping,
        text.friction,
        text.follows,
    )


def _rotation(quaternion: Any) -> Floats:
    """Returns the rotation matrix of a quaternion (w, x, y, z)."""
    matrix = np.zeros(9)
    unit = np.array(quaternion, dtype=float)
    mujoco.mju_quat2Mat(matrix, unit / np.linalg.norm(unit))
    return matrix.reshape(3, 3)
