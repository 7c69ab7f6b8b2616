"""Writes the rigid bodies of a true arm as text for MuJoCo, from standard Denavit–Hartenberg geometry."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

NO_INERTIA = 1e-9
"""kg·m² in place of a thin rod's 0: the engine requires a positive value."""


@dataclass(frozen=True)
class Link:
    """One link: a, α, d, offset of θ; mass; centre and principal inertias about it, in the axes of the link's end."""

    a: float
    alpha: float
    d: float
    theta: float
    mass: float
    centre: tuple[float, float, float]
    inertia: tuple[float, float, float]

    @staticmethod
    def rod(a: float, mass: float, alpha: float = 0.0, theta: float = 0.0, shift: float = 0.0) -> Link:
        """Returns a thin rod along a, its centre moved outwards by `shift`."""
        about = mass * a * a / 12
        return Link(a, alpha, 0.0, theta, mass, (-a / 2 + shift, 0.0, 0.0), (0.0, about, about))

    def heavier(self, mass: float) -> Link:
        """Returns the same shape with another mass."""
        factor = mass / self.mass
        about = (self.inertia[0] * factor, self.inertia[1] * factor, self.inertia[2] * factor)
        return replace(self, mass=mass, inertia=about)

    def shifted(self, shift: float) -> Link:
        """Returns the same with its centre farther along the link by `shift`."""
        return replace(self, centre=(self.centre[0] + shift, *self.centre[1:]))


@dataclass(frozen=True)
class Bodies:
    """An arm: links, a point mass at its end, gravity in the base axes of the machine file."""

    links: tuple[Link, ...]
    load: float
    gravity: tuple[float, float, float]

    def beyond(self, joint: int) -> float:
        """Returns the mass beyond a joint (from 0), kg."""
        return sum(link.mass for link in self.links[joint:]) + self.load


def mjcf(bodies: Bodies, rotors: tuple[float, ...]) -> str:
    """Returns one body per joint, at the joint and turning about its own z; `rotors` turn with their joints, kg·m²."""
    text, closing = [], []
    place, turn = "0 0 0", "1 0 0 0"
    for number, (link, rotor) in enumerate(zip(bodies.links, rotors, strict=True), start=1):
        half = (math.cos(link.theta / 2), math.sin(link.theta / 2))
        about_x = (math.cos(link.alpha / 2), math.sin(link.alpha / 2))
        ca, sa = math.cos(link.alpha), math.sin(link.alpha)
        x, y, z = link.centre
        centre = (link.a + x, ca * y - sa * z, link.d + sa * y + ca * z)
        about = [max(value, NO_INERTIA) for value in link.inertia]
        end = f"{link.a!r} 0 {link.d!r}"
        text.append(
            f'<body name="link_{number}" pos="{place}" quat="{turn}"><body name="turned_{number}" '
            f'quat="{half[0]!r} 0 0 {half[1]!r}"><joint axis="0 0 1" armature="{rotor!r}"/>'
            f'<inertial pos="{_text(centre)}" quat="{about_x[0]!r} {about_x[1]!r} 0 0" mass="{link.mass!r}" '
            f'diaginertia="{_text(about)}"/>'
        )
        closing.append("</body></body>")
        place, turn = end, f"{about_x[0]!r} {about_x[1]!r} 0 0"
    if bodies.load > 0:
        small = _text([NO_INERTIA] * 3)
        text.append(f'<body pos="{place}"><inertial pos="0 0 0" mass="{bodies.load!r}" diaginertia="{small}"/></body>')
    return (
        '<mujoco><compiler angle="radian"/>'
        f'<option gravity="{_text(bodies.gravity)}"><flag contact="disable" constraint="disable"/></option>'
        f"<worldbody>{''.join(text)}{''.join(closing)}</worldbody></mujoco>"
    )


def _text(values: tuple[float, ...] | list[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
