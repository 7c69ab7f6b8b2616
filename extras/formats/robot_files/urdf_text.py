"""Checks the text of a URDF before a C++ reader parses it, and extracts data that this reader ignores.

Every fault is reported in one line that names the link or joint.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from xml.etree import ElementTree as Xml

from daq.contracts.documents import shown
from daq.contracts.errors import SpecError
from extras.formats.robot_files.description import Follower

LARGEST = 8 << 20
"""Size (characters) of the largest accepted URDF; a humanoid's has a tenth of it."""
MOST_LINKS = 1000
"""Most links of an accepted URDF; reading time is proportional to the square of their number."""
MOST_ELEMENTS = 200_000
"""Most XML elements of an accepted URDF."""

LONGEST = 20.0
"""Length (m) beyond any arm's; Canadarm2, the longest, has 17.6 m."""
FULL_TURN = math.tau + 1e-2
"""Largest angle (rad) of an origin's turn, with its rounding."""
MOST_TURNS = 4
"""Turns of a joint with limits beyond which they are doubted: cables through a joint allow two or three."""
DENSEST = 9 * 22_600.0
"""Largest mass (kg) by the cube of half the sum of its moments' radius (m³): a ball of osmium, the densest matter (22
600 kg/m³), has m/r³ = 4π/3 ρ and a radius of 0.775 r; every other shape has less."""
XACRO = "is xacro that was not expanded; make a URDF of it first: `xacro FILE > robot.urdf`"

NO_LIMIT = 1e9
"""Value from which a limit counts as none: a URDF must state limits for a prismatic joint, even if it has none."""

MOVING = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}
"""Joint types that a machine can have, and their names there."""
_REFUSED = {"planar": "moves in a plane", "floating": "moves freely", "spherical": "turns about a point"}

_OF_BODIES = ("origin", "mass", "inertia", "axis")
"""Elements whose values are used in computations; NO_LIMIT bounds them. Limits may have any size."""
_NUMBERS: dict[str, dict[str, int]] = {
    "origin": {"xyz": 3, "rpy": 3},
    "mass": {"value": 1},
    "inertia": dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 1),
    "axis": {"xyz": 3},
    "limit": dict.fromkeys(("lower", "upper", "effort", "velocity"), 1),
    "dynamics": {"damping": 1, "friction": 1},
    "mimic": {"multiplier": 1, "offset": 1},
    "safety_controller": {"soft_lower_limit": 1, "soft_upper_limit": 1},
}
"""Number of values in the attributes of an element."""


@dataclass(frozen=True)
class JointText:
    """Data of a joint in the URDF, besides its place and axis; None if the file states none."""

    kind: str
    low: float | None
    high: float | None
    speed: float | None
    effort: float | None
    damping: float | None
    friction: float | None
    follows: Follower | None


@dataclass(frozen=True)
class CheckedUrdf:
    """A URDF whose links form one tree and whose values are finite.

    parents: parent's name of every link but the root
    joint_of: name of the joint between each of these links and its parent
    """

    name: str
    root: str
    parents: dict[str, str]
    joint_of: dict[str, str]
    joints: dict[str, JointText]
    doubts: tuple[str, ...] = ()
    """One line for each value that seems to be in a unit other than URDF's m, kg, kg·m² and rad."""


def checked_urdf(text: str, origin: str) -> CheckedUrdf:
    """Returns the names, limits and tree of a URDF. Raises SpecError with one line, which begins with `origin`."""
    robot = _robot(text, origin)
    links = [_name(link, origin) for link in robot.findall("link")]
    joints = robot.findall("joint")
    for kind, names in (("link", links), ("joint", [_name(joint, origin) for joint in joints])):
        if repeated := [name for name, count in Counter(names).items() if count > 1]:
            raise SpecError(f"{origin}: {kind} {shown(repeated[0])}: there is more than one of that name")
    for link in robot.findall("link"):
        _check_inertial(link, origin)
    found = {_name(joint, origin): _joint(joint, origin) for joint in joints}
    root, parents, joint_of = _tree(links, joints, origin)
    return CheckedUrdf(robot.get("name") or "robot", root, parents, joint_of, found, tuple(_doubts(robot)))


