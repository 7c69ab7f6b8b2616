"""Writes a model as URDF. Parts that a URDF cannot hold are listed in a comment, and returned."""

from __future__ import annotations

from xml.etree import ElementTree as Xml

from extras.formats.robot_files.bodies_of_model import OutgoingArm, OutgoingLink, left_out, outgoing_arm
from extras.formats.robot_files.numbers import text_of
from extras.formats.robot_files.urdf_text import NO_LIMIT
from model import layout as at
from model.machine_model.model import Model

HELD = frozenset((at.VISCOUS, at.COULOMB))
"""Effect parameters that a URDF can hold, besides those of the bodies."""


def urdf_text(model: Model) -> tuple[str, list[str]]:
    """Returns the model's URDF, and the parts of the model that it leaves out.

    Each link's frame is at its joint, whose axis is z. Gravity points down: a tilted base is fixed to a link `world`.
    Its magnitude is in MuJoCo's extension, which other readers ignore. The end of the arm is the link `tool`.
    """
    arm = outgoing_arm(model)
    lost = left_out(model, HELD)
    if turning := [link.joint for link in arm.links if link.rotor > 0.0]:
        lost.append(f"inertia of drives ({', '.join(turning)})")
    lost.append("drives")
    robot = Xml.Element("robot", name=arm.name)
    robot.append(
        Xml.Comment(f" Made from model {model.identity}. Not in a URDF: {'; '.join(lost)}. ".replace("--", "- -"))
    )
    Xml.SubElement(Xml.SubElement(robot, "mujoco"), "option", gravity=text_of(0.0, 0.0, -arm.gravity))
    _base(robot, arm)
    parent = "base"
    for link in arm.links:
        _link(robot, link)
        _joint(robot, link, parent)
        parent = link.name
    Xml.SubElement(robot, "link", name="tool")
    tool = _fixed(robot, "tool_joint", parent, "tool")
    Xml.SubElement(tool, "origin", xyz=text_of(*arm.tool[:3, 3]), rpy=text_of(*arm.tool_angles))
    Xml.indent(robot)
    return Xml.tostring(robot, "unicode", xml_declaration=True) + "\n", lost


def _base(robot: Xml.Element, arm: OutgoingArm) -> None:
    roll, pitch = arm.tilt
    if roll or pitch:
        Xml.SubElement(robot, "link", name="world")
        stand = _fixed(robot, "stand", "world", "base")
        Xml.SubElement(stand, "origin", xyz="0 0 0", rpy=text_of(roll, pitch, 0.0))
    Xml.SubElement(robot, "link", name="base")


def _fixed(robot: Xml.Element, name: str, parent: str, child: str) -> Xml.Element:
    joint = Xml.SubElement(robot, "joint", name=name, type="fixed")
    Xml.SubElement(joint, "parent", link=parent)
    Xml.SubElement(joint, "child", link=child)
    return joint


def _link(robot: Xml.Element, link: OutgoingLink) -> None:
    inertial = Xml.SubElement(Xml.SubElement(robot, "link", name=link.name), "inertial")
    Xml.SubElement(inertial, "origin", xyz=text_of(*link.centre), rpy="0 0 0")
    Xml.SubElement(inertial, "mass", value=text_of(link.mass))
    pairs = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    Xml.SubElement(inertial, "inertia", {name: text_of(link.inertia[pair]) for name, pair in pairs.items()})


def _joint(robot: Xml.Element, link: OutgoingLink, parent: str) -> None:
    ranged = link.low is not None or link.high is not None
    kind = "prismatic" if link.slides else ("revolute" if ranged else "continuous")
    joint = Xml.SubElement(robot, "joint", name=link.joint, type=kind)
    Xml.SubElement(joint, "parent", link=parent)
    Xml.SubElement(joint, "child", link=link.name)
    Xml.SubElement(joint, "origin", xyz=text_of(*link.place[:3, 3]), rpy=text_of(*link.angles))
    Xml.SubElement(joint, "axis", xyz="0 0 1")
    limit = Xml.SubElement(joint, "limit")
    if kind != "continuous":
        limit.set("lower", text_of(-NO_LIMIT if link.low is None else link.low))
        limit.set("upper", text_of(NO_LIMIT if link.high is None else link.high))
    effort = NO_LIMIT if link.drive_limit is None else abs(link.gain) * link.drive_limit
    limit.set("effort", text_of(min(effort, NO_LIMIT)))
    limit.set("velocity", text_of(NO_LIMIT if link.speed is None else link.speed))
    Xml.SubElement(joint, "dynamics", damping=text_of(link.viscous), friction=text_of(link.coulomb))
