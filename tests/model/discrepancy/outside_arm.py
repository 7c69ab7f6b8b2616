"""A three-joint arm that shares no code with `model`: its own equations, its own integration, its own controller.

Waist, shoulder and elbow of thin rods with geared motors. A sampled PD reads encoders of 14 bits; its output is
limited, rounded to what its converter can give, and acts some time later. Records hold set points, positions and the
drive, and no error.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray

from daq.contracts.machine import Machine, parse_machine
from daq.contracts.trace import Trace
from tests.model.imported import imported

Floats = NDArray[np.float64]

PERIOD, STEP = 0.01, 0.00025
"""Control period and step of integration, s."""
RESOLUTION, LIMIT = 0.14, 16.0
"""Of the controller's output, V."""
COUNT = 2 * np.pi / 2**14
"""rad"""
LENGTHS, MASSES, WAIST = (0.4, 0.35), (3.2, 2.1), 0.09
"""Of the two rods, m and kg; inertia of the waist, kg·m²."""
RESISTANCE = 2.1
VISCOUS, COULOMB = (2.4e-4, 2.2e-4, 1.8e-4), (1.1, 1.4, 0.7)
"""Motor side, N·m·s/rad; at the joint, N·m."""


def machine(*, rounded: bool = True, limit: float = LIMIT, period: float = PERIOD) -> Machine:
    """The machine file as its lab would write it. Without `rounded`, it does not speak of rounding and limit (V)."""
    lines = (Path(__file__).parent / "outside_arm.toml").read_text("utf-8").splitlines()
    kept = [line for line in lines if rounded or not line.startswith(("drive_resolution", "output_limit"))]
    text = "\n".join(kept).replace(f'"{LIMIT:g} V"', f'"{limit} V"')
    return parse_machine(text.replace(f'period = "{1e3 * PERIOD:g} ms"', f'period = "{period} s"'))


@dataclass(frozen=True)
class OutsideArm:
    """Numbers of one arm, in SI units.

    Args:
        dead_zone: V. resolution, limit: of the controller's output, V. factor: of the controller's gains. lost: share
        of its set points that it does not get.
    """

    mass: Floats = field(default_factory=lambda: np.array([18.0, *MASSES]))
    viscous: Floats = field(default_factory=lambda: np.array(VISCOUS))
    coulomb: Floats = field(default_factory=lambda: np.array(COULOMB))
    resistance: Floats = field(default_factory=lambda: np.full(3, RESISTANCE))
    delay: float = 0.002
    dead_zone: Floats = field(default_factory=lambda: np.zeros(3))
    resolution: float = RESOLUTION
    limit: float = LIMIT
    factor: Floats = field(default_factory=lambda: np.ones(3))
    lost: Floats = field(default_factory=lambda: np.zeros(3))
    period: float = PERIOD

    def changed(self, name: str, joint: int, value: float) -> "OutsideArm":
        """The arm with one number of one joint (from 1) changed."""
        column = getattr(self, name).copy()
        column[joint - 1] = value
        return replace(self, **{name: column})


def drawn(seed: int) -> OutsideArm:
    """A sound arm: every number off by as much as its machine file says it may be."""
    rng = np.random.default_rng(seed)
    nominal = OutsideArm()
    return replace(
        nominal,
        mass=nominal.mass * (1 + np.array([0.033, 0.04, 0.04]) * rng.standard_normal(3)),
        viscous=np.abs(nominal.viscous + 5e-5 * rng.standard_normal(3)),
        coulomb=np.abs(nominal.coulomb + 0.15 * rng.standard_normal(3)),
        resistance=nominal.resistance + 0.06 * rng.standard_normal(3),
        delay=float(np.clip(0.002 + 0.0005 * rng.standard_normal(), 0.0005, 0.0035)),
    )