def _robot(text: str, origin: str) -> Xml.Element:
    if len(text) > LARGEST:
        raise SpecError(f"{origin}: has {len(text)} characters; at most {LARGEST} are read")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise SpecError(f"{origin}: has an XML DOCTYPE or entities, which no URDF needs; they are not read")
    for start, most, what in (("<link", MOST_LINKS, "links"), ("<", 2 * MOST_ELEMENTS, "XML elements")):
        if text.count(start) > most:
            raise SpecError(f"{origin}: has more than {most} {what}; name the arm's own file")
    try:
        root = Xml.fromstring(text)
    except (Xml.ParseError, ValueError, RecursionError) as error:
        if "<xacro:" in text:
            raise SpecError(f"{origin}: {XACRO}") from error
        raise SpecError(f"{origin}: not XML: {error}") from error
    if any("xacro" in element.tag.rpartition("}")[0] for element in root.iter()):
        raise SpecError(f"{origin}: {XACRO}")
    space, brace, _ = root.tag.rpartition("}")
    if brace:  # a default namespace, which no other URDF reader supports
        for element in root.iter():
            element.tag = element.tag.removeprefix(space + brace)
    if root.tag != "robot":
        raise SpecError(f"{origin}: its outermost element is <{shown(root.tag)[1:-1]}>; a URDF has <robot>")
    return root


def _name(element: Xml.Element, origin: str) -> str:
    name = element.get("name")
    if not name:
        raise SpecError(f"{origin}: a <{element.tag}> has no name")
    return name


def _numbers(element: Xml.Element | None, attribute: str, where: str) -> list[float] | None:
    """Returns the values of an attribute; None if it is missing. Raises SpecError with one line."""
    text = None if element is None else element.get(attribute)
    if element is None or text is None:
        return None
    count = _NUMBERS[element.tag][attribute]
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    most = NO_LIMIT if element.tag in _OF_BODIES else math.nextafter(math.inf, 0.0)
    if len(values) != count or not all(abs(value) <= most for value in values):
        needed = "a finite number is needed" if count == 1 else f"{count} finite numbers are needed"
        needed += f", at most ±{most:g}" if any(most < abs(value) < math.inf for value in values) else ""
        raise SpecError(f"{where}: {element.tag} {attribute} is {shown(text)}; {needed}")
    return values


def _number(element: Xml.Element | None, attribute: str, where: str) -> float | None:
    values = _numbers(element, attribute, where)
    return None if values is None else values[0]


def _not_negative(element: Xml.Element | None, attribute: str, where: str) -> float | None:
    value = _number(element, attribute, where)
    if value is not None and value < 0:
        raise SpecError(f"{where}: {attribute} is {value}; 0 or a positive number is needed")
    return value


def _check_inertial(link: Xml.Element, origin: str) -> None:
    where = f"{origin}: link {shown(link.get('name'))}"
    for tag in ("origin", "mass", "inertia"):
        for attribute in _NUMBERS[tag]:
            value = _numbers(link.find(f"inertial/{tag}"), attribute, where)
            if value is not None and value[0] < 0 and tag == "mass":
                raise SpecError(f"{where}: mass is {value[0]} kg; 0 or a positive number is needed")


def _joint(joint: Xml.Element, origin: str) -> JointText:
    where = f"{origin}: joint {shown(joint.get('name'))}"
    kind = joint.get("type", "")
    if kind in _REFUSED:
        raise SpecError(
            f"{where}: is {kind}, it {_REFUSED[kind]}; an arm's joints must be {', '.join(MOVING)} or fixed"
        )
    if kind not in MOVING and kind != "fixed":
        raise SpecError(f"{where}: type is {shown(kind)}; an arm's joints must be {', '.join(MOVING)} or fixed")
    _numbers(joint.find("origin"), "xyz", where)
    _numbers(joint.find("origin"), "rpy", where)
    axis = _numbers(joint.find("axis"), "xyz", where)
    if axis is not None and kind in MOVING and math.hypot(*axis) < 1e-6:
        raise SpecError(f"{where}: axis xyz is {axis}; a direction is needed")
    limit, dynamics, mimic = joint.find("limit"), joint.find("dynamics"), joint.find("mimic")
    for end in _NUMBERS["safety_controller"]:
        _number(joint.find("safety_controller"), end, where)
    low, high = (_number(limit, end, where) or 0.0 for end in ("lower", "upper"))
    if low > high:
        raise SpecError(f"{where}: limit lower {low} is above upper {high}")
    stated = low < high and kind != "continuous"  # both 0: a file that states no limits
    leader = None if mimic is None else mimic.get("joint")
    ratio, offset = _number(mimic, "multiplier", where), _number(mimic, "offset", where)
    return JointText(
        kind,
        low if stated and low > -NO_LIMIT else None,
        high if stated and high < NO_LIMIT else None,
        _largest(_number(limit, "velocity", where)),
        _largest(_number(limit, "effort", where)),
        _not_negative(dynamics, "damping", where),
        _not_negative(dynamics, "friction", where),
        None if leader is None else Follower(leader, 1.0 if ratio is None else ratio, offset or 0.0),
    )


