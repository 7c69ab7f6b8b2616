"""A test rig with records: the rig of a kind and seed with its hidden effects, and its records."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.random import Generator

from trials.rigs.drawing import generator, sound_rig
from trials.rigs.engine import Floats, Motion, simulate
from trials.rigs.hiding import OPEN, drawn, effects_of, hide, joints_of
from trials.rigs.kinds import KINDS
from trials.rigs.parameters import BOARD
from trials.rigs.rig import Rig

CASES = ("sound", "single", "pair", "open")
"""Possible cases: no effect, one effect of a library, two, or one that is in none."""
CASE_OF_SEED = ("sound", "single", "single", "pair", "single", "open", "single", "sound", "single", "single")
"""The case of a seed by its last digit."""
SETTLING = 1.5
"""s at rest before a record begins."""
LARGEST_ERROR = 1.0
"""rad between set point and angle that no lab would accept."""
ATTEMPTS = 12
STIFFER = 1.25
"""Factor of a gear's own frequency between attempts."""
COLOURED_CORNER = 3.0
"""Hz of coloured noise."""
TRAINING, HELD_OUT = "training", "held_out"
RECORDS = (TRAINING, HELD_OUT)


@dataclass(frozen=True)
class RecordedRig:
    """A rig, its drawn case, and its records by name."""

    rig: Rig
    case: str
    records: dict[str, Motion]


def case_of(seed: int) -> str:
    """Returns the case of a seed if none is requested."""
    return CASE_OF_SEED[seed % len(CASE_OF_SEED)]


def make_rig(kind_name: str, seed: int, case: str | None = None, effect: str | None = None) -> RecordedRig:
    """Makes the rig of a seed with records, always exactly the same. `effect` hides only that one."""
    rig = hidden_rig(kind_name, seed, case, effect)
    return RecordedRig(
        rig, "single" if effect else case or case_of(seed), {name: record(rig, name) for name in RECORDS}
    )


@cache
def _sound_motion(kind_name: str, seed: int) -> Motion:
    rig = sound_rig(kind_name, KINDS[kind_name], seed)
    return simulate(rig.bodies, rig.joints, rig.loop, wanted(rig, TRAINING))


def hidden_rig(kind_name: str, seed: int, case: str | None = None, effect: str | None = None) -> Rig:
    """Returns the rig with its hidden effects, without its records."""
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
    """Returns the rig with an effect at a joint, drawn until its loop is stable; flexible gears become stiffer each
    time."""
    for attempt in range(ATTEMPTS):
        law, size = drawn(rig, motion, name, joint, draw)
        if "rate" in size:
            size["rate"] *= STIFFER**attempt
        made = hide(rig, name, joint, law, size)
        runs = (simulate(made.bodies, made.joints, made.loop, wanted(rig, each)) for each in RECORDS)
        if all(np.abs(run.set_point - run.angle).max() < LARGEST_ERROR for run in runs):
            return made
    raise ValueError(f"{rig.kind_name} {rig.seed}: its loop is not stable with {name} on joint {joint}")


def wanted(rig: Rig, name: str) -> Floats:
    """Returns set points (k, n) of a record, with the rest before it; in counts for a board-like controller."""
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
    """Returns a measured record of the rig, from the end of its settling."""
    asked = wanted(rig, name)
    noise = sensor_noise(rig, generator(rig.kind_name, rig.seed, f"noise of {name}"), asked.shape)
    taken = not_lost(rig, generator(rig.kind_name, rig.seed, f"losses of {name}"), asked)
    made = simulate(rig.bodies, rig.joints, rig.loop, taken, noise=noise)
    return without_settling(rig, replace(made, set_point=asked))  # a record has the sent set points


def not_lost(rig: Rig, draw: Generator, asked: Floats) -> Floats:
    """Returns set points (k, n) of the controller: each lost one is replaced by the previous."""
    taken = asked.copy()
    lost = draw.random(asked.shape) < rig.joints["lost"]
    for k in range(1, len(taken)):
        taken[k] = np.where(lost[k], taken[k - 1], asked[k])
    return taken


def without_settling(rig: Rig, motion: Motion) -> Motion:
    """Returns the record from the end of its settling."""
    first = round(SETTLING / float(rig.loop["period"][0]))
    kept = (motion.set_point, motion.position, motion.drive, motion.angle, motion.velocity)
    return Motion(motion.time[: motion.time.size - first], *(part[first:] for part in kept))


