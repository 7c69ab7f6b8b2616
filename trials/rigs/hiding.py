"""Hides effects in a rig: each by one of several laws of the field, with a size that suits the joint."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from trials.rigs.bodies import Bodies
from trials.rigs.engine import Motion
from trials.rigs.kinds import CURRENT
from trials.rigs.parameters import BRISTLE, BY_CURRENT, JUMP, ONE_SIDED, PRESSING_WEIGHT, SWITCH, Records
from trials.rigs.rig import Hidden, Rig

WEAKENED_MAGNET = "weakened_magnet"
"""K_T and K_b depend on the same magnet, and change together."""
WHOLE_MACHINE = ("payload", "base_tilt")
BEFORE_THE_DRIVE = ("wrong_gain", "lost_set_points")
"""Effects that show only with a known controller."""
OF_VOLTS = ("motor_inductance", "dead_zone", "supply_limit", "resistance_drift", WEAKENED_MAGNET)
"""Effects that a current loop compensates, or that concern volts."""
ON_A_LENGTH = ("centre_of_mass", "link_mass")
"""Effects of links with a length."""
ACROSS_GRAVITY = ("load_dependent_friction",)
"""Effects of joints that are not vertical."""
OPEN = ("tight_spot", "quadratic_drag")
"""Effects of rigs that are drawn as open."""
IN_NO_LIBRARY = ("tight_spot",)
"""Those of them that are none of the library's: others were, and keep their draws."""


OTHER_NAMES: dict[str, dict[int, tuple[str, tuple[str, ...]]]] = {
    "load_dependent_friction": dict.fromkeys((1, 2), ("gravity_torque_friction", ())),
    # it is larger in one direction and smaller in the other than stated: a coefficient and a difference
    "viscous_friction": dict.fromkeys((1, 2), ("direction_dependent_viscous_friction", ("viscous_friction",))),
    # a loss that differs by direction is partly a change of the torque constant: the loss is its name (decision 0053)
    "gear_loss": dict.fromkeys((1, 2), ("gear_loss", ("direction_dependent_gear_loss",))),
    "dead_zone": {JUMP: ("amplifier_threshold", ())},
    "resistance_drift": {2: ("resistance_rise", ())},
    "spring_torque": {ONE_SIDED: ("one_sided_spring", ())},
}
"""By name and law: the library's name, and its parts, for effects that are another effect of the library."""

EVENLY_PRESSED = 3
"""If the axes of all joints up to this one keep their angle to gravity in every posture, a weight presses evenly there,
and friction under it is Coulomb friction."""
NAMED_BY_LAW = {"direction_dependent_gear_loss": ("gear_loss", 1)}
"""Laws of an effect that have a name of their own in the library."""

PRESSING_ARM = 0.3
"""m at which a pressing weight rubs, for a share of 1."""


@dataclass(frozen=True)
class Size:
    """Typical sizes of a joint: N·m, V, A, rad/s in the healthy arm's motion, and its range."""

    torque: float
    volts: float
    peak_volts: float
    current: float
    speed: float
    inertia: float
    length: float
    mass: float
    duration: float


def size_of(rig: Rig, motion: Motion, joint: int) -> Size:
    """Returns the sizes of joint `joint` (from 0) in the motion of the healthy arm."""
    p, link = rig.joints[joint], rig.bodies.links[joint]
    drive = motion.drive[:, joint]
    volts = drive if p["current_rate"] == 0 else np.zeros(1)
    return Size(
        torque=rig.strongest[joint],
        volts=float(np.sqrt(np.mean(volts**2))),
        peak_volts=float(np.abs(volts).max()),
        current=float(np.sqrt(np.mean(volts**2))) / float(p["resistance"]) * 0.5,
        speed=float(np.sqrt(np.mean(motion.velocity[:, joint] ** 2))),
        inertia=float(p["rotor"]),
        length=link.a or 0.1,
        mass=link.mass,
        duration=float(motion.time[-1]),
    )


