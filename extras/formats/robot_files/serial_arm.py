"""Extracts a serial arm from some joints of a robot; the others are held, and what they carry becomes one body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from daq.contracts.documents import shown
from daq.contracts.errors import SpecError
from extras.formats.robot_files.description import DescribedJoint, Description, turned
from model.arrays import Floats
from model.kinematics.chain import inertia_about


@dataclass(frozen=True, eq=False)
class RigidBody:
    """Mass (kg), centre of mass (3,) and inertia (3, 3) about it, in the axes of the robot's root."""

    mass: float
    centre: Floats
    inertia: Floats


@dataclass(frozen=True, eq=False)
class ArmJoint:
    """A joint of the arm, with the arm at 0: a point (3,) of its axis and its direction (3,), in the root's frame.

    body: everything that moves with it but with no later joint
    """

    joint: DescribedJoint
    point: Floats
    direction: Floats
    body: RigidBody


@dataclass(frozen=True, eq=False)
class SerialArm:
    """The arm, base first; the end (3,) of its last link in the root's frame, and the joints that are held.

    places: by link, its frame (4, 4) in the root's with the arm at 0, and the joint with which it moves; 0: the base
    """

    description: Description
    joints: tuple[ArmJoint, ...]
    tip: Floats
    held: dict[str, float]
    places: dict[str, tuple[Floats, int]]


def serial_arm(
    robot: Description,
    names: Sequence[str] | None = None,
    hold: Mapping[str, float] | None = None,
    tip: str | None = None,
) -> SerialArm:
    """Returns the arm that some joints of a robot form; the others are held.

    Args:
        names: joints that move, base first; None for all, if they form a chain.
        hold: positions of held joints, rad or m; 0 by default.
        tip: link whose frame is the end of the arm; None for the link of the last joint.

    Raises SpecError with one line for joints that do not exist, do not form a chain, or mimic another joint.
    """
    chain = _chain(robot, names)
    moving = {_joint(robot, link).name for link in chain}
    held = _held(robot, moving, hold or {})
    rotations, positions = _placed(robot, held)
    owner = _owners(robot, chain)
    joints = []
    for link in chain:
        joint = _joint(robot, link)
        members = [i for i, own in enumerate(owner) if own == link]
        body = _merged(robot, members, rotations, positions)
        joints.append(ArmJoint(joint, positions[link], rotations[link] @ joint.axis, body))
    places: dict[str, tuple[Floats, int]] = {}
    for member, turn, position, own in zip(robot.links, rotations, positions, owner, strict=True):
        frame = np.block([[turn, position[:, None]], [np.array([[0.0, 0.0, 0.0, 1.0]])]])
        places[member.name] = frame, 0 if own is None else chain.index(own) + 1
    return SerialArm(robot, tuple(joints), positions[_tip(robot, tip, owner, chain[-1])], held, places)


def _joint(robot: Description, link: int) -> DescribedJoint:
    joint = robot.links[link].joint
    assert joint is not None
    return joint


def _chain(robot: Description, names: Sequence[str] | None) -> list[int]:
    """Returns the links of the joints that move, base first."""
    known = robot.joints
    if not known:
        raise SpecError(f"{robot.origin}: has no joint that moves")
    if names is None:
        links = [link for name, link in known.items() if _joint(robot, link).follows is None]
        if len(links) != len(known):
            follower = next(n for n, link in known.items() if _joint(robot, link).follows is not None)
            raise SpecError(
                f"{robot.origin}: joint {shown(follower)} mimics another; name the arm's independent joints "
                f"(--joints): it has {_some(known)}"
            )
    else:
        if unknown := [name for name in names if name not in known]:
            raise SpecError(f"{robot.origin}: has no joint {shown(unknown[0])} that moves; it has {_some(known)}")
        if len(set(names)) < len(names) or not names:
            raise SpecError(f"--joints {','.join(names)}: name each joint once")
        links = [known[name] for name in names]
    links.sort(key=lambda link: len(robot.path(link)))
    for before, after in pairwise(links):
        if before not in robot.path(after):
            first, second = _joint(robot, before).name, _joint(robot, after).name
            raise SpecError(
                f"{robot.origin}: joints {shown(first)} and {shown(second)} are on different branches; "
                f"name those of one arm (--joints): it has {_some(known)}"
            )
    for link in links:
        joint = _joint(robot, link)
        if joint.follows is not None:
            raise SpecError(
                f"{robot.origin}: joint {shown(joint.name)} mimics {shown(joint.follows.leader)}; "
                "a model's joints are independent; leave it out, so that it is held"
            )
    return links


