"""Positions as shares of a joint's range: LeRobot's -100 to 100, by its calibration or by a machine file's limits."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from daq.contracts.documents import shown
from daq.contracts.errors import TraceError
from daq.contracts.machine import load_machine, shipped_machines

RANGE_OF = "range of "
"""Begins the unit of such positions; a calibration (.json) or a machine follows."""
GRIPPER = "gripper"
"""The joint whose LeRobot range is 0 to 100, not -100 to 100."""
COUNTS = 4095
"""Counts per turn, in LeRobot's degrees and servo ranges."""
Range = tuple[float, float]
"""rad (m) per unit, and the position (rad, m) at 0."""


def ranges_of(unit: str, beside: Path) -> Callable[[str], Range | None]:
    """Returns a function that gives the range of a joint by name. For a joint that a machine file lacks it is None:
    such a joint is left out.

    Args:
        unit: `range of FILE.json`, or `range of MACHINE`, a machine that ships or a file. beside: a file; others are
            looked for in its folder.

    Raises:
        TraceError: for a file that cannot be read or lacks the range. SpecError: for an unknown machine.
    """
    name = unit.removeprefix(RANGE_OF)
    file = beside.parent / name
    return (lambda joint: _calibrated(file, joint)) if name.endswith(".json") else _of_machine(name, file)


def _calibrated(file: Path, joint: str) -> Range:
    try:
        known: Any = json.loads(file.read_text("utf-8"))[joint]
        span = float(known["range_max"]) - float(known["range_min"])
    except (OSError, ValueError) as error:
        raise TraceError(f"{file}: cannot be read as a LeRobot calibration: {error}") from error
    except (KeyError, TypeError) as error:
        raise TraceError(f"{file}: has no range_min and range_max of joint {shown(joint)}") from error
    return span / (100.0 if joint == GRIPPER else 200.0) * 2 * math.pi / COUNTS, 0.0


def _of_machine(name: str, file: Path) -> Callable[[str], Range | None]:
    machine = load_machine(name if name in shipped_machines() else str(file))
    numbers = {joint.name: number for number, joint in enumerate(machine.joints, start=1)}

    def found(joint: str) -> Range | None:
        if joint not in numbers:
            return None
        limits = machine.limits.joint(numbers[joint])
        if limits.low is None or limits.high is None:
            raise TraceError(f"machine {name}: states no limits of joint {joint}, so its range is not known")
        return (limits.high - limits.low) / 200.0, (limits.high + limits.low) / 2.0

    return found
