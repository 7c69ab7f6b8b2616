"""Small URDFs, sound and hostile."""

INERTIAL = (
    '<inertial><origin xyz="0.1 0 0.2" rpy="0.1 0.2 0.3"/><mass value="2"/>'
    '<inertia ixx="0.02" ixy="0" ixz="0.001" iyy="0.03" iyz="0" izz="0.02"/></inertial>'
)
TURNING = '<axis xyz="0 1 1"/><limit lower="-1" upper="2" effort="10" velocity="3"/>'


def link(name: str, content: str = INERTIAL) -> str:
    return f'<link name="{name}">{content}</link>'


def joint(name: str, parent: str, child: str, kind: str = "revolute", content: str = TURNING) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/>'
        f'<parent link="{parent}"/><child link="{child}"/>{content}</joint>'
    )


def robot(*parts: str, before: str = "") -> str:
    return f'<?xml version="1.0"?>{before}<robot name="Two arms">{"".join(parts)}</robot>'


def turning(content: str = TURNING, *, kind: str = "revolute", carried: str = INERTIAL) -> str:
    """One joint between two links."""
    return robot(link("a"), link("b", carried), joint("j", "a", "b", kind, content))


def unlike(number: str, other: str) -> str:
    """The same where one number of what it carries is another."""
    return turning(carried=INERTIAL.replace(f'"{number}"', f'"{other}"'))


TWO_JOINTS = robot(
    link("base"), link("upper"), link("lower"), joint("shoulder", "base", "upper"), joint("elbow", "upper", "lower")
)

_ENTITIES = '<!ENTITY a "ha">' + "".join(
    f'<!ENTITY {after} "{f"&{before};" * 10}">' for before, after in zip("abcdefgh", "bcdefghi", strict=True)
)
HOSTILE: dict[str, tuple[str, str]] = {
    "billion laughs": (robot(link("&i;"), before=f"<!DOCTYPE robot [{_ENTITIES}]>"), "an XML DOCTYPE or entities"),
    "an outside entity": (
        robot(link("a"), before='<!DOCTYPE robot [<!ENTITY secret SYSTEM "file:///etc/passwd">]>'),
        "an XML DOCTYPE or entities",
    ),
    "a million links": ("<robot>" + '<link name="a"/>' * 1_000_000 + "</robot>", "at most 8388608 are read"),
    "many links": ("<robot>" + '<link name="a"/>' * 2000 + "</robot>", "has more than 1000 links"),
    "many elements": ("<robot>" + "<x/>" * 500_000 + "</robot>", "XML elements"),
    "deep": ("<robot>" + "<x>" * 150_000 + "</x>" * 150_000 + "</robot>", "robot.urdf: "),
    "empty": ("", "not XML"),
    "no XML": ("[links]\n", "not XML"),
    "broken": ("<robot><link name='a'></robot>", "not XML: mismatched tag"),
    "MJCF": ('<mujoco><include file="/etc/passwd"/></mujoco>', "its outermost element is <mujoco>; a URDF has <robot>"),
    "no links": (robot(), "has no links"),
    "no joints": (robot(link("a")), "has no joint that moves"),
    "NaN inertia": (unlike("0.03", "nan"), "link 'b': inertia iyy is 'nan'; a finite number is needed"),
    "infinite mass": (unlike("2", "inf"), "link 'b': mass value is 'inf'"),
    "decimal comma": (unlike("2", "2,5"), "link 'b': mass value is '2,5'; a finite number is needed"),
    "negative mass": (unlike("2", "-2"), "link 'b': mass is -2.0 kg"),
    "negative moment": (unlike("0.03", "-0.03"), "what joint 'j' carries has the negative moment of inertia"),
    "two numbers for three": (
        turning('<axis xyz="0 1"/>'),
        "joint 'j': axis xyz is '0 1'; 3 finite numbers are needed",
    ),
    "an axis beyond measure": (
        turning('<axis xyz="1e308 1e308 0"/>'),
        "joint 'j': axis xyz is '1e308 1e308 0'; 3 finite numbers are needed, at most ±1e+09",
    ),
    "no axis to speak of": (
        turning('<axis xyz="0 0 0"/>'),
        "joint 'j': axis xyz is [0.0, 0.0, 0.0]; a direction is needed",
    ),
    "limits the wrong way round": (
        turning('<limit lower="2" upper="1"/>'),
        "joint 'j': limit lower 2.0 is above upper 1.0",
    ),
    "a loop": (
        robot(*map(link, "abc"), joint("j", "a", "b"), joint("k", "b", "c"), joint("m", "c", "a")),
        "link 'a' is part of a loop",
    ),
    "a loop beside the root": (
        robot(*map(link, "abc"), joint("k", "b", "c"), joint("m", "c", "b")),
        "link 'b' is part of a loop",
    ),
    "a closed chain": (
        robot(*map(link, "abc"), joint("j", "a", "b"), joint("k", "a", "c"), joint("m", "b", "c")),
        "joint 'm': its child 'c' is also the child of joint 'k': a loop",
    ),
    "two roots": (robot(*map(link, "abc"), joint("j", "a", "b")), "links 'a' and 'c' are both roots"),
    "the same link twice": (
        robot(link("a"), link("b"), link("b"), joint("j", "a", "b")),
        "link 'b': there is more than",
    ),
    "the same joint twice": (
        robot(*map(link, "abc"), joint("j", "a", "b"), joint("j", "b", "c")),
        "joint 'j': there is more than one of that name",
    ),
    "no such link": (
        robot(link("a"), joint("j", "a", "z")),
        "joint 'j': its child is 'z', but the file has no such link",
    ),
    "a floating joint": (turning(kind="floating"), "'j': is floating, it moves freely"),
    "a planar joint": (turning(kind="planar"), "'j': is planar, it moves in a plane"),
    "an unknown joint": (turning(kind="hinge"), "joint 'j': type is 'hinge'"),
    "a link without a name": (robot("<link/>"), "a <link> has no name"),
    "two arms": (
        robot(*map(link, "abc"), joint("left", "a", "b"), joint("right", "a", "c")),
        "joints 'left' and 'right' are on different branches; name those of one arm (--joints): it has left, right",
    ),
    "a mimic joint": (
        robot(
            *map(link, "abc"),
            joint("j", "a", "b"),
            joint("k", "b", "c", content=f'{TURNING}<mimic joint="j" multiplier="2"/>'),
        ),
        "joint 'k' mimics another; name the arm's independent joints (--joints): it has j, k",
    ),
    "nothing that moves": (robot(link("a"), link("b", ""), joint("j", "a", "b")), "joint 1 has no inertia"),
    "axes that are nearly parallel": (
        robot(
            *map(link, "abc"),
            joint("j", "a", "b", content='<axis xyz="0 0 1"/>'),
            '<joint name="k" type="continuous"><origin xyz="0.5 0 0" rpy="0 0.002 0"/><parent link="b"/>'
            '<child link="c"/><axis xyz="0 0 1"/></joint>',
        ),
        "axes of joints j and k: 0.002 rad from parallel",
    ),
}
"""URDFs that are refused, and what the one line says."""
