"""Draws the healthy rig of a kind: an arm, suitable motors, a stable controller, and the values that the file states.

Every value with a stated deviation is wrong by a random amount of that size, drawn anew for every seed.
"""

from __future__ import annotations

import math
import zlib

import numpy as np
from numpy.random import PCG64, Generator, SeedSequence

from trials.rigs.bodies import Bodies, Link
from trials.rigs.engine import step_within
from trials.rigs.kinds import CURRENT, Kind
from trials.rigs.loop import DAC_COUNTS
from trials.rigs.parameters import BOARD, CASCADE, LOOP, Records, joints
from trials.rigs.rig import Rig, Tolerance

GRAVITY = 9.81
STEP = 1e-4
"""s. Halving it moves no reading of the tests' arm by a tenth of a 16-bit count."""
ACCELERATION = 12.0
"""rad/s² that every motor can give its joint in addition to its weight."""
HEADROOM = 4.0
"""Volts of a current loop's amplifier, relative to those of its largest torque at rest. A loop without enough volts
gives less than is recorded, and no file of these rigs states that."""
WORST = 2.2
"""Truncation of drawn deviations, in their sizes."""
BOARD_PERIOD_DELAY = 0.3
"""Largest delay of a controller over its period, approximately."""


def generator(kind_name: str, seed: int, purpose: str) -> Generator:
    """Returns a separate stream for every purpose, so that a new draw in one leaves the others unchanged."""
    words = [zlib.crc32(kind_name.encode()), seed, zlib.crc32(purpose.encode())]
    return Generator(PCG64(SeedSequence(words)))


def sound_rig(kind_name: str, kind: Kind, seed: int) -> Rig:
    """Returns the rig of a seed without any hidden effect."""
    draw = generator(kind_name, seed, "arm")
    bodies, centre = _arm(kind, draw)
    speed = draw.uniform(1.0, 1.8)
    rate = float(draw.choice(kind.rate))
    supply = float(draw.choice([12.0, 24.0, 36.0, 48.0]))
    made = joints(kind.joints)
    loop = np.zeros(1, LOOP)
    step = step_within(1.0 / rate, STEP)
    loop["controller"], loop["period"], loop["step"] = kind.controller, 1.0 / rate, step
    loop["delay"] = step * round(draw.uniform(0.05, BOARD_PERIOD_DELAY) / rate / step)
    needed = []
    bits = int(draw.choice(kind.bits))
    for j in range(kind.joints):
        inertia, weight = _resistance_to_motion(bodies, j, made.size)
        strongest = 0.8 * weight + ACCELERATION * inertia
        needed.append(strongest)
        _drive(made[j : j + 1], draw, kind, supply, strongest, inertia, speed)
        _friction(made[j : j + 1], draw, kind, strongest, inertia, speed)
        made[j]["range"] = (1.5 if kind.controller == BOARD else 2.0) * math.pi
        made[j]["at_zero"] = -0.5 * made[j]["range"]
        made[j]["count"] = made[j]["range"] / 2**bits
        _gains(made[j : j + 1], draw, kind, 1.0 / rate, supply, inertia)
    if kind.controller == BOARD:
        made["dac_scale"] = made["p"].min() / int(draw.integers(2, 5))
        made["p"] = np.round(made["p"] / made["dac_scale"])
    reach = tuple(float(draw.uniform(0.6, 0.9)) for _ in range(kind.joints))
    return Rig(
        *(kind_name, kind, seed, bodies, made, loop, bodies, made.copy()),
        tolerances=_tolerances(kind, draw),
        strongest=tuple(needed),
        highest=supply,
        reach=reach,
        centre=centre,
        speed=speed,
    )