def sensor_noise(rig: Rig, draw: Generator, shape: tuple[int, ...]) -> Floats:
    """Returns noise (rad) of every reading: white, coloured, and occasional outliers."""
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


# --- Draws set points of a record: at rest first and last, within limits that the arm can follow


MOTIONS = ("ramps", "via points", "steps", "sweep", "sines", "random steps")
"""Kinds of motion in a record."""

REST = 0.4
"""s of rest at both ends of a record."""


def set_points(
    name: str, draw: Generator, centre: Floats, reach: Floats, speed: float, duration: float, period: float
) -> Floats:
    """Returns (k, n) rad around `centre` within ± `reach`, at most about `speed` rad/s; every joint has a motion of its
    own."""
    time = np.arange(round(duration / period)) * period
    columns = []
    for middle, half in zip(centre, reach, strict=True):
        columns.append(middle + _one(name, draw, float(half), speed, duration, time))
    return np.column_stack(columns)


def _one(name: str, draw: Generator, reach: float, speed: float, duration: float, time: Floats) -> Floats:
    if name in ("ramps", "via points"):
        return _between_points(draw, reach, speed, duration, time, smooth=name == "via points")
    window = np.clip((time - REST) / 1.0, 0.0, 1.0) * np.clip((duration - REST - time) / 1.0, 0.0, 1.0)
    window = window * window * (3.0 - 2.0 * window)
    if name == "sweep":
        low, high = 0.15, draw.uniform(1.5, 3.0)
        span = duration
        phase = 2 * math.pi * low * span / math.log(high / low) * (np.exp(time / span * math.log(high / low)) - 1.0)
        rate = low * np.exp(time / span * math.log(high / low))
        size = np.minimum(reach, speed / (2 * math.pi * rate))
        return window * size * np.sin(phase + draw.uniform(0, 2 * math.pi))
    if name == "sines":
        total = np.zeros_like(time)
        for low, high in ((0.1, 0.25), (0.3, 0.7), (0.8, 1.6)):
            rate = draw.uniform(low, high)
            size = min(0.5 * reach, 0.4 * speed / (2 * math.pi * rate))
            total += size * np.sin(2 * math.pi * rate * time + draw.uniform(0, 2 * math.pi))
        return window * total
    if name == "steps":
        return _levels(draw, time, duration, 0.25 * reach, 0.9, speed)
    if name == "random steps":
        return _levels(draw, time, duration, 0.15 * reach, 0.25, speed)
    raise ValueError(f"motion {name!r}: not known; available: {', '.join(MOTIONS)}")


def _levels(draw: Generator, time: Floats, duration: float, size: float, hold: float, speed: float) -> Floats:
    """Returns steps between levels within ± `size`, run at `speed`, so that no drive must follow a jump."""
    wanted, start = np.zeros_like(time), REST
    while start < duration - REST - hold:
        length = draw.uniform(0.6, 1.4) * hold
        wanted[(time >= start) & (time < start + length)] = draw.uniform(-size, size)
        start += length
    wanted[time >= duration - REST - 0.2] = 0.0
    out, most = np.zeros_like(time), 2.0 * speed * (time[1] - time[0])
    for k in range(1, time.size):
        out[k] = out[k - 1] + float(np.clip(wanted[k] - out[k - 1], -most, most))
    return out


def _between_points(
    draw: Generator, reach: float, speed: float, duration: float, time: Floats, *, smooth: bool
) -> Floats:
    """Moves from point to point, at constant speed with holds between, or by polynomials of the fifth degree."""
    out, start, here = np.zeros_like(time), REST, 0.0
    while True:
        there = float(draw.uniform(-reach, reach))
        there = there if abs(there - here) > 0.3 * reach else -math.copysign(0.8 * reach, here or there)
        pace = speed * float(draw.uniform(0.25, 1.0))
        length = abs(there - here) / pace * (1.875 if smooth else 1.0)
        if start + length > duration - REST:
            break
        share = np.clip((time - start) / length, 0.0, 1.0)
        share = share**3 * (10.0 - 15.0 * share + 6.0 * share**2) if smooth else share
        out = np.where(time >= start, here + (there - here) * share, out)
        start += length + (float(draw.uniform(0.0, 0.2)) if smooth else float(draw.uniform(0.1, 0.5)))
        here = there
    return out