def wanted(seed: int, duration: float, period: float = PERIOD) -> Floats:
    """Set points (k, 3), rad: ramps between drawn postures with rests between them."""
    rng = np.random.default_rng(seed)
    count = round(duration / period)
    found = np.zeros((count, 3))
    posture = np.array([0.0, 0.6, -0.9])
    low, high = np.array([-0.9, 0.1, -1.6]), np.array([0.9, 1.2, -0.3])
    k = round(0.6 / period)
    found[:k] = posture
    while k < count:
        target = low + (high - low) * rng.random(3)
        speed = 0.15 + 0.85 * rng.random()
        moving = min(count - k, round(float(np.abs(target - posture).max()) / speed / period) + 1)
        share = np.arange(1, moving + 1)[:, None] / moving
        found[k : k + moving] = posture + share * (target - posture)
        posture, k = found[k + moving - 1].copy(), k + moving
        rest = min(count - k, round(int(rng.integers(5, 40)) * PERIOD / period))
        found[k : k + rest] = posture
        k += rest
    return found


def record(arm: OutsideArm, seed: int, duration: float = 17.0) -> Trace:
    """A record of the arm, with noise of its readings."""
    set_points = wanted(seed, duration, arm.period)
    rng = np.random.default_rng(seed + 1000)
    noise = 0.3 * rng.standard_normal(set_points.shape)
    used = set_points.copy()
    losses = rng.random(set_points.shape) < arm.lost
    for k in range(1, len(used)):
        used[k] = np.where(losses[k], used[k - 1], used[k])
    position, drive = np.zeros_like(used), np.zeros_like(used)
    numbers = np.array([arm.mass, arm.viscous, arm.coulomb, arm.resistance, arm.dead_zone])
    shared = np.array([arm.delay, arm.resolution, arm.limit, arm.period])
    _run(used, noise, numbers, shared, arm.factor, position, drive)
    made = imported(f"outside-{seed}", period=arm.period, drive_unit="V")
    time = arm.period * np.arange(len(used))
    return Trace(made, (1, 2, 3), time, position, set_point=set_points, drive=drive)


@numba.njit
def _balance(q: Floats, v: Floats, p: Floats, inertia: Floats, bias: Floats, weight: Floats) -> None:
    """Fills mass matrix, velocity torques and gravity torques (the torques that hold the arm)."""
    l2, l3, m2, m3 = 0.4, 0.35, p[0, 1], p[0, 2]
    c2, s2, c23, s23 = np.cos(q[1]), np.sin(q[1]), np.cos(q[1] + q[2]), np.sin(q[1] + q[2])
    c3, s3 = np.cos(q[2]), np.sin(q[2])
    r2, r3 = l2 * c2, l3 * c23
    upper = m2 / 3 + m3
    both = 0.5 * m3
    lower = m3 / 3
    inertia[:] = 0.0
    inertia[0, 0] = 0.5 * p[0, 0] * 0.01 + upper * r2 * r2 + 2 * both * r2 * r3 + lower * r3 * r3
    b = both * l2 * l3
    inertia[1, 1] = upper * l2 * l2 + lower * l3 * l3 + 2 * b * c3
    inertia[1, 2] = inertia[2, 1] = lower * l3 * l3 + b * c3
    inertia[2, 2] = lower * l3 * l3
    gears = (90.0, 110.0, 80.0)
    for j in range(3):
        inertia[j, j] += 4.2e-5 * gears[j] ** 2
    by_3 = -2 * both * r2 * l3 * s23 - 2 * lower * r3 * l3 * s23
    by_2 = -2 * upper * r2 * l2 * s2 - 2 * both * l2 * s2 * r3 + by_3
    bias[0] = (by_2 * v[1] + by_3 * v[2]) * v[0]
    bias[1] = -0.5 * by_2 * v[0] ** 2 - b * s3 * (2 * v[1] * v[2] + v[2] ** 2)
    bias[2] = -0.5 * by_3 * v[0] ** 2 + b * s3 * v[1] ** 2
    g = 9.81
    weight[0] = 0.0
    weight[2] = g * both * l3 * c23
    weight[1] = g * (0.5 * m2 + m3) * l2 * c2 + weight[2]


