"""Named experiments: the source's ramp, the diagnostic set, which distinguishes hidden effects, and a held-out trace.

The diagnostic set has five parts, each for effects that the others confuse. A excites one joint at a time. B reverses
slowly (friction). C makes small steps (quantiser, dead zone, backlash). D is fast and saturates every drive (gain
against viscous friction against sensor gain, supply limit). E repeats ramps and slow reversals at a second posture
(load, posture-dependent effects). Amplitudes and times are choices for the MA2000's joints 1–3 at P = 2: its drives
saturate at 63.5 ADC counts (4.2°) of error, and its set points pause at 127 (8.4°).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from daq.contracts.errors import SpecError
from daq.contracts.experiment import (
    Cubic,
    ExperimentSpec,
    Multisine,
    Pause,
    Ramp,
    Segment,
    Sequence,
    Simple,
    SlowRamp,
    Staircase,
    Step,
)

MAJOR = (1, 2, 3)


@dataclass(frozen=True)
class Preset:
    """A named experiment, with a line about its purpose."""

    description: str
    spec: ExperimentSpec = field(repr=False)


def preset(name: str) -> Preset:
    """Returns the preset of this name. Raises SpecError with the existing names."""
    if name not in PRESETS:
        raise SpecError(f"preset {name!r}: unknown; allowed are {', '.join(PRESETS)}")
    return PRESETS[name]


def _by_joint(*degrees: float) -> dict[int, float]:
    return {joint: math.radians(amplitude) for joint, amplitude in zip(MAJOR, degrees, strict=True)}


def _segment(move: Simple, *joints: int) -> Segment:
    return Segment(move=move, joints=joints or None)


def _there_and_back(degrees: tuple[float, ...], duration: float, rest: float, *joints: int) -> list[Segment]:
    """Moves out in a ramp, rests, returns in a ramp and rests; `degrees` has one value per joint."""
    segments = []
    for sign in (1.0, -1.0):
        amplitude = {j: sign * math.radians(a) for j, a in zip(joints or MAJOR, degrees, strict=True)}
        segments.append(_segment(Ramp(amplitude=amplitude, duration=duration), *joints))
        if rest:
            segments.append(_segment(Pause(duration=rest)))
    return segments


def _one_joint_at_a_time() -> list[Segment]:
    return [segment for joint in MAJOR for segment in _there_and_back((21.6,), 0.65, 0.85, joint)]


def _slow_reversals() -> list[Segment]:
    ratios = ((5.0, 3.0, -2.0), (-2.0, 5.0, 3.0), (3.0, -2.0, 5.0))
    speed = math.radians(5.0)
    return [_segment(SlowRamp(amplitude=_by_joint(*ratio), speed=speed, reversals=3)) for ratio in ratios]


def _small_steps() -> list[Segment]:
    return [
        _segment(Staircase(amplitude=_by_joint(3 * size, -3 * size, 3 * size), steps=3, dwell=0.5))
        for size in (0.3, 1.0, 3.0)
    ]


def _fast_and_saturating() -> list[Segment]:
    segments = []
    for size in (3.0, -3.0, 7.5, -7.5, -7.5, 7.5):
        segments += [_segment(Step(amplitude=math.radians(size))), _segment(Pause(duration=0.58))]
    # Joint 2 is the slowest: its drive reaches about 43 °/s.
    segments += _there_and_back((15.0, 9.0, 15.0), 0.22, 0.78)
    segments += _there_and_back((30.0, 18.0, 30.0), 0.42, 0.58)
    return segments + _there_and_back((30.0,), 0.70, 0.0, 2)


def _second_posture() -> list[Segment]:
    there = (40.0, 35.0, -50.0)
    back = tuple(-angle for angle in there)
    slow = SlowRamp(amplitude=_by_joint(4.0, -6.0, 6.0), speed=math.radians(4.0), reversals=3)
    return [
        _segment(Cubic(amplitude=_by_joint(*there), duration=3.0)),
        _segment(Pause(duration=0.5)),
        *_there_and_back((21.6, 21.6, 21.6), 0.66, 0.84),
        _segment(slow),
        _segment(Pause(duration=0.5)),
        _segment(Cubic(amplitude=_by_joint(*back), duration=3.0)),
    ]


def _pseudo_random() -> list[Segment]:
    """A maximum-length sequence of 255 signs, each held for 80 ms; the joints are 85 signs apart. Their set points jump
    between ±2° and are nearly uncorrelated."""
    signs = _maximum_length()
    third = len(signs) // len(MAJOR)
    segments: list[Segment] = []
    now: tuple[float, ...] = (0.0, 0.0, 0.0)
    for k in range(len(signs) + 1):
        wanted = tuple(2.0 * signs[(k + third * n) % len(signs)] if k < len(signs) else 0.0 for n in range(len(MAJOR)))
        jumps = {j: math.radians(b - a) for j, a, b in zip(MAJOR, now, wanted, strict=True) if a != b}
        if jumps:
            segments.append(_segment(Step(amplitude=jumps), *jumps))
        segments.append(_segment(Pause(duration=0.06 if jumps else 0.08)))
        now = wanted
    return segments


def _maximum_length() -> list[int]:
    """±1 from an 8-bit shift register with feedback from bits 8, 6, 5 and 4: every state but 0 once (Golomb 1967)."""
    register, signs = 0b01011010, []
    for _ in range(255):
        signs.append(1 if register & 1 else -1)
        bit = (register ^ (register >> 2) ^ (register >> 3) ^ (register >> 4)) & 1
        register = (register >> 1) | (bit << 7)
    return signs


def _sweep() -> list[Segment]:
    """Moves through most of each joint's range in smooth moves of 4 s; joints reverse at different times."""
    postures = ((120.0, 90.0, -120.0), (0.0, 150.0, 0.0), (-120.0, 60.0, 120.0), (0.0, -60.0, 110.0), (0.0, 0.0, 0.0))
    segments: list[Segment] = []
    now: tuple[float, ...] = (0.0, 0.0, 0.0)
    for posture in postures:
        move = _by_joint(*(b - a for a, b in zip(now, posture, strict=True)))
        segments.append(_segment(Cubic(amplitude=move, duration=4.0)))
        now = posture
    return segments


