"""Rigs that hide an effect: their equations of motion are written out here and integrated by scipy.

Nothing of this is shared with the models that are diagnosed: friction is a smooth function of speed, a transmission two
masses and a spring.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from model.arrays import Floats
from tests.model.imported import imported

Wanted = Callable[[float], tuple[float, float, float]]


def quantity(value: float, unit: str, **more: Any) -> dict[str, Any]:
    """A number of a machine file."""
    return {"value": value, "unit": unit, "source": "test", **more}


def geometry(a: float = 0.0, alpha: float = 0.0, d: float = 0.0) -> dict[str, Any]:
    """Denavit and Hartenberg's numbers of a joint (m, rad, m)."""
    return {
        "a": quantity(a, "m"),
        "alpha": quantity(alpha, "rad"),
        "d": quantity(d, "m"),
        "theta": quantity(0.0, "rad"),
    }


def body(mass: dict[str, Any], inertia: list[dict[str, Any]] | None = None) -> dict[str, Any]:
    """A link whose centre is its frame's origin, without moments of inertia unless they are given."""
    nothing = [quantity(0.0, "kg·m²")] * 6
    return {"shape": "body", "mass": mass, "centre": [quantity(0.0, "m")] * 3, "inertia": inertia or nothing}


def machine_of(name: str, title: str, gravity: list[float], *joints: dict[str, Any]) -> Machine:
    """Joints that are all modelled, and a controller that nobody knows."""
    return Machine.model_validate(
        {
            "version": 1,
            "name": name,
            "title": title,
            "gravity": gravity,
            "modelled_joints": list(range(1, len(joints) + 1)),
            "controller": {"kind": "none"},
            "joints": joints,
        }
    )


def trace_of(
    name: str, time: Floats, position: Floats, drive: Floats, unit: Any, velocity: Floats | None = None
) -> Trace:
    """A trace (k, n) as an import would give it."""
    record = imported(name, drive_unit=unit)
    joints = tuple(range(1, position.shape[1] + 1))
    return Trace(record, joints, time, position, drive=drive, velocity=velocity)


def waves(seed: int, rates: tuple[float, ...], size: float) -> Wanted:
    """A sum of sines with drawn phases: position, speed and acceleration at a time."""
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(rates))
    amplitudes = size / np.arange(1, len(rates) + 1)
    angular = 2 * np.pi * np.array(rates)

    def wanted(t: float) -> tuple[float, float, float]:
        s, c = np.sin(angular * t + phases), np.cos(angular * t + phases)
        return (float(amplitudes @ s), float((amplitudes * angular) @ c), float(-(amplitudes * angular**2) @ s))

    return wanted


# ---- a sliding servo axis whose controller nobody knows; the force of its drive is recorded

SLIDE = {
    "mass": 12.0,
    "viscous": 0.0,
    "drag": 0.0,
    "coulomb": 0.0,
    "stribeck": 0.0,
    "stribeck_speed": 0.05,
    "spring": 0.0,
    "ripple": 0.0,
    "cycles": 300.0,
    "hum": 0.0,
    "hertz": 1.7,
    "loss": 0.0,
    "tight": 0.0,
    "tight_at": 0.03,
    "tight_width": 0.02,
}
ENCODER = 5e-6


def slide_machine() -> Machine:
    """One prismatic joint along the horizontal, 0.6 m of travel."""
    slide = {
        "name": "slide",
        "kind": "prismatic",
        "geometry": geometry(),
        "link": body(quantity(12.0, "kg", low=0.1, deviation=0.6)),
        "drive": {"kind": "gain", "gain": quantity(1.0, "N/N")},
    }
    return machine_of("slide", "Sliding axis", [0.0, -9.81, 0.0], slide)