@numba.njit
def _rates(q: Floats, v: Floats, volts: Floats, p: Floats, stuck: Floats) -> Floats:
    """Accelerations. A joint that is stuck (1) stays at rest as long as its friction can hold it."""
    gears = (90.0, 110.0, 80.0)
    inertia, bias, weight = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    _balance(q, v, p, inertia, bias, weight)
    torque, level = np.zeros(3), np.zeros(3)
    for j in range(3):
        u = volts[j]
        u = u - p[4, j] if u > p[4, j] else (u + p[4, j] if u < -p[4, j] else 0.0)
        gain = gears[j] * 0.055 / p[3, j]
        torque[j] = gain * (u - 0.055 * gears[j] * v[j]) - p[1, j] * gears[j] ** 2 * v[j]
        torque[j] -= bias[j] + weight[j]
        level[j] = p[2, j]
    held = stuck.copy()
    for _ in range(4):
        a, b = inertia.copy(), torque.copy()
        for j in range(3):
            if held[j] == 0.0:
                b[j] -= level[j] * (np.sign(v[j]) if v[j] != 0.0 else np.sign(torque[j]))
            else:
                a[j, :] = 0.0
                a[j, j] = 1.0
                b[j] = 0.0
        found = np.linalg.solve(a, b)
        freed = False
        for j in range(3):
            if held[j] == 1.0:
                needed = torque[j]
                for i in range(3):
                    needed -= inertia[j, i] * found[i]
                if abs(needed) > level[j]:
                    held[j] = 0.0
                    freed = True
        if not freed:
            break
    return found


@numba.njit
def _run(
    used: Floats, noise: Floats, p: Floats, shared: Floats, factor: Floats, position: Floats, drive: Floats
) -> None:
    step, count = 0.00025, 2 * np.pi / 2**14
    gains_p, gains_d = (90.0, 110.0, 70.0), (4.0, 5.0, 2.5)
    delay, resolution, limit, period = shared
    q, v = used[0].copy(), np.zeros(3)
    inertia, bias, weight = np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    _balance(q, v, p, inertia, bias, weight)
    volts, stuck, last = np.zeros(3), np.ones(3), np.zeros(3)
    gears = (90.0, 110.0, 80.0)
    for j in range(3):
        volts[j] = weight[j] * p[3, j] / (gears[j] * 0.055)
        if abs(weight[j]) <= p[2, j]:
            volts[j] = 0.0
        q[j] -= volts[j] / gains_p[j]
    for k in range(len(used)):
        command = np.zeros(3)
        for j in range(3):
            position[k, j] = count * np.floor((q[j] + np.pi) / count + noise[k, j] + 0.5) - np.pi
            error = used[k, j] - position[k, j]
            if k == 0:
                last[j] = error
            output = factor[j] * (gains_p[j] * error + gains_d[j] * (error - last[j]) / period)
            last[j] = error
            if resolution > 0.0:
                output = resolution * np.floor(output / resolution + 0.5)
            command[j] = min(limit, max(-limit, output))
            drive[k, j] = command[j]
        done = 0.0
        while done < period - 1e-12:
            edge = delay if done < delay - 1e-12 else period
            h = min(step, edge - done)
            acting = volts if done < delay - 1e-12 else command
            for j in range(3):
                stuck[j] = 1.0 if v[j] == 0.0 else 0.0
            k1 = _rates(q, v, acting, p, stuck)
            k2 = _rates(q + 0.5 * h * v, v + 0.5 * h * k1, acting, p, stuck)
            k3 = _rates(q + 0.5 * h * (v + 0.5 * h * k1), v + 0.5 * h * k2, acting, p, stuck)
            k4 = _rates(q + h * (v + 0.5 * h * k2), v + h * k3, acting, p, stuck)
            after = v + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            q = q + h * v + h * h / 6 * (k1 + k2 + k3)
            for j in range(3):
                v[j] = 0.0 if v[j] * after[j] < 0.0 else after[j]
            done += h
        volts = command