def effects_of(rig: Rig) -> tuple[str, ...]:
    """Returns names of the effects that can be hidden in a rig, in a fixed order."""
    names = [*_SIZES, *WHOLE_MACHINE]
    if rig.kind.drive == CURRENT:
        names = [name for name in names if name not in OF_VOLTS]
    if not rig.kind.known_loop:
        names = [name for name in names if name not in BEFORE_THE_DRIVE]
    if rig.kind.joints <= 2 and not rig.kind.horizontal:
        names.remove("base_tilt")
    if rig.kind.horizontal:
        names = [name for name in names if name not in ("load_dependent_friction", "centre_of_mass")]
    return tuple(names)


def joints_of(rig: Rig, name: str) -> tuple[int | None, ...]:
    """Returns where an effect can be in a rig: joints from 1, or None for the whole machine."""
    if name in WHOLE_MACHINE:
        return (None,)
    places = range(1, rig.kind.joints + 1)
    if name in ON_A_LENGTH:
        return tuple(j for j in places if rig.bodies.links[j - 1].a > 0)
    if name in ACROSS_GRAVITY and rig.kind.joints > 2:
        return tuple(j for j in places if j > 1)
    return tuple(places)


def hide(rig: Rig, name: str, joint: int | None, law: int, size: dict[str, float]) -> Rig:
    """Returns the rig with an effect; sizes are fields of `parameters.JOINT`, or of the bodies."""
    known_as, beside = known(name, law)
    if name == "load_dependent_friction" and law == PRESSING_WEIGHT and joint is not None and joint <= EVENLY_PRESSED:
        known_as = "coulomb_friction"
    hidden = Hidden(name, joint, law, size, name not in IN_NO_LIBRARY, known_as, beside)
    changed, bodies = rig.joints.copy(), rig.bodies
    if joint is None:
        bodies = _changed_bodies(bodies, name, 0, size)
    else:
        _change(changed[joint - 1 : joint], name, law, size)
        bodies = _changed_bodies(bodies, name, joint - 1, size)
    return replace(rig, joints=changed, bodies=bodies, hidden=(*rig.hidden, hidden))


def known(name: str, law: int) -> tuple[str, tuple[str, ...]]:
    """Returns the library's name of an effect with a law, and the library's other effects that it includes.

    An effect that was drawn by one name may be another of the library's, by its law. Draws keep their own names, so
    that a seed always gives the same rig.
    """
    return OTHER_NAMES.get(name, {}).get(law, (name, ()))


def find_drawn_law(known_as: str) -> tuple[str, int]:
    """Returns the name by which an effect of the library is drawn, and its first law with that name in the library."""
    for name, others in OTHER_NAMES.items():
        for law, (other, _) in others.items():
            if other == known_as != name:
                return name, law
    return NAMED_BY_LAW.get(known_as, (known_as, 0))


def drawn(rig: Rig, motion: Motion, name: str, joint: int | None, draw: Generator) -> tuple[int, dict[str, float]]:
    """Draws a law of the kind, and sizes, for an effect at a joint (from 1)."""
    law = int(draw.choice(rig.kind.laws))
    if name == "payload":
        return law, {"load": float(draw.uniform(0.15, 0.4)) * rig.bodies.beyond(rig.kind.joints - 1)}
    if name == "base_tilt":
        turned = [float(draw.uniform(0.04, 0.12) * draw.choice([-1, 1])) for _ in range(2)]
        return law, {"about_x": turned[0], "about_y": turned[1]}
    assert joint is not None
    made = _SIZES[name](size_of(rig, motion, joint - 1), draw)
    if name == "input_delay":
        made["extra_delay"] *= float(rig.loop["period"][0])
    return law, made


def _up(low: float, high: float, draw: Generator) -> float:
    return float(np.exp(draw.uniform(math.log(low), math.log(high))))


def _sign(draw: Generator) -> float:
    return float(draw.choice([-1.0, 1.0]))


