"""Finds where a recorded drive is at a limit that no file states: less may act there than is recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from daq.contracts.machine import DcMotor, Machine
from model.arrays import Floats, Mask

AT_LIMIT = 1e-6
"""Share of its largest value within which a drive counts as at the limit."""
RUN = 3
"""Consecutive samples at the largest value that show a limit: a motion passes its largest value once."""
JUMP = 1.5
"""Least jump to or from a limit, in the smallest step between two values of the record."""
SEVERAL = 10
"""Least number of values of a drive that may result from rounding; a switched drive has a few, far apart."""
LATER = 2
"""Largest lag of a drive behind its record, in samples (`drive_timing`)."""
MOST = 0.9
"""Share of samples at the limit above which a drive counts as switched, and is used as recorded."""


def stands_at_limit(drive: Floats, machine: Machine) -> Mask:
    """Returns (r, n) True where a recorded torque, force or current (r, n) is at its limit.

    A current loop, or another source of torque, may fail to supply its largest value: the supply's voltage, minus the
    back-EMF, is not known. For a DC motor the volts are recorded, and the file states the supply.
    """
    found = np.zeros(drive.shape, dtype=bool)
    for column, joint in enumerate(machine.modelled_joints):
        if isinstance(machine.joint(joint).drive, DcMotor):
            continue
        at = at_shown_limit(drive[:, column])
        if at.mean() <= MOST:
            found[:, column] = at
    return found


def at_shown_limit(drive: Floats) -> NDArray[np.bool_]:
    """Returns (r,) True where a recorded drive (r,) is at a limit that the record itself shows.

    A limit shows as several samples at the largest value, with a jump to it or from it. A rounded drive also stays at
    the top of a smooth motion, but reaches it step by step.
    """
    size = np.abs(drive)
    at = size >= (1 - AT_LIMIT) * size.max()
    sizes = np.unique(size)
    if len(sizes) < 2 or sizes[-1] == 0.0:
        return np.zeros(len(drive), dtype=bool)
    jump = JUMP * np.diff(sizes).min() if len(sizes) >= SEVERAL else 0.0
    edges = np.flatnonzero(np.diff(np.concatenate(([False], at, [False])).astype(int)))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        beside = size[max(begin - 1, 0)], size[min(end, len(size) - 1)]
        if end - begin >= RUN and sizes[-1] - min(beside) > jump:
            return np.asarray(at)
    return np.zeros(len(drive), dtype=bool)


def pieces_of(at_limit: NDArray[np.bool_], longest: int) -> list[slice]:
    """Returns the stretches (r,) of one joint at its limit, in pieces of up to `longest` samples.

    Each is slightly longer than the limit, since the drive acts later than it is recorded.
    """
    edges = np.flatnonzero(np.diff(np.concatenate(([False], at_limit, [False])).astype(int)))
    return [
        slice(first, first + longest if first + longest < end else int(end) + LATER)
        for begin, end in zip(edges[::2], edges[1::2], strict=True)
        for first in range(int(begin), int(end), longest)
    ]


class _Recorded(Protocol):
    """The fields of a recorded motion that are used here."""

    @property
    def time(self) -> Floats: ...
    @property
    def at_limit(self) -> Mask: ...
    @property
    def not_known(self) -> Mask: ...


@dataclass(frozen=True)
class DrivesAtLimit:
    """Drives at limits that no file states.

    shares: joints and their share of the time there, over all records. unknown: joints whose torque is not known in
    some record for that reason; not_examined: those for which that holds in all records.
    """

    shares: tuple[tuple[int, float], ...]
    unknown: tuple[int, ...]
    not_examined: tuple[int, ...]


def find_drives_at_limit(records: Sequence[_Recorded], joints: Sequence[int]) -> DrivesAtLimit:
    """Computes how long drives are at such limits; `joints` are the records' columns."""
    weights = [float(np.ptp(r.time)) for r in records]
    shares = np.average([r.at_limit.mean(axis=0) for r in records], axis=0, weights=weights)
    unknown = np.array([r.not_known for r in records])
    some, every = (np.asarray(np.sum(m, axis=0) > 0) for m in (unknown, ~unknown))
    return DrivesAtLimit(
        tuple((j, float(share)) for j, share in zip(joints, shares, strict=True) if share > 0.0),
        tuple(j for j, one in zip(joints, some, strict=True) if one),
        tuple(j for j, known in zip(joints, every, strict=True) if not known),
    )