def _held_out() -> list[Segment]:
    """Like the diagnostic set, but with other sizes and speeds, at a third posture."""
    there = (-25.0, 20.0, 30.0)
    slow = SlowRamp(amplitude=_by_joint(3.0, 4.0, -4.0), speed=math.radians(4.5), reversals=1)
    return [
        _segment(
            Multisine(amplitude=_by_joint(12.0, 8.0, 12.0), duration=7.0, lowest=0.2, highest=1.2, tones=8, seed=1991)
        ),
        _segment(Cubic(amplitude=_by_joint(*there), duration=1.8)),
        _segment(Pause(duration=0.3)),
        *_there_and_back((18.0, -18.0, -18.0), 0.5, 0.4),
        _segment(slow),
        *_there_and_back((5.0, 5.0, 5.0), 0.1, 0.5),
        _segment(Cubic(amplitude=_by_joint(*(-angle for angle in there)), duration=1.8)),
    ]


def _sequence(name: str, segments: list[Segment]) -> ExperimentSpec:
    return ExperimentSpec(trajectory=Sequence(segments=tuple(segments)), joints=MAJOR, hold=1.0, name=name)


PARTS = {
    "a": ("one joint at a time, ±21.6° in 0.65 s", _one_joint_at_a_time()),
    "b": ("slow reversals at 2 to 5 °/s, another ratio of the joints each time", _slow_reversals()),
    "c": ("staircases of 0.3°, 1° and 3°", _small_steps()),
    "d": ("steps and fast ramps of 3° to 30° that saturate every drive", _fast_and_saturating()),
    "e": ("ramps and slow reversals at a second posture", _second_posture()),
}

PRESETS: dict[str, Preset] = {
    "ramp": Preset("the ramp of the 1991 thesis: joints 1-3 through 21.6° in 0.65 s", ExperimentSpec(name="ramp")),
    "diagnostic": Preset(
        "parts a to e in order, about 55 s: distinguishes hidden effects",
        _sequence("diagnostic", [segment for _, segments in PARTS.values() for segment in segments]),
    ),
    **{
        f"diagnostic-{letter}": Preset(description, _sequence(f"diagnostic-{letter}", segments))
        for letter, (description, segments) in PARTS.items()
    },
    "pseudo-random": Preset(
        "pseudo-random steps between ±2° for 20 s: for effects of fast motion, such as inductance and delay",
        _sequence("pseudo-random", _pseudo_random()),
    ),
    "sweep": Preset(
        "21 s through most of each joint's range: for effects of position, such as a bent or shifted potentiometer",
        _sequence("sweep", _sweep()),
    ),
    "held-out": Preset(
        "17 s held out to check a model: tones, ramps, slow reversals, steps at a third posture",
        _sequence("held-out", _held_out()),
    ),
}