def slide_trace(seed: int, hidden: Mapping[str, float], duration: float = 16.0) -> Trace:
    """The axis along a sum of sines at 500 Hz; a stiff controller forms the force, which is recorded with noise."""
    p = {**SLIDE, **hidden}
    wanted = waves(seed, (0.21, 0.5, 1.1, 2.3), 0.12)

    def force(t: float, q: float, v: float) -> float:
        w, dw, ddw = wanted(t)
        return float(12.0 * ddw + 8000.0 * (w - q) + 500.0 * (dw - v))

    def motion(t: float, y: Floats) -> list[float]:
        q, v = y
        u = force(t, q, v)
        way = np.tanh(v / 5e-4)
        rub = (p["viscous"] + p["drag"] * abs(v)) * v + (
            p["coulomb"] + p["stribeck"] * np.exp(-abs(v) / p["stribeck_speed"])
        ) * way
        rub += p["loss"] * abs(u) * way + p["tight"] * np.exp(-(((q - p["tight_at"]) / p["tight_width"]) ** 2)) * way
        other = -p["spring"] * (q - 0.02) + p["ripple"] * np.sin(p["cycles"] * q)
        other += p["hum"] * np.sin(2 * np.pi * p["hertz"] * t + 0.4)
        return [v, (u - rub + other) / p["mass"]]

    time = np.arange(0.0, duration, 0.002)
    start = wanted(0.0)
    found = solve_ivp(
        motion, (0.0, duration), start[:2], t_eval=time, method="LSODA", rtol=1e-7, atol=1e-9, max_step=0.01
    )
    noise = np.random.default_rng(seed + 100)
    drive = np.array([force(t, q, v) for t, q, v in zip(time, *found.y, strict=True)])
    read = ENCODER * np.round(found.y[0] / ENCODER + noise.normal(0.0, 0.5, len(time)))
    return trace_of(f"slide{seed}", time, read[:, None], (drive + noise.normal(0.0, 0.3, len(time)))[:, None], "N")


# ---- a DC motor on a bench: volts in, speed out

BENCH = {
    "resistance": 2.0,
    "constant": 0.05,
    "back_emf": 0.05,
    "inertia": 2e-4,
    "viscous": 1e-5,
    "coulomb": 0.0,
    "dead_zone": 0.0,
    "delay": 0.0,
    "limit": 1e9,
}


def bench_machine() -> Machine:
    """A motor with a flywheel; the sensor measures speed."""
    shaft = {
        "name": "shaft",
        "kind": "revolute",
        "geometry": geometry(),
        "link": body(quantity(0.1, "kg")),
        "drive": {
            "kind": "dc_motor",
            "resistance": quantity(2.0, "Ω"),
            "inductance": quantity(1e-3, "H"),
            "torque_constant": quantity(0.05, "N·m/A"),
            "back_emf_constant": quantity(0.05, "V·s/rad", deviation=0.001),
            "rotor_inertia": quantity(2e-4, "kg·m²", low=0.0, deviation=1e-5),
            "gear_ratio": quantity(1.0, "1"),
            "amplifier_gain": quantity(1.0, "1"),
            "dac_full_scale": quantity(12.0, "V"),
        },
        "friction": {"viscous_motor_side": quantity(1e-5, "N·m·s/rad", low=0.0, deviation=1e-5)},
        "sensor": {
            "bits": 16,
            "range": quantity(800.0, "rad"),
            "at_zero": quantity(-400.0, "rad"),
            "measures": "velocity",
        },
    }
    return machine_of("bench", "Motor bench", [0.0, 0.0, -9.81], shaft)