def _some(names: Mapping[str, int]) -> str:
    first = list(names)[:40]
    return ", ".join(map(str, first)) + (f" and {len(names) - 40} more" if len(names) > 40 else "")


def _held(robot: Description, moving: set[str], hold: Mapping[str, float]) -> dict[str, float]:
    """Returns the position of every joint that does not move."""
    known = robot.joints
    for name, value in hold.items():
        if name not in known or name in moving:
            reason = "it is one of the joints that move" if name in moving else "there is no such joint that moves"
            raise SpecError(f"--hold {name}={value}: {reason}")
        if not np.isfinite(value):
            raise SpecError(f"--hold {name}={value}: a finite position is needed")
    found = {name: float(hold.get(name, 0.0)) for name in known if name not in moving}
    for name in found:
        rule = _joint(robot, known[name]).follows
        if rule is None or name in hold:
            continue
        if rule.leader in moving:
            raise SpecError(
                f"{robot.origin}: joint {shown(name)} mimics {shown(rule.leader)}, which moves: a model's joints are "
                f"independent; leave {rule.leader} out, or hold it (--hold {name}=0)"
            )
        found[name] = rule.offset + rule.ratio * float(hold.get(rule.leader, 0.0))
    return found


def _placed(robot: Description, held: Mapping[str, float]) -> tuple[list[Floats], list[Floats]]:
    """Returns rotation and position of every link's frame in the root's, with moving joints at 0."""
    rotations: list[Floats] = []
    positions: list[Floats] = []
    for link in robot.links:
        if link.parent is None:
            rotations.append(np.eye(3))
            positions.append(np.zeros(3))
            continue
        rotation = rotations[link.parent] @ link.rotation
        position = positions[link.parent] + rotations[link.parent] @ link.position
        if link.joint is not None and (value := held.get(link.joint.name, 0.0)) != 0.0:
            if link.joint.kind == "prismatic":
                position = position + rotation @ (value * link.joint.axis)
            else:
                rotation = rotation @ turned(link.joint.axis, value)
        rotations.append(rotation)
        positions.append(position)
    return rotations, positions


def _owners(robot: Description, chain: Sequence[int]) -> list[int | None]:
    """Returns for every link the link of the chain with which it moves; None if it moves with the base."""
    owners: list[int | None] = []
    for i, link in enumerate(robot.links):
        above = None if link.parent is None else owners[link.parent]
        owners.append(i if i in chain else above)
    return owners


def _merged(robot: Description, members: Sequence[int], rotations: list[Floats], positions: list[Floats]) -> RigidBody:
    """Merges several links that move together into one body."""
    links = [robot.links[i] for i in members]
    centres = [positions[i] + rotations[i] @ robot.links[i].centre for i in members]
    mass = sum(link.mass for link in links)
    if mass > 0.0:
        centre = np.sum([link.mass * c for link, c in zip(links, centres, strict=True)], axis=0) / mass
    else:
        centre = centres[0]
    inertia = np.zeros((3, 3))
    for i, link, own in zip(members, links, centres, strict=True):
        inertia += inertia_about(link.mass, own - centre, rotations[i] @ link.inertia @ rotations[i].T)
    return RigidBody(float(mass), centre, inertia)


def _tip(robot: Description, name: str | None, owner: Sequence[int | None], last: int) -> int:
    if name is None:
        return last
    found = [i for i, link in enumerate(robot.links) if link.name == name]
    if not found or owner[found[0]] != last:
        own = [robot.links[i].name for i, moves_with in enumerate(owner) if moves_with == last]
        raise SpecError(f"--tip {name}: the last joint carries no such link; it carries {', '.join(own[:40])}")
    return found[0]
