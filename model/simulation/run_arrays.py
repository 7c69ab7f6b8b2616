"""Inputs of a compiled run: named tuples of arrays, which compiled code accepts directly."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from model.arrays import Array
from model.dynamics.compilation import compiled, internal


class RecordArrays(NamedTuple):
    """Inputs that move the runs: one row per record, shorter ones padded."""

    lengths: Array
    """(t,) periods of each record."""
    set_points: Array
    """(t, k, n) counts for the board's PID, else rad."""
    recorded: Array
    """(t, k, n) motor volts, for machines without a controller."""
    noise: Array
    """(t, k, n) added to the readings before rounding."""
    readings: Array
    """(t, k, n) rad as recorded, NaN where there is none."""
    following: Array
    """(t,) position of the controller's reading between simulated (0) and recorded (1) reading (`Options`)."""
    first_drive: Array
    """(t, n) commanded volts before the record."""
    gains: Array
    """(t, n, GAINS) of the controllers."""
    settings: Array
    """(t, SETTINGS) integer settings (`model.layout`)."""


class RecordRow(NamedTuple):
    """One record of `RecordArrays`: the same arrays without their first dimension."""

    set_points: Array
    recorded: Array
    noise: Array
    readings: Array
    following: float
    first_drive: Array
    gains: Array
    settings: Array


class RunArrays(NamedTuple):
    """The runs: one row per run, except for arrays that all runs share."""

    which: Array
    """(r,) record of each run."""
    initial: Array
    """(r, n, 2) position and speed."""
    shares: Array
    """(r, SHARED) parameters of the whole machine."""
    parts: Array
    """(r, n, PER_JOINT) parameters of the joints."""
    flags: Array
    """(n,) bits of the state-changing effects of every joint, for all runs."""
    own: Array
    """(n, e, 2) the user's own effects (`model.simulation.own_torque`), for all runs."""
    step: float
    """Longest integration step, s, for all runs."""


class Arm(NamedTuple):
    """The model of one run."""

    shared: Array
    joints: Array
    body: Any
    """Inputs of the equations of motion: an array for the closed form, a chain for the recursive form."""
    flags: Array
    settings: Array
    own: Array


@internal
def record_row(records: RecordArrays, t: int) -> RecordRow:
    """Returns record t, counted from 0."""
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


# --- Chooses the parts of a run at compile time by the type of a tag, so that compiled code can be cached
#
# numba cannot cache a function that takes functions as arguments. Tags are named tuples that matter only by their type;
# each function here has one implementation per type.


OPTIONS: Any = {"error_model": "numpy", "fastmath": {"contract"}}


class ClosedForm(NamedTuple):
    """The waist-shoulder-elbow arm of rods, rigid transmissions."""

    tag: int


class Flexible(NamedTuple):
    """The same arm with a flexible transmission or backlash."""

    tag: int


class AnyChain(NamedTuple):
    """Any machine, by the recursive form."""

    tag: int


class _Type(NamedTuple):
    """Type of a tag, as numba passes it to the function that chooses an implementation."""

    instance_class: type


def uncompiled(choose: Callable[..., Any], kind: Any, *arguments: Any) -> Any:
    """Runs in Python the implementation that numba would compile for a tag.

    Used with NUMBA_DISABLE_JIT=1, to step through a run or to find a fault without the compiler.
    """
    return choose(_Type(type(kind)), *arguments)(kind, *arguments)


def entry(function: Callable[..., Any]) -> Any:
    """Compiles a function that Python calls. It is cached on disk and releases Python's lock."""
    return compiled(function, nogil=True)
