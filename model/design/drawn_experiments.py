"""Draws experiments at random within the limits: the candidates of a search for good ones."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from daq.contracts.experiment import Cubic, ExperimentSpec, Gain, Multisine, Pause, Ramp, Segment, Sequence, SlowRamp
from daq.contracts.machine import BoardPid, Machine

MARGIN = math.radians(5.0)
"""Distance of start postures from the limits of a joint."""
AMPLITUDES = (math.radians(4.0), math.radians(25.0))
"""Range of amplitudes, drawn evenly in their logarithm."""
HIGHEST_FREQUENCIES = (0.5, 2.0)
"""Range of a multisine's highest frequency, Hz; the slowest joint follows up to about 0.8 Hz at full amplitude, and
further in small motions."""
SLOW_SPEEDS = (math.radians(2.0), math.radians(8.0))
"""Range of the speeds of slow ramps, rad/s."""


def drawn_experiment(machine: Machine, number: int, duration: float, seed: int) -> ExperimentSpec:
    """Returns candidate `number` of a seed: a multisine, slow ramps, or a sequence, at a random posture and gains.

    It may exceed the limits; planning then rejects it.
    """
    rng = np.random.default_rng([seed, number])
    kind = KINDS[number % len(KINDS)]
    joints = machine.modelled_joints
    spec = ExperimentSpec(
        trajectory=kind(rng, joints, duration),
        joints=joints,
        start=_start(rng, machine),
        gains=_gains(rng, machine),
        settle=0.5,
        hold=0.5,
        name=f"candidate-{seed}-{number}",
    )
    return ExperimentSpec.model_validate(spec.model_dump())


def _start(rng: np.random.Generator, machine: Machine) -> dict[int, float]:
    start = {}
    for joint in machine.modelled_joints:
        limits = machine.limits.joint(joint)
        if limits.low is not None and limits.high is not None:
            start[joint] = float(rng.uniform(limits.low + MARGIN, limits.high - MARGIN))
        elif machine.rest_posture is not None:
            start[joint] = machine.rest_posture[joint - 1]
    return start


def _gains(rng: np.random.Generator, machine: Machine) -> dict[int, Gain]:
    """Returns the machine's own gains, with P one step lower or higher on some joints, so that gain and load can be
    distinguished."""
    if not isinstance(machine.controller, BoardPid):
        return {}
    gains = {}
    for joint in machine.modelled_joints:
        p, i, d = machine.controller.gains[joint - 1]
        change = int(rng.integers(-1, 2))
        if change and 1 <= p + change <= 20:
            gains[joint] = (p + change, i, d)
    return gains


def _amplitudes(rng: np.random.Generator, joints: tuple[int, ...], share: float = 1.0) -> dict[int, float]:
    low, high = AMPLITUDES
    return {
        j: share * float(rng.choice((-1, 1)) * math.exp(rng.uniform(math.log(low), math.log(high)))) for j in joints
    }


def _multisine(rng: np.random.Generator, joints: tuple[int, ...], duration: float) -> Multisine:
    amplitude, highest = _amplitudes(rng, joints), float(rng.uniform(*HIGHEST_FREQUENCIES))
    seed = int(rng.integers(1, 10_000))
    return Multisine(amplitude=amplitude, duration=duration, lowest=0.1, highest=highest, tones=12, seed=seed)


def _slow_ramps(rng: np.random.Generator, joints: tuple[int, ...], duration: float) -> Sequence:
    amplitude, speed = _amplitudes(rng, joints, 0.4), float(rng.uniform(*SLOW_SPEEDS))
    leg = max(abs(a) for a in amplitude.values()) / speed
    reversals = int(np.clip(duration / leg - 1, 1, 20))
    return Sequence(segments=(Segment(move=SlowRamp(amplitude=amplitude, speed=speed, reversals=reversals)),))


def _sequence(rng: np.random.Generator, joints: tuple[int, ...], duration: float) -> Sequence:
    segments, left = [], duration
    while left > 0:
        amplitude, time = _amplitudes(rng, joints), float(rng.uniform(0.5, 1.5))
        for sign in (1.0, -1.0):
            moved = {j: sign * a for j, a in amplitude.items()}
            move = Ramp(amplitude=moved, duration=time) if rng.random() < 0.5 else Cubic(amplitude=moved, duration=time)
            segments += [Segment(move=move), Segment(move=Pause(duration=0.3))]
            left -= time + 0.3
    return Sequence(segments=tuple(segments))


KINDS: tuple[Callable[..., Multisine | Sequence], ...] = (_multisine, _sequence, _slow_ramps)
CALLED = ("sines of many frequencies", "ramps and smooth moves", "slow ramps with reversals")
"""The same in words."""