def _doubts(robot: Xml.Element) -> Iterator[str]:
    """Yields values that no arm has in URDF's units; their format has already been checked."""
    origins = [origin for joint in robot.findall("joint") if (origin := joint.find("origin")) is not None]
    reach = sum(math.hypot(*(_numbers(origin, "xyz", "") or (0.0,))) for origin in origins)
    if reach > LONGEST:
        yield f"its joints are {reach:.4g} m apart in all, more than any arm's: are lengths in mm?"
    turns = [abs(angle) for origin in origins for angle in _numbers(origin, "rpy", "") or ()]
    limits = [
        abs(_number(joint.find("limit"), end, "") or 0.0)
        for joint in robot.findall("joint")
        for end in ("lower", "upper")
        if joint.get("type") == "revolute"
    ]
    soft = [shown(joint.get("name")) for joint in robot.findall("joint") if _is_softer(joint)]
    if soft:
        yield f"joint {', '.join(soft)}: the soft limits of its safety_controller are narrower, and are not imported"
    if any((ratio.text or "").strip() not in ("", "1", "1.0") for ratio in robot.iter("mechanicalReduction")):
        yield "a mechanicalReduction of its transmissions is not imported: state gear_ratio in the machine file"
    if max(turns, default=0.0) > FULL_TURN:
        yield f"an origin is turned by rpy {max(turns):.4g} rad, more than once round: are angles in degrees?"
    if NO_LIMIT > max(limits, default=0.0) > MOST_TURNS * FULL_TURN:
        yield f"a joint turns up to {max(limits):.4g} rad, more than {MOST_TURNS} times round: are limits in degrees?"
    for link in robot.findall("link"):
        mass = _number(link.find("inertial/mass"), "value", "") or 0.0
        moments = [_number(link.find("inertial/inertia"), axis, "") or 0.0 for axis in ("ixx", "iyy", "izz")]
        if mass <= 0.0 or min(moments) <= 0.0:
            continue
        radius = math.sqrt(sum(moments) / (2.0 * mass))
        if radius > LONGEST or mass > DENSEST * radius**3:
            what = f"{mass:.4g} kg with moments to {max(moments):.4g} kg·m²"
            yield f"link {shown(link.get('name'))} has {what}, which no body has: are they in g, mm or placeholders?"
            return


def _is_softer(joint: Xml.Element) -> bool:
    """Whether a joint has soft limits within its limits; both 0 means none."""
    ends = ("lower", "upper")
    low, high = (_number(joint.find("limit"), end, "") or 0.0 for end in ends)
    softer, stricter = (_number(joint.find("safety_controller"), f"soft_{end}_limit", "") or 0.0 for end in ends)
    return softer < stricter and (softer > low or stricter < high)


def _largest(limit: float | None) -> float | None:
    """Returns a limit of speed or effort; None if it is 0, which files use for no limit."""
    return limit if limit is not None and 0.0 < limit < NO_LIMIT else None


def _tree(links: list[str], joints: list[Xml.Element], origin: str) -> tuple[str, dict[str, str], dict[str, str]]:
    """Returns the root, and parent and joint of every other link. Raises SpecError unless they form one tree."""
    known, parents, joint_of = set(links), dict[str, str](), dict[str, str]()
    for joint in joints:
        where = f"{origin}: joint {shown(joint.get('name'))}"
        ends = {}
        for end in ("parent", "child"):
            element = joint.find(end)
            ends[end] = "" if element is None else element.get("link", "")
            if ends[end] not in known:
                raise SpecError(f"{where}: its {end} is {shown(ends[end])}, but the file has no such link")
        if ends["child"] in parents:
            before = joint_of[ends["child"]]
            raise SpecError(
                f"{where}: its child {shown(ends['child'])} is also the child of joint {shown(before)}: a loop"
            )
        parents[ends["child"]], joint_of[ends["child"]] = ends["parent"], joint.get("name", "")
    roots = [name for name in links if name not in parents]
    if len(roots) > 1:
        raise SpecError(f"{origin}: links {shown(roots[0])} and {shown(roots[1])} are both roots; one is needed")
    reached, waiting = set(roots), list(roots)
    while waiting:
        parent = waiting.pop()
        below = [child for child, above in parents.items() if above == parent]
        reached.update(below)
        waiting += below
    if missed := [name for name in links if name not in reached]:
        raise SpecError(f"{origin}: link {shown(missed[0])} is part of a loop; links must form a tree")
    if not links:
        raise SpecError(f"{origin}: has no links")
    return roots[0], parents, joint_of