_SIZES: dict[str, Callable[[Size, Generator], dict[str, float]]] = {
    "viscous_friction": lambda s, d: {"viscous": s.torque / s.speed * _up(0.06, 0.2, d)},
    "coulomb_friction": lambda s, d: {"coulomb": s.torque * _up(0.06, 0.2, d)},
    "load_dependent_friction": lambda _, d: {"load_share": _up(0.06, 0.2, d)},
    "stribeck_friction": lambda s, d: {
        "stribeck": s.torque * _up(0.06, 0.2, d),
        "stribeck_speed": s.speed * _up(0.05, 0.3, d),
    },
    "stiction": lambda s, d: {"breakaway": s.torque * _up(0.06, 0.2, d)},
    "direction_dependent_friction": lambda s, d: {"direction": _sign(d) * s.torque * _up(0.05, 0.15, d)},
    "motor_inductance": lambda _, d: {"electric_time": _up(0.003, 0.015, d)},
    "dead_zone": lambda s, d: {"dead_zone": s.peak_volts * _up(0.04, 0.15, d)},
    "supply_limit": lambda s, d: {"supply": s.peak_volts * float(d.uniform(0.6, 0.85))},
    "resistance_drift": lambda s, d: {
        "rise": _up(0.1, 0.3, d),
        "cooling_time": float(d.uniform(20.0, 60.0)),
        "current": s.current,
        "duration": s.duration,
    },
    WEAKENED_MAGNET: lambda _, d: {"weaker": float(d.uniform(0.15, 0.3))},
    "torque_ripple": lambda s, d: {
        "ripple": s.torque * _up(0.03, 0.12, d),
        "ripple_cycles": float(d.integers(6, 25)),
        "ripple_phase": float(d.uniform(0, 2 * math.pi)),
    },
    "gear_loss": lambda _, d: {"gear_loss": _up(0.1, 0.3, d)},
    "backlash": lambda _, d: {"gap": _up(0.006, 0.03, d), "rate": _up(300.0, 700.0, d)},
    "joint_compliance": lambda _, d: {"rate": _up(50.0, 110.0, d)},
    "link_mass": lambda s, d: {"mass": s.mass * _up(0.25, 0.6, d)},
    "centre_of_mass": lambda s, d: {"shift": s.length * _sign(d) * _up(0.1, 0.25, d)},
    "spring_torque": lambda s, d: {
        "spring": s.torque * _up(0.1, 0.4, d),
        "spring_rest": float(d.uniform(-0.5, 0.5)),
    },
    "periodic_disturbance": lambda s, d: {
        "disturbance": s.torque * _up(0.04, 0.12, d),
        "disturbance_frequency": _up(0.7, 4.0, d),
        "disturbance_phase": float(d.uniform(0, 2 * math.pi)),
    },
    "potentiometer_gain": lambda _, d: {"sensor_gain": _sign(d) * _up(0.03, 0.08, d)},
    "potentiometer_offset": lambda _, d: {"sensor_offset": _sign(d) * _up(0.03, 0.1, d)},
    "potentiometer_nonlinearity": lambda _, d: {"bend": _sign(d) * _up(0.01, 0.04, d)},
    "input_delay": lambda _, d: {"extra_delay": float(d.uniform(0.6, 2.5))},
    "wrong_gain": lambda _, d: {"gain_error": _sign(d) * float(d.uniform(0.12, 0.3))},
    "lost_set_points": lambda _, d: {"lost": float(d.uniform(0.3, 0.9))},
    "tight_spot": lambda s, d: {
        "tight": s.torque * _up(0.1, 0.3, d),
        "tight_at": float(d.uniform(-0.3, 0.3)),
        "tight_width": float(d.uniform(0.1, 0.25)),
    },
    "quadratic_drag": lambda s, d: {"drag": s.torque / s.speed**2 * _up(0.08, 0.25, d)},
}
"""Sizes of the effects of joints, relative to the joint's own. Some are converted to fields when they are hidden."""

