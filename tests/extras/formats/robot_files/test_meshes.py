"""Meshes of published URDFs lie where Pinocchio's own reader has them; a URDF reaches no file outside its folder."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree as Xml

import numpy as np
import pinocchio
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine
from extras.formats.robot_files.denavit_hartenberg import transform
from extras.formats.robot_files.machine_of_arm import machine_from_urdf
from extras.formats.robot_files.meshes import placed_meshes
from model.arrays import Floats
from tests.extras.formats.robot_files.arms import ARMS
from tests.extras.formats.robot_files.robots import INERTIAL, TURNING, joint, link, robot


def frames(machine: Machine, q: Floats) -> list[Floats]:
    """The base's frame and that of each joint, (4, 4) in the base's."""
    found = [np.eye(4)]
    for own, value in zip(machine.joints, q, strict=True):
        sizes = own.geometry
        found.append(found[-1] @ transform(sizes.theta.value + value, sizes.d.value, sizes.a.value, sizes.alpha.value))
    return found


@pytest.mark.parametrize("name", ["ur5", "kinova", "xarm7", "so101", "panda"])
def test_meshes_of_a_published_arm_move_as_another_reader_has_them(name: str, tmp_path: Path) -> None:
    arm = ARMS[name]
    text = arm.path.read_text("utf-8")
    for file in re.findall(r'filename="package://([^"]+)"', text):
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).touch()
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(text, "utf-8")
    machine = machine_from_urdf(urdf, arm.joints)
    found = placed_meshes(urdf, machine)

    whole = pinocchio.buildModelFromUrdf(str(urdf))
    packages = {one.split("/")[0] for one in re.findall(r'filename="package://([^"]+)"', text)}
    assert packages
    shapes = pinocchio.GeometryModel()
    bare = Xml.fromstring(text)
    for mesh in bare.iter("mesh"):  # its places are asked for, not its triangles
        mesh.tag = "sphere"
        mesh.attrib = {"radius": "1"}
    pinocchio.buildGeomFromUrdfString(
        whole, Xml.tostring(bare, "unicode"), pinocchio.GeometryType.VISUAL, shapes, [str(tmp_path)]
    )
    files = [v.get("filename") for v in Xml.fromstring(text).findall("link/visual/geometry/mesh")]
    assert len(found.meshes) == len(files)
    q = np.random.default_rng(3).uniform(-1.0, 1.0, len(arm.joints))
    turned = np.zeros(whole.nv)
    for own, value in zip(arm.joints, q, strict=True):
        turned[whole.joints[whole.getJointId(own)].idx_v] = value
    posture = pinocchio.integrate(whole, pinocchio.neutral(whole), turned)
    data, placed = whole.createData(), shapes.createData()
    pinocchio.updateGeometryPlacements(whole, data, shapes, placed, posture)
    theirs = [np.array(one.homogeneous) for one in placed.oMg]
    ours = [frames(machine, q)[one.joint] @ np.array(one.pose).reshape(4, 4) for one in found.meshes]
    for one in ours:
        one[:3, :3] /= np.linalg.norm(one[:3, :3], axis=0)  # Pinocchio has the scale elsewhere
    fixed = theirs[0] @ np.linalg.inv(ours[0])  # the base's frame in the root's
    for one in ours:
        apart = [np.abs(fixed @ one - other).max() for other in theirs]
        assert min(apart) < 1e-6, (name, min(apart))


def test_a_urdf_reaches_no_file_outside_its_folder(tmp_path: Path) -> None:
    lab, secret = tmp_path / "lab", tmp_path / "secret.stl"
    (lab / "meshes").mkdir(parents=True)
    for file in (secret, lab / "meshes" / "good.stl", lab / "notes.txt"):
        file.write_text("solid")
    (lab / "link.stl").symlink_to(secret)
    names = ["meshes/good.stl", "package://pack/meshes/good.stl", "../secret.stl", str(secret), "link.stl", "notes.txt"]
    names += ["package://../secret.stl", f"file://{secret}", "missing.dae", ""]
    visuals = "".join(f'<visual><geometry><mesh filename="{one}"/></geometry></visual>' for one in names)
    urdf = lab / "arm.urdf"
    urdf.write_text(robot(link("a"), link("b", INERTIAL + visuals), joint("j", "a", "b")))
    found = placed_meshes(urdf, machine_from_urdf(urdf))
    assert [file.name for file in found.files] == ["good.stl", "good.stl"]
    assert "8 meshes are not in its folder" in found.problem
    other = urdf.read_text().replace(TURNING, TURNING.replace("0 1 1", "1 0 1"))
    machine = machine_from_urdf(urdf)
    urdf.write_text(other.replace('name="j"', 'name="k"'))
    with pytest.raises(SpecError, match="has no joint 'j'"):
        placed_meshes(urdf, machine)
