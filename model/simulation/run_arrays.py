"""What a compiled run reads: named tuples of arrays, which compiled code takes as they are."""

from __future__ import annotations

from typing import Any, NamedTuple

from model.arrays import Array
from model.dynamics.compilation import internal


class RecordArrays(NamedTuple):
    """What moves the runs: one row a record, the periods of shorter ones padded."""

    lengths: Array
    """(t,) periods of each record."""
    set_points: Array
    """(t, k, n) counts for the board's PID, else rad."""
    recorded: Array
    """(t, k, n) motor volts, where nothing controls."""
    noise: Array
    """(t, k, n) added to the readings before rounding."""
    readings: Array
    """(t, k, n) rad as recorded, NaN where there is none."""
    following: Array
    """(t,) share of the difference to the recorded reading that the controller is given (`Options`)."""
    first_drive: Array
    """(t, n) commanded volts before the record."""
    gains: Array
    """(t, n, GAINS) of the controllers."""
    settings: Array
    """(t, SETTINGS) whole numbers (`model.layout`)."""


class RecordRow(NamedTuple):
    """One record of `RecordArrays`, (k, n) and so on."""

    set_points: Array
    recorded: Array
    noise: Array
    readings: Array
    following: float
    first_drive: Array
    gains: Array
    settings: Array


class RunArrays(NamedTuple):
    """The runs: one row a run, but for what all of them share."""

    which: Array
    """(r,) record of each run."""
    initial: Array
    """(r, n, 2) position and speed."""
    shares: Array
    """(r, SHARED) numbers of the whole machine."""
    parts: Array
    """(r, n, PER_JOINT) numbers of the joints."""
    flags: Array
    """(n,) bits of the state-changing effects of every joint, for all runs."""
    own: Array
    """(n, e, 2) the user's own effects (`model.simulation.own_torque`), for all runs."""
    step: float
    """Longest step of integration, s, for all runs."""


class Arm(NamedTuple):
    """The model of one run."""

    shared: Array
    joints: Array
    body: Any
    """What the equations of motion read: an array for the closed form, a chain for the recursive form."""
    flags: Array
    settings: Array
    own: Array


@internal
def record_row(records: RecordArrays, t: int) -> RecordRow:
    """Record number t, from 0."""
    return RecordRow(
        records.set_points[t],
        records.recorded[t],
        records.noise[t],
        records.readings[t],
        records.following[t],
        records.first_drive[t],
        records.gains[t],
        records.settings[t],
    )
