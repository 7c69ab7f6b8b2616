"""A world: the rig of a kind and seed with what is hidden in it, and its records."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.random import Generator

from trials.rigs.drawing import generator, sound_rig
from trials.rigs.engine import Floats, Motion, simulate
from trials.rigs.hiding import OPEN, drawn, effects_of, hide, joints_of
from trials.rigs.kinds import KINDS
from trials.rigs.motions import set_points
from trials.rigs.parameters import BOARD
from trials.rigs.rig import Rig

CASES = ("sound", "single", "pair", "open")
"""What may be hidden: nothing, one effect of a library, two, or one that is in none."""
CASE_OF_SEED = ("sound", "single", "single", "pair", "single", "open", "single", "sound", "single", "single")
"""The case of a seed by its last digit."""
SETTLING = 1.5
"""s at rest before a record begins."""
LARGEST_ERROR = 1.0
"""rad between set point and angle that no lab would let pass."""
ATTEMPTS = 12
STIFFER = 1.25
"""Factor of a gear's own frequency between attempts."""
COLOURED_CORNER = 3.0
"""Hz of coloured noise."""
TRAINING, HELD_OUT = "training", "held_out"
RECORDS = (TRAINING, HELD_OUT)


@dataclass(frozen=True)
class World:
    """A rig, the case that was drawn, and its records by name."""

    rig: Rig
    case: str
    records: dict[str, Motion]


def case_of(seed: int) -> str:
    """The case of a seed where none is asked for."""
    return CASE_OF_SEED[seed % len(CASE_OF_SEED)]


def make_world(kind_name: str, seed: int, case: str | None = None, effect: str | None = None) -> World:
    """The world of a seed, the same to the bit whenever it is made. `effect` hides that one and no other."""
    rig = hidden_rig(kind_name, seed, case, effect)
    return World(rig, "single" if effect else case or case_of(seed), {name: record(rig, name) for name in RECORDS})


@cache
def _sound_motion(kind_name: str, seed: int) -> Motion:
    rig = sound_rig(kind_name, KINDS[kind_name], seed)
    return simulate(rig.bodies, rig.joints, rig.loop, wanted(rig, TRAINING))


def hidden_rig(kind_name: str, seed: int, case: str | None = None, effect: str | None = None) -> Rig:
    """The rig with what is hidden in it, without its records."""
    rig = sound_rig(kind_name, KINDS[kind_name], seed)
    case = case or case_of(seed)
    draw = generator(kind_name, seed, "hidden")
    if case == "sound" and effect is None:
        return rig
    motion = _sound_motion(kind_name, seed)
    known = [name for name in effects_of(rig) if name not in OPEN]
    if effect is not None:
        names = [effect]
    elif case == "open":
        names = [str(draw.choice(OPEN))]
    else:
        names = [str(name) for name in draw.choice(known, 2 if case == "pair" else 1, replace=False)]
    for name in names:
        places = joints_of(rig, name)
        joint = places[int(draw.integers(len(places)))]
        rig = _hidden(rig, motion, name, joint, draw)
    return rig


def _hidden(rig: Rig, motion: Motion, name: str, joint: int | None, draw: Generator) -> Rig:
    """The rig with an effect at a joint, drawn until the loop bears it; gears that give become stiffer each time."""
    for attempt in range(ATTEMPTS):
        law, size = drawn(rig, motion, name, joint, draw)
        if "rate" in size:
            size["rate"] *= STIFFER**attempt
        made = hide(rig, name, joint, law, size)
        runs = (simulate(made.bodies, made.joints, made.loop, wanted(rig, each)) for each in RECORDS)
        if all(np.abs(run.set_point - run.angle).max() < LARGEST_ERROR for run in runs):
            return made
    raise ValueError(f"{rig.kind_name} {rig.seed}: its loop does not bear {name} on joint {joint}")


def wanted(rig: Rig, name: str) -> Floats:
    """Set points (k, n) of a record, with the rest before it; a board-like controller takes them in counts."""
    draw = generator(rig.kind_name, rig.seed, f"motion of {name}")
    period = float(rig.loop["period"][0])
    kind_of_motion = str(draw.choice(rig.kind.motions))
    duration = rig.kind.duration if name == TRAINING else 0.7 * rig.kind.duration
    centre, reach = np.array(rig.centre), np.array(rig.reach)
    asked = set_points(kind_of_motion, draw, centre, reach, rig.speed, duration, period)
    asked = np.concatenate([np.repeat(asked[:1], round(SETTLING / period), axis=0), asked])
    if rig.kind.controller == BOARD:
        zero, count = rig.joints["at_zero"], rig.joints["count"]
        asked = zero + count * np.floor((asked - zero) / count + 0.5)
    return np.ascontiguousarray(asked)


def record(rig: Rig, name: str) -> Motion:
    """A record of the rig as it is measured, from the end of its settling."""
    asked = wanted(rig, name)
    noise = sensor_noise(rig, generator(rig.kind_name, rig.seed, f"noise of {name}"), asked.shape)
    taken = not_lost(rig, generator(rig.kind_name, rig.seed, f"losses of {name}"), asked)
    made = simulate(rig.bodies, rig.joints, rig.loop, taken, noise=noise)
    return without_settling(rig, replace(made, set_point=asked))  # a record has what was sent


def not_lost(rig: Rig, draw: Generator, asked: Floats) -> Floats:
    """Set points (k, n) that the controller works with: for each one that is lost, the one that it had before."""
    taken = asked.copy()
    lost = draw.random(asked.shape) < rig.joints["lost"]
    for k in range(1, len(taken)):
        taken[k] = np.where(lost[k], taken[k - 1], asked[k])
    return taken


def without_settling(rig: Rig, motion: Motion) -> Motion:
    """The record that begins where its settling ends."""
    first = round(SETTLING / float(rig.loop["period"][0]))
    kept = (motion.set_point, motion.position, motion.drive, motion.angle, motion.velocity)
    return Motion(motion.time[: motion.time.size - first], *(part[first:] for part in kept))


def sensor_noise(rig: Rig, draw: Generator, shape: tuple[int, ...]) -> Floats:
    """Noise (rad) of every reading: white, coloured, and now and then far off."""
    kind = rig.kind
    noise = kind.noise * draw.standard_normal(shape)
    if kind.coloured:
        pole = np.exp(-2 * np.pi * COLOURED_CORNER * float(rig.loop["period"][0]))
        slow, drive = np.zeros(shape), np.sqrt(1 - pole**2) * draw.standard_normal(shape)
        slow[0] = draw.standard_normal(shape[1])
        for k in range(1, shape[0]):
            slow[k] = pole * slow[k - 1] + drive[k]
        noise += kind.coloured * slow
    if kind.outliers:
        far = draw.uniform(5.0, 20.0, shape) * draw.choice([-1.0, 1.0], shape)
        noise += np.where(draw.random(shape) < kind.outliers, far, 0.0)
    return np.asarray(noise * rig.joints["count"])
