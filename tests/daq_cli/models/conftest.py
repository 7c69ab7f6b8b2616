"""The command line of models: the same empty folder as for every other command, and traces of pretended rigs."""

from pathlib import Path

import numpy as np
import pytest

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
