"""Profile likelihoods beside pyPESTO and mujoco.sysid on one record: estimates and 95 % intervals.

python -m benchmarks profile_likelihoods [--peers PYTHON] [--slow]

PYTHON is that of an environment made by `python -m venv peers; peers/bin/pip install pypesto 'mujoco[sysid]'`. The
record is of none of them: a hanging rod is driven by a torque, SciPy integrates its equation (DOP853, 1e-10), and white
noise of known size is added. With `--slow` the torque changes so slowly that the rotor's inertia hardly shows.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from daq.contracts.machine import parse_machine
from daq.contracts.trace import Trace, TraceRecord
from model.arrays import Floats
from model.fitting.fit import fit
from model.fitting.options import FitOptions
from model.fitting.profile import profile
from model.machine_model.model import base_model

LENGTH, PERIOD, SAMPLES = 0.3, 0.01, 600
TRUTH = {"link1.mass": 0.93, "joint1.viscous_friction.coefficient": 0.03, "joint1.drive.inertia": 0.0043}
START = {"link1.mass": 0.8, "joint1.viscous_friction.coefficient": 0.02, "joint1.drive.inertia": 0.003}
BOUNDS = {
    "link1.mass": (0.1, 3.0),
    "joint1.viscous_friction.coefficient": (0.0, 0.3),
    "joint1.drive.inertia": (0.0, 0.1),
}
NOISE_COUNTS = 20.0
COUNT = 2 * np.pi / 2**16
SUBSTEPS = 2
STARTS = 3
PEER = Path(__file__).parent / "peers" / "profile_side.py"
MACHINE = f"""
version = 1
name = "rod"
title = "A hanging rod"
gravity = [9.81, 0.0, 0.0]
modelled_joints = [1]
controller = {{ kind = "none" }}

[[joints]]
name = "axis"
kind = "revolute"
geometry = {{ a = {{ value = {LENGTH}, unit = "m", source = "benchmark" }}, alpha = {{ value = 0.0, unit = "rad", source = "benchmark" }}, d = {{ value = 0.0, unit = "m", source = "benchmark" }}, theta = {{ value = 0.0, unit = "rad", source = "benchmark" }} }}
link = {{ shape = "rod", mass = {{ value = 0.8, unit = "kg", source = "benchmark", low = 0.0, deviation = 0.2 }} }}
drive = {{ kind = "gain", gain = {{ value = 1.0, unit = "N·m/V", source = "benchmark" }}, inertia = {{ value = 0.003, unit = "kg·m²", source = "benchmark", low = 0.0, deviation = 0.003 }} }}
friction = {{ viscous = {{ value = 0.02, unit = "N·m·s/rad", source = "benchmark", low = 0.0, deviation = 0.02 }} }}
sensor = {{ bits = 16, range = {{ value = 6.283185307179586, unit = "rad", source = "benchmark" }}, at_zero = {{ value = -3.141592653589793, unit = "rad", source = "benchmark" }}, noise = {{ value = {NOISE_COUNTS}, unit = "count", source = "benchmark" }} }}
"""  # noqa: E501


def main(arguments: list[str]) -> int:
    """Prints a row for each parameter and program; 1 where intervals of the two profiles differ by over 5 % of their
    width."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks profile_likelihoods", description=__doc__)
    parser.add_argument("--peers", help="the Python of an environment with pypesto and mujoco[sysid]")
    parser.add_argument("--slow", action="store_true", help="a torque that hardly shows the rotor's inertia")
    given = parser.parse_args(arguments)
    trace = rod_record(slow=given.slow)
    answers = {"daq profile": _ours(trace)}
    if given.peers is not None:
        answers.update(_of_peers(given.peers, trace, answers["daq profile"]))
    print(f"{'parameter':38}{'program':14}{'best':>10}{'at least':>10}{'at most':>10}   true value")
    for name, true in TRUTH.items():
        for program, found in answers.items():
            cells = "".join(f"{'–' if v is None else format(v, '.5g'):>10}" for v in found[name])
            print(f"{name:38}{program:14}{cells}   {true:g}")
    peers = answers.get("pyPESTO")
    return 0 if peers is None else int(max(_apart(answers["daq profile"][n], peers[n]) for n in TRUTH) > 0.05)


