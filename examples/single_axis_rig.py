"""Simulates a single-axis rig: writes CSV traces as a test bench would, for the example in docs/own-machine.md.

    python examples/single_axis_rig.py FOLDER [paddle]

With a paddle at its end the air drags the arm (docs/own-effect.md). The arm hangs in the plane of gravity (0 straight
down) and is moved by a PID at 200 Hz. It shares no code with the project's models: the equation of motion is written
out and integrated here.
"""

from __future__ import annotations

import csv
import math
import random
import sys
from collections.abc import Iterator
from pathlib import Path

TRUE = {"mass": 0.87, "length": 0.3, "inertia": 0.0044, "gain": 0.5, "viscous": 0.035, "coulomb": 0.06}
PERIOD, DELAY, P, D = 0.005, 0.001, 40.0, 0.8
COUNT = 2 * math.pi / 2**14
STEP = 0.00005
"""Integration step (s). Steps of 0.25 ms would look like 0.2 ms less delay, which a fit detects."""
PADDLE = 0.015
"""Drag coefficient of the paddle, N·m/(rad/s)²."""


def wanted(time: float, seed: int) -> float:
    """Returns the set point (rad): from rest, a sum of three sines that starts and ends gently."""
    if time < 0.5:
        return 0.0
    t = time - 0.5
    gentle = min(1.0, t) * max(0.0, min(1.0, 7.5 - t))
    return gentle * sum(0.35 * math.sin(2 * math.pi * f * t + seed * f) for f in (0.3, 0.7, 1.3)) + 0.4 * gentle


def record(seed: int, drag: float = 0.0, duration: float = 9.0) -> Iterator[tuple[float, float, float, float]]:
    """Yields rows of time, set point, position, drive (V), one per control period."""
    noise = random.Random(seed)
    angle = speed = volts = last = 0.0
    inertia = TRUE["mass"] * TRUE["length"] ** 2 / 3 + TRUE["inertia"]
    for k in range(round(duration / PERIOD)):
        time = k * PERIOD
        read = COUNT * math.floor((angle + noise.gauss(0.0, 0.3 * COUNT)) / COUNT + 0.5)
        error = wanted(time, seed) - read
        command = P * error + D * (error - last) / PERIOD if k else P * error
        last = error
        yield time, wanted(time, seed), read, command
        for i in range(round(PERIOD / STEP)):
            if i * STEP >= DELAY - 1e-12:
                volts = command
            weight = TRUE["mass"] * 9.81 * TRUE["length"] / 2 * math.sin(angle)
            driving = TRUE["gain"] * volts - weight - (TRUE["viscous"] + drag * abs(speed)) * speed
            if abs(speed) < 1e-4 and abs(driving) <= TRUE["coulomb"]:
                speed = 0.0
                continue
            rub = math.copysign(TRUE["coulomb"], speed if abs(speed) >= 1e-4 else driving)
            after = speed + STEP * (driving - rub) / inertia
            speed = 0.0 if speed * after < 0 else after
            angle += STEP * speed


def write(folder: Path, drag: float = 0.0, seeds: tuple[int, ...] = (1, 2)) -> list[Path]:
    """Writes one CSV file per seed, each with a TOML file for data that its columns cannot hold."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for seed in seeds:
        path = folder / f"rig_{seed}.csv"
        with path.open("w", newline="") as stream:
            rows = csv.writer(stream)
            rows.writerow(["time", "set_point_1", "position_1", "drive_1"])
            rows.writerows([f"{value:.9g}" for value in row] for row in record(seed, drag))
        path.with_suffix(".toml").write_text('robot = "single axis"\nperiod = 0.005\ndrive_unit = "V"\n')
        written.append(path)
    return written


if __name__ == "__main__":
    where, *fitted_with = sys.argv[1:] or ["."]
    for made in write(Path(where), PADDLE if fitted_with == ["paddle"] else 0.0):
        print(made)
