"""Where a recorded drive stands at a limit that no file states: what acts there may be less than what is recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from daq.contracts.machine import DcMotor, Machine
from model.arrays import Floats, Mask

AT_LIMIT = 1e-6
"""Share of its largest value within which a drive stands at it."""
RUN = 3
"""Samples in a row at the largest value that show a limit: a motion passes its largest value once."""
JUMP = 1.5
"""Least jump to a limit or from it, in the smallest step between two sizes of the record."""
SEVERAL = 10
"""Fewest sizes of a drive that may be those of rounding; one that switches has a few, far apart."""
LATER = 2
"""Samples by which a drive may act later than it is recorded, at most (`drive_timing`)."""
MOST = 0.9
"""Share of the samples beyond which a drive only switches, and is taken as it was recorded."""


def stands_at_limit(drive: Floats, machine: Machine) -> Mask:
    """(r, n) where a recorded torque, force or current (r, n) is at its limit.

    A current loop, or whatever forms a torque, is asked for its largest value where it may not give it: the supply's
    voltage, less the back-EMF, is not known. Of a DC motor the volts are recorded, and the file states the supply.
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
    """(r,) where one recorded drive (r,) is at a limit that it shows itself; nowhere where it shows none.

    It shows one by standing at its largest size for several samples, and by a jump to it or from it. A drive that is
    rounded also stands at the top of a smooth motion, and comes there step by step.
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
    """The stretches (r,) of one joint at its limit, in pieces of `longest` samples at most; each a little longer than
    the limit, since what is asked for acts later."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], at_limit, [False])).astype(int)))
    return [
        slice(first, first + longest if first + longest < end else int(end) + LATER)
        for begin, end in zip(edges[::2], edges[1::2], strict=True)
        for first in range(int(begin), int(end), longest)
    ]


class _Recorded(Protocol):
    """What is read of a recorded motion."""

    @property
    def time(self) -> Floats: ...
    @property
    def at_limit(self) -> Mask: ...
    @property
    def not_known(self) -> Mask: ...


@dataclass(frozen=True)
class DrivesAtLimit:
    """Where drives stand at limits that no file states.

    shares: joints and their share of the time there, of all records. unknown: joints of which some record tells
    nothing for that reason; not_examined: those of which none does.
    """

    shares: tuple[tuple[int, float], ...]
    unknown: tuple[int, ...]
    not_examined: tuple[int, ...]


def find_drives_at_limit(records: Sequence[_Recorded], joints: Sequence[int]) -> DrivesAtLimit:
    """How much of records their drives stand at such limits; `joints` are the records' columns."""
    weights = [float(np.ptp(r.time)) for r in records]
    shares = np.average([r.at_limit.mean(axis=0) for r in records], axis=0, weights=weights)
    unknown = np.array([r.not_known for r in records])
    some, every = (np.asarray(np.sum(m, axis=0) > 0) for m in (unknown, ~unknown))
    return DrivesAtLimit(
        tuple((j, float(share)) for j, share in zip(joints, shares, strict=True) if share > 0.0),
        tuple(j for j, one in zip(joints, some, strict=True) if one),
        tuple(j for j, known in zip(joints, every, strict=True) if not known),
    )
