"""Which of the sent set points a controller worked with, where a drive at its limit hides some of them.

The set point in use is the last one that arrived: its age grows by a period where one is lost, and is nothing where one
arrives. Every age has a drive of its own, so the ages are a path through the record, found as Viterbi does: of all
paths, the one whose drive is recorded. A drive at its limit fits every set point that asks for as much or more.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from model.arrays import Floats

OLDEST = 40
"""Largest age that is followed, in periods."""
WRONG = 16.0
"""Cost of a sample whose drive is not what its set point makes, at most; below, its squared distance in resolutions."""
LOSS = 0.05
"""Cost of a lost set point: where it makes no difference, it arrived."""

Memory = tuple[Floats, ...]
"""What a controller remembers, one array (a,) a number, by age."""


class Step(Protocol):
    """The law of a controller for one period."""

    def __call__(self, error: Floats, at: float, memory: Memory, *, limited: bool) -> tuple[Floats, Memory]:
        """Outputs (a,), and the memories after them, for errors (a,) at a position; limited: at the drive's limit."""
        ...


class Path(NamedTuple):
    """Set points in use (k,), the drive (k,) that they make, and that of the set points sent, of the same memory."""

    used: Floats
    formed: Floats
    of_sent: Floats


def follow_received(
    sent: Floats,
    position: Floats,
    drive: Floats,
    limited: NDArray[np.bool_],
    step: Step,
    begin: tuple[float, ...],
    factor: float,
    resolution: float,
) -> Path:
    """The likeliest path of set points in use.

    Args:
        sent, position: (k,) rad. drive: (k,) as recorded. limited: (k,) whether it is at its limit.
        step: the controller's law. begin: what it remembers before the first sample.
        factor: by which the drive is larger than the law makes it. resolution: of the drive.
    """
    count, ages = len(sent), np.arange(OLDEST)
    memory: Memory = tuple(np.full(OLDEST, value) for value in begin)
    cost = np.where(ages == 0, 0.0, np.inf)
    before, outputs, of_sent = (np.zeros((count, OLDEST)) for _ in range(3))
    for k in range(count):
        arrived = int(np.argmin(cost))
        source = np.concatenate([[arrived], ages[:-1]])
        if k == 0:
            source = np.zeros(OLDEST, dtype=np.int64)
        memory = tuple(values[source] for values in memory)
        cost = cost[source] + np.where(ages == 0, 0.0, LOSS)
        cost[ages > k] = np.inf
        wanted = sent[np.maximum(k - ages, 0)]
        at, bound = float(position[k]), bool(limited[k])
        received, _ = step(np.full(OLDEST, sent[k] - at), at, memory, limited=bound)
        output, memory = step(wanted - at, at, memory, limited=bound)
        cost = cost + _misfit(factor * output, float(drive[k]), bound, resolution)
        before[k], outputs[k], of_sent[k] = source, output, received
    path = np.zeros(count, dtype=np.int64)
    path[-1] = int(np.argmin(cost))
    for k in range(count - 1, 0, -1):
        path[k - 1] = int(before[k, path[k]])
    rows = np.arange(count)
    return Path(sent[np.maximum(rows - path, 0)], outputs[rows, path], of_sent[rows, path])


def _misfit(output: Floats, drive: float, limited: bool, resolution: float) -> Floats:
    """Cost (a,) of a recorded drive, for what every age makes of it."""
    short = abs(drive) - output * np.sign(drive) if limited else np.abs(output - drive)
    return np.minimum((np.maximum(short, 0.0) / resolution) ** 2, WRONG)