DRAWN = (*_SIZES, *WHOLE_MACHINE)
"""Names by which effects are drawn."""

_LAW_FIELD = {
    "load_dependent_friction": "load_law",
    "stribeck_friction": "stribeck_law",
    "dead_zone": "dead_law",
    "torque_ripple": "ripple_law",
    "gear_loss": "loss_law",
    "backlash": "contact_law",
    "spring_torque": "spring_law",
    "periodic_disturbance": "disturbance_law",
    "potentiometer_nonlinearity": "bend_law",
}
"""The field for the law of an effect; the others have one law, or friction's contact is theirs."""


def _change(joint: Records, name: str, law: int, size: dict[str, float]) -> None:
    """Adds the effect to a record of one joint. The arm's own effects are added to, and keep their law."""
    p = joint[0]
    if name in _LAW_FIELD:
        p[_LAW_FIELD[name]] = law
    if name in ("viscous_friction", "coulomb_friction"):
        field = "viscous" if name == "viscous_friction" else "coulomb"
        p[field] += size[field]
        if field == "viscous":
            p["viscous_law"] = 2.0 if law else 0.0
    elif name == "load_dependent_friction":
        p["load_arm"] = size["load_share"] * (1.0 if law else PRESSING_ARM)
        p["load_law"] = 1.0 if law else 0.0
    elif name == "stiction":
        p["contact"] = BRISTLE if p["contact"] == BRISTLE else SWITCH
        p["breakaway"], p["dwell"] = size["breakaway"], (1e-4 if law == 0 else 0.1)
    elif name == "motor_inductance":
        p["inductance"] = size["electric_time"] * p["resistance"]
    elif name == "resistance_drift":
        heat = size["rise"] / (min(size["cooling_time"], size["duration"]) * 0.6)
        p["heat_law"], p["cooling_time"] = (1.0 if law == 2 else BY_CURRENT), size["cooling_time"]
        p["heating"] = heat / (size["current"] ** 2 if p["heat_law"] == BY_CURRENT else 1.0)
    elif name == WEAKENED_MAGNET:
        p["torque_constant"] *= 1.0 - size["weaker"]
        p["back_emf"] *= 1.0 - size["weaker"]
    elif name in ("backlash", "joint_compliance"):
        p["flexible"], p["gap"] = 1.0, size.get("gap", 0.0)
        p["contact_law"] = law if name == "backlash" else (1.0 if law == 1 else 0.0)
        p["stiffness"] = size["rate"] ** 2 * p["rotor"]
        p["flexible_damping"] = 0.2 * size["rate"] * p["rotor"]
    elif name not in ("link_mass", "centre_of_mass"):
        for field, value in size.items():
            p[field] = value


def _changed_bodies(bodies: Bodies, name: str, joint: int, size: dict[str, float]) -> Bodies:
    links = list(bodies.links)
    if name == "payload":
        return replace(bodies, load=bodies.load + size["load"])
    if name == "base_tilt":
        return replace(bodies, gravity=tilted(bodies.gravity, size["about_x"], size["about_y"]))
    if name == "link_mass":
        links[joint] = links[joint].heavier(links[joint].mass + size["mass"])
    elif name == "centre_of_mass":
        links[joint] = links[joint].shifted(size["shift"])
    return replace(bodies, links=tuple(links))


def tilted(gravity: tuple[float, float, float], about_x: float, about_y: float) -> tuple[float, float, float]:
    """Returns gravity in the axes of a base that was turned by `about_y` about its y, then by `about_x` about its x."""
    x, y, z = gravity
    y, z = y * math.cos(about_x) + z * math.sin(about_x), -y * math.sin(about_x) + z * math.cos(about_x)
    x, z = x * math.cos(about_y) - z * math.sin(about_y), x * math.sin(about_y) + z * math.cos(about_y)
    return (x, y, z)