def _arm(kind: Kind, draw: Generator) -> tuple[Bodies, tuple[float, ...]]:
    """Returns bodies, and the posture about which the arm moves."""
    lengths = [float(draw.uniform(0.2, 0.45)) for _ in range(kind.joints)]
    density = float(draw.uniform(1.5, 4.0))
    masses = [density * a * float(draw.uniform(0.7, 1.3)) for a in lengths]
    load = float(draw.uniform(0.05, 0.3)) if draw.random() < 0.4 else 0.0
    if kind.joints <= 2:
        planar = [_link(kind, draw, a, m) for a, m in zip(lengths, masses, strict=True)]
        gravity = (0.0, 0.0, -GRAVITY) if kind.horizontal else (GRAVITY, 0.0, 0.0)
        return Bodies(tuple(planar), load, gravity), tuple(float(draw.uniform(-0.7, 0.7)) for _ in lengths)
    radius = float(draw.uniform(0.06, 0.1))
    waist_mass = float(draw.uniform(2.0, 4.0))
    about = 0.5 * waist_mass * radius**2
    waist = Link(0.0, math.pi / 2, 0.0, 0.0, waist_mass, (0.0, 0.0, 0.0), (about, about, about))
    links = [waist, *(_link(kind, draw, lengths[k], masses[k]) for k in (1, 2))]
    centre = [float(draw.uniform(-0.5, 0.5)), float(draw.uniform(0.6, 1.1)), float(draw.uniform(-1.0, -0.5))]
    for alpha in (math.pi / 2, -math.pi / 2, 0.0)[: kind.joints - 3]:
        mass = float(draw.uniform(0.3, 0.8))
        about = mass * float(draw.uniform(0.001, 0.002))
        d = float(draw.uniform(0.07, 0.1))
        middle = (0.0, -0.4 * d, 0.0) if alpha > 0 else ((0.0, 0.4 * d, 0.0) if alpha < 0 else (0.01, 0.0, -0.4 * d))
        links.append(Link(0.0, alpha, d, 0.0, mass, middle, (about, about, about)))
        centre.append(float(draw.uniform(-0.6, 0.6)))
    return Bodies(tuple(links), load, (0.0, 0.0, -GRAVITY)), tuple(centre)


def _link(kind: Kind, draw: Generator, a: float, mass: float) -> Link:
    """Returns a rod, or a body with a centre and inertia of its own."""
    if not kind.body:
        return Link.rod(a, mass)
    about = mass * a * a * float(draw.uniform(0.06, 0.12))
    thin = 0.1 * about
    return Link(a, 0.0, 0.0, 0.0, mass, (-a * float(draw.uniform(0.4, 0.6)), 0.0, 0.0), (thin, about, about))


def _resistance_to_motion(bodies: Bodies, joint: int, count: int) -> tuple[float, float]:
    """Returns the largest inertia (kg·m²) and weight (N·m) about a joint (from 0), stretched out."""
    first = bodies.links[joint]
    inertia, weight, away = first.inertia[1], 0.0, 0.0
    for number, link in enumerate(bodies.links[joint:]):
        to_centre = away + abs(link.a + link.centre[0]) + 0.5 * link.d
        if not (number == 0 and count >= 3 and joint == 0):
            inertia += link.mass * to_centre**2 + (link.inertia[2] if number else 0.0)
            weight += link.mass * GRAVITY * to_centre
        away += abs(link.a) + link.d
    inertia += bodies.load * away**2
    weight += bodies.load * GRAVITY * away
    upright = bodies.gravity[0] == 0.0 and (count <= 2 or joint == 0)
    return inertia, 0.0 if upright else weight


def _drive(
    joint: Records, draw: Generator, kind: Kind, supply: float, strongest: float, inertia: float, speed: float
) -> None:
    """Draws a motor and gear with `strongest` to spare, and a speed without load slightly above the needed one."""
    gear = float(np.exp(draw.uniform(math.log(20), math.log(250))))
    magnet = 0.9 * supply / (gear * speed * float(draw.uniform(1.7, 3.0)))
    stall = strongest * float(draw.uniform(2.5, 4.0))
    resistance = gear * magnet * supply / stall
    joint["gear"], joint["torque_constant"], joint["back_emf"] = gear, magnet, magnet
    joint["resistance"], joint["supply"] = resistance, supply * (HEADROOM if kind.drive == CURRENT else 1.0)
    joint["inductance"] = 1e-4 * resistance
    joint["rotor"] = inertia * float(draw.uniform(0.3, 1.2))
    if kind.drive == CURRENT:
        joint["current_rate"] = 2 * math.pi * float(draw.uniform(300, 600))
        joint["nominal_constant"] = gear * magnet