def rod_record(*, slow: bool = False) -> Trace:
    """Six seconds of the rod: torque held for each sample, angle with white noise but for the first reading."""
    time = np.asarray(PERIOD * np.arange(SAMPLES), dtype=np.float64)
    rates = (0.15, 0.25, 0.4) if slow else (2.1, 4.3, 11.0)
    torque = np.sum([0.3 * np.sin(rate * time + phase) for phase, rate in enumerate(rates)], axis=0)
    if slow:  # begun and ended gently, so that the rod never swings by itself
        torque = torque * np.sin(np.pi * time / time[-1]) ** 2
    mass, viscous, rotor = TRUTH.values()
    inertia, weight = mass * LENGTH**2 / 3 + rotor, mass * 9.81 * LENGTH / 2
    state, angles = np.zeros(2), [0.0]
    for held in torque[:-1]:

        def slope(_time: float, y: Floats, held: float = held) -> Floats:
            return np.array([y[1], (held - viscous * y[1] - weight * np.sin(y[0])) / inertia])

        state = solve_ivp(slope, (0.0, PERIOD), state, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
        angles.append(float(state[0]))
    noise = NOISE_COUNTS * COUNT * np.random.default_rng(1).normal(size=SAMPLES)
    noise[0] = 0.0
    record = TraceRecord(
        trace_id="rod",
        created=datetime(2024, 1, 1, tzinfo=UTC),
        software="benchmark",
        source="imported",
        period=PERIOD,
        drive_unit="V",
    )
    position = np.asarray(np.array(angles) + noise, dtype=np.float64)[:, None]
    return Trace(record, (1,), time, position, drive=np.asarray(torque, dtype=np.float64)[:, None])


OPTIONS = FitOptions(
    parameters=tuple(TRUTH),
    bounds=dict(BOUNDS),
    use_priors=False,
    robust=False,
    starts=STARTS,
    start_posture=False,
    sensor_bend=False,
    friction_form=False,
    whiten=False,
    replicas=0,
    rounds=1,
    step=0.002,
)
"""White noise of a known size and nothing else, as the other programs take it."""


def _ours(trace: Trace) -> dict[str, Any]:
    fitted = fit(base_model(parse_machine(MACHINE)), [trace], OPTIONS)
    found = {name: profile(fitted, [trace], name) for name in TRUTH}
    return {name: [one.value, one.low, one.high] for name, one in found.items()}


def _of_peers(python: str, trace: Trace, ours: dict[str, Any]) -> dict[str, Any]:
    assert trace.drive is not None
    ends = [ours[name] for name in TRUTH]
    task = {
        "names": list(TRUTH),
        "start": list(START.values()),
        "low": [low for low, _ in BOUNDS.values()],
        "high": [high for _, high in BOUNDS.values()],
        "steps": [0.25 * ((high if high is not None else best) - (low or 0.0)) for best, low, high in ends],
        "starts": STARTS,
        "length": LENGTH,
        "period": PERIOD,
        "substeps": SUBSTEPS,
        "sigma": float(np.hypot(NOISE_COUNTS, np.sqrt(1 / 12)) * COUNT),
        "torque": trace.drive[:, 0].tolist(),
        "angle": trace.position[:, 0].tolist(),
    }
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "task.json")
        file.write_text(json.dumps(task), "utf-8")
        done = subprocess.run([python, str(PEER), str(file)], check=True, stdout=subprocess.PIPE, text=True)
    answers: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answers


def _apart(one: list[float | None], other: list[float | None]) -> float:
    """Largest distance of interval ends, as a share of the interval; infinite where one has an end alone."""
    if [end is None for end in one[1:]] != [end is None for end in other[1:]]:
        return float("inf")
    width = (one[2] or one[0] or 0.0) - (one[1] or 0.0)
    return max(abs(a - b) / width for a, b in zip(one[1:], other[1:], strict=True) if a is not None and b is not None)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