def bench_trace(seed: int, hidden: Mapping[str, float], duration: float = 20.0) -> Trace:
    """Speed (with noise) at 200 Hz of a motor driven by a sum of sines of up to ±10 V. There is no position."""
    p = {**BENCH, **hidden}
    wanted = waves(seed, (0.15, 0.4, 0.9, 2.1), 5.0)

    def volts(t: float) -> float:
        asked = wanted(t - p["delay"])[0]
        return float(np.clip(np.sign(asked) * max(abs(asked) - p["dead_zone"], 0.0), -p["limit"], p["limit"]))

    def motion(t: float, y: Floats) -> list[float]:
        torque = p["constant"] * (volts(t) - p["back_emf"] * y[0]) / p["resistance"]
        return [(torque - p["viscous"] * y[0] - p["coulomb"] * np.tanh(y[0] / 0.5)) / p["inertia"]]

    time = np.arange(0.0, duration, 0.005)
    found = solve_ivp(motion, (0.0, duration), [0.0], t_eval=time, method="LSODA", rtol=1e-7, atol=1e-7, max_step=0.01)
    noise = np.random.default_rng(seed + 100)
    speed = found.y[0] + noise.normal(0.0, 0.2, len(time))
    drive = np.array([wanted(t)[0] for t in time])
    return trace_of(f"bench{seed}", time, np.zeros((len(time), 1)), drive[:, None], "V", speed[:, None])


# ---- an arm on a spring: a motor behind a transmission that gives or has play, in the plane of gravity

GEARED = {"link": 0.05, "rotor": 0.04, "weight": 1.2, "stiffness": 0.0, "damping": 0.15, "gap": 0.0, "coulomb": 0.0}


def geared_machine() -> Machine:
    """A revolute joint with a rotor behind a gear, and a link that hangs at zero."""
    mass, centre, nothing = 0.6116, 0.2, quantity(0.0, "kg·m²")
    own = quantity(0.05 - mass * centre**2, "kg·m²", low=0.0, deviation=0.002)
    arm = {
        "name": "arm",
        "kind": "revolute",
        "geometry": geometry(a=centre),
        "link": body(quantity(mass, "kg", low=0.01, deviation=0.03), [nothing, nothing, own, *3 * [nothing]]),
        "drive": {
            "kind": "gain",
            "gain": quantity(1.0, "N·m/N·m"),
            "inertia": quantity(0.04, "kg·m²", low=0.0, deviation=0.002),
        },
    }
    return machine_of("geared", "Geared arm", [9.81, 0.0, 0.0], arm)


def geared_trace(seed: int, hidden: Mapping[str, float], duration: float = 16.0) -> Trace:
    """The link's angle at 500 Hz under a recorded torque that a controller forms of the rotor's angle."""
    p = {**GEARED, **hidden}
    wanted = waves(seed, (0.3, 0.8, 1.9, 3.1), 0.5)
    stiff = p["stiffness"] or 4000.0

    def torque(t: float, q: float, v: float) -> float:
        w, dw, ddw = wanted(t)
        return float(0.09 * ddw + 1.2 * np.sin(w) + 15.0 * (w - q) + 1.5 * (dw - v))

    def motion(t: float, y: Floats) -> list[float]:
        q, v, m, r = y
        twist = m - q
        stretched = np.sign(twist) * max(abs(twist) - 0.5 * p["gap"], 0.0)
        through = stiff * stretched + (p["damping"] * (r - v) if stretched or not p["gap"] else 0.0)
        u = torque(t, m, r)
        rub = p["coulomb"] * np.tanh(v / 2e-3)
        return [v, (through - p["weight"] * np.sin(q) - rub) / p["link"], r, (u - through) / p["rotor"]]

    time = np.arange(0.0, duration, 0.002)
    w, dw, _ = wanted(0.0)
    found = solve_ivp(
        motion, (0.0, duration), [w, dw, w, dw], t_eval=time, method="LSODA", rtol=1e-7, atol=1e-9, max_step=0.005
    )
    noise = np.random.default_rng(seed + 100)
    drive = np.array([torque(t, m, r) for t, m, r in zip(time, found.y[2], found.y[3], strict=True)])
    read = 2e-5 * np.round(found.y[0] / 2e-5 + noise.normal(0.0, 0.5, len(time)))
    return trace_of(f"geared{seed}", time, read[:, None], (drive + noise.normal(0.0, 0.01, len(time)))[:, None], "N·m")