def _friction(joint: Records, draw: Generator, kind: Kind, strongest: float, inertia: float, speed: float) -> None:
    contact = int(draw.choice(kind.contacts))
    joint["viscous"] = strongest / speed * float(draw.uniform(0.02, 0.06))
    joint["coulomb"] = strongest * float(draw.uniform(0.03, 0.08)) if kind.rubs else 0.0
    all_of_it = inertia + float(joint["rotor"][0])
    joint["contact"] = contact
    joint["sign_width"] = max(4e-3, 0.1 * strongest / (all_of_it * 3000.0))
    joint["bristle"] = all_of_it * float(draw.uniform(250.0, 500.0)) ** 2
    joint["bristle_damping"] = 0.4 * np.sqrt(joint["bristle"] * all_of_it)


def _gains(joint: Records, draw: Generator, kind: Kind, period: float, supply: float, inertia: float) -> None:
    """Places poles of the joint alone, at its largest inertia; limits gains so that a count of the sensor has little
    effect."""
    p = joint[0]
    total = inertia + p["rotor"]
    if kind.drive == CURRENT:
        push, damping, highest = 1.0, p["viscous"], p["nominal_constant"] * supply / p["resistance"]
    else:
        push = p["gear"] * p["torque_constant"] / p["resistance"]
        damping, highest = push * p["gear"] * p["back_emf"] + p["viscous"], supply
    p["limit"] = highest * (kind.limit or 1.0)
    p["resolution"] = highest * kind.rounding
    if kind.controller == BOARD:
        rate = min(damping / (1.6 * total), 0.28 / period)
        p["counts_to_volts"] = supply / DAC_COUNTS
        p["p"] = rate**2 * total / push * p["count"] / p["counts_to_volts"]
        return
    rate = min(float(draw.uniform(14.0, 24.0)), 0.25 / period)
    if kind.controller == CASCADE:
        inner = 4.0 * rate
        p["inner_p"] = min(max(inner * total - damping, 0.2 * damping) / push, 0.1 * highest * period / p["count"])
        p["inner_i"] = p["inner_p"] * float(draw.uniform(0.5, 3.0))
        p["p"] = 0.6 * rate
        return
    p["p"] = rate**2 * total / push
    wished = max(0.0, 1.8 * rate * total - damping) / push
    p["d"] = min(wished, 0.1 * highest * period / p["count"])
    p["i"] = p["p"] * float(draw.uniform(0.0, 1.0)) if draw.random() < 0.5 else 0.0


def _tolerances(kind: Kind, draw: Generator) -> tuple[Tolerance, ...]:
    """Returns the values that the file states with a deviation, and the factor by which each is wrong."""
    shares: list[tuple[str, int | None, float]] = []
    for j in range(kind.joints):
        shares += [("mass", j, 0.06), ("rotor", j, 0.1), ("viscous", j, 0.3)]
        if kind.drive != CURRENT:
            shares += [("resistance", j, 0.05), ("magnet", j, 0.04)]
        if kind.rubs:
            shares.append(("coulomb", j, 0.3))
        if kind.body and j < 3 and not (j == 0 and kind.joints >= 3):
            shares += [("centre", j, 0.05), ("inertia", j, 0.1)]
    if kind.known_loop:
        shares.append(("delay", None, 0.15))
    drawn = []
    for name, joint, share in shares:
        off = float(draw.normal())
        while abs(off) > WORST:
            off = float(draw.normal())
        drawn.append(Tolerance(name, joint, 1.0 + share * off, share))
    return tuple(drawn)
