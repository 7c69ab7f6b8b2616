"""Where gains could be: patterns of bytes that hold those which errors and powers show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from firmware_protocol.memory_map import JOINTS
from firmware_protocol.units import GAIN_MAX

Columns = tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]
"""Offsets of P, I and D of every joint."""


def gain_columns(held: NDArray[np.int64], measured: Sequence[int | None]) -> list[Columns]:
    """Every regular pattern whose P bytes hold the `measured` gains and whose I and D bytes hold 0.

    held: the constant value of each byte, -1 where it cannot be a gain
    A pattern is three rows, equally far apart, or a record of P, I and D for each joint. With I or D other than 0 a
    power is not in proportion to its error, and there would be no measured gain.
    """
    if any(gain is None or not 1 <= gain <= GAIN_MAX for gain in measured):
        return []
    shapes = [tuple(tuple(row * apart + joint for joint in range(JOINTS)) for row in range(3)) for apart in (6, 8, 16)]
    shapes.append(tuple(tuple(3 * joint + row for joint in range(JOINTS)) for row in range(3)))
    wanted = np.array([measured, [0] * JOINTS, [0] * JOINTS])
    found: list[Columns] = []
    for shape in shapes:
        offsets = np.array(shape)
        for start in range(len(held) - int(offsets.max())):
            if (held[start + offsets] == wanted).all():
                p, i, d = (tuple((start + row).tolist()) for row in offsets)
                found.append((p, i, d))
    return found
