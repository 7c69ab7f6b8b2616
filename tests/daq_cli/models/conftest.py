"""The command line of models: the same empty folder as for every other command, and traces of pretended rigs."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from model.arrays import Floats
from tests.daq_cli.conftest import daq, empty_folder

__all__ = ["daq", "empty_folder"]

ROOT = Path(__file__).parents[3]
SINGLE_AXIS = ROOT / "examples" / "single_axis.toml"


@pytest.fixture
def single_axis() -> Path:
    """Machine file of a single axis."""
    return SINGLE_AXIS


def write_csv(path: Path, count: int = 200, joints: int = 1, scale: float = 1.0, amplitude: float = 0.3) -> Path:
    """A trace in which every joint follows a sine of `amplitude` (rad), angles multiplied by `scale`."""
    time = 0.005 * np.arange(count)
    wanted = scale * (1.0 + amplitude * np.sin(2 * np.pi * time))
    names = [f"{signal}_{j + 1}" for j in range(joints) for signal in ("set_point", "position", "drive")]
    lines = [",".join(["time", *names])]
    for t, value in zip(time, wanted, strict=True):
        lines.append(",".join([f"{t:.6f}", *([f"{value:.9f}", f"{value:.9f}", "0.5"] * joints)]))
    path.write_text("\n".join(lines) + "\n")
    return path


def swing_csv(
    path: Path,
    torque: Callable[[Floats, Floats, Floats], Floats],
    seed: int = 0,
    count: int = 1200,
    limit: float | None = None,
) -> Path:
    """A record of an axis whose angle is a sum of sines, with the drive (V, each 0.5 N·m) that it needs.

    torque: of angle, speed and acceleration; limit: where the drive (V) is cut off, the motion is not.
    """
    time = 0.005 * np.arange(count)
    angle = 0.4 * np.sin(np.array([[2.1], [3.7], [6.0]]) * time + seed + np.arange(3)[:, None]).sum(axis=0)
    speed = np.gradient(angle, 0.005)
    needed = torque(angle, speed, np.gradient(speed, 0.005))
    drive = np.interp(time + 0.0035, time, needed) / 0.5  # it acts after 1 ms and is held for 5 ms
    if limit is not None:
        drive = np.clip(drive, -limit, limit)
    rows = np.column_stack([time, angle, angle, drive])
    np.savetxt(path, rows, delimiter=",", header="time,set_point_1,position_1,drive_1", comments="", fmt="%.9g")
    return path


def write_swing(path: Path, seed: int, limit: float | None = None) -> Path:
    """A hanging rod of 0.8 kg and 0.3 m that swings; the drive is cut off at a limit (V), the motion is not."""

    def torque(angle: Floats, speed: Floats, acceleration: Floats) -> Floats:
        inertial = (0.8 * 0.3**2 / 3 + 0.004) * acceleration + 0.8 * 9.81 * 0.15 * np.sin(angle)
        return inertial + 0.02 * speed + 0.02 * np.sign(speed)

    return swing_csv(path, torque, seed, limit=limit)
