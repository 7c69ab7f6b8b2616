"""Faults of records, put into the records of any rig at drawn places and sizes.

Each is written as what it is in a laboratory: a lost byte, a counter that wraps, a cable that hangs, rows cut out of a
file, a column in other units. None knows how faults are looked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.random import Generator

from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from model.arrays import Floats


@dataclass(frozen=True)
class Faulty:
    """A record with a fault; the kinds of findings that say it, joint (None: all) and time (s) where one was drawn."""

    trace: Trace
    kinds: tuple[str, ...]
    joint: int | None = None
    time: float | None = None


Fault = Callable[[Trace, Machine, Generator], Faulty | None]
"""A record with the fault; None where the record has nothing that it could be put into."""


def _source(trace: Trace, machine: Machine, joint: int) -> tuple[str, Floats]:
    """The column that a joint's sensor measures."""
    sensor = machine.joint(joint).sensor
    name = "velocity" if sensor is not None and sensor.measures == "velocity" else "position"
    return name, getattr(trace, name)[:, trace.column(joint)].copy()


def _with(trace: Trace, name: str, joint: int, signal: Floats) -> Trace:
    whole = getattr(trace, name).copy()
    whole[:, trace.column(joint)] = signal
    return replace(trace, **{name: whole})


def _joint(machine: Machine, draw: Generator) -> int:
    return int(draw.choice(machine.modelled_joints))


def spikes(trace: Trace, machine: Machine, draw: Generator) -> Faulty:
    """Six readings of one sample, far from their neighbours: half a radian, or half of the travel."""
    joint = _joint(machine, draw)
    name, signal = _source(trace, machine, joint)
    size = draw.uniform(0.5, 1.5) * (0.5 if machine.joint(joint).kind == "revolute" else 0.5 * np.ptp(signal))
    if name == "velocity":
        size = draw.uniform(1.0, 2.0) * np.ptp(signal)
    rows = np.sort(draw.choice(np.arange(20, len(signal) - 20, 10), 6, replace=False))
    signal[rows] += size * draw.choice([-1.0, 1.0], 6)
    return Faulty(_with(trace, name, joint, signal), ("spikes",), joint, float(trace.time[rows[0]]))


def drive_spikes(trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    """Three values of a drive, of one sample, far beyond all others."""
    return _column_spikes("drive", trace, machine, draw)


def set_point_spikes(trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    """The same of a set point."""
    return _column_spikes("set_point", trace, machine, draw)


def _column_spikes(name: str, trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    if getattr(trace, name) is None:
        return None
    joint = _joint(machine, draw)
    signal = getattr(trace, name)[:, trace.column(joint)].copy()
    rows = np.sort(draw.choice(np.arange(20, len(signal) - 20, 10), 3, replace=False))
    signal[rows] += draw.uniform(4.0, 8.0) * np.ptp(signal) * draw.choice([-1.0, 1.0], 3)
    return Faulty(_with(trace, name, joint, signal), ("spikes",), joint, float(trace.time[rows[0]]))


def wraps(trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    """An encoder of one turn, whose end lies within the motion."""
    turning = [j for j in machine.modelled_joints if machine.joint(j).kind == "revolute"]
    turning = [j for j in turning if _source(trace, machine, j)[0] == "position"]
    if not turning:
        return None
    joint = int(draw.choice(turning))
    _, signal = _source(trace, machine, joint)
    low, high = np.quantile(signal, [0.2, 0.8])
    end = draw.uniform(low, high)
    wrapped = end + (signal - end) % (2 * math.pi)
    rows = np.flatnonzero(np.abs(np.diff(wrapped)) > math.pi)
    return Faulty(_with(trace, "position", joint, wrapped), ("wraps",), joint, float(trace.time[rows[0] + 1]))


def stuck(trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    """Half a second in which the reading is that before, where the joint goes on by a fifth of its travel or more."""
    joint = _joint(machine, draw)
    name, signal = _source(trace, machine, joint)
    if name == "velocity":
        return None
    rows = max(6, round(0.5 / float(np.median(np.diff(trace.time)))))
    moved = np.abs(signal[rows:] - signal[:-rows])
    places = np.flatnonzero(moved[20:-20] > 0.2 * np.ptp(signal)) + 20
    if not len(places):
        return None
    row = int(draw.choice(places))
    signal[row : row + rows] = signal[row]
    return Faulty(_with(trace, name, joint, signal), ("stuck",), joint, float(trace.time[row]))


def dead_from_the_middle(trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    """An encoder that dies while its joint moves fast, in the middle half of the record, and stays dead."""
    return _dead(trace, machine, draw, slice(None))


def dead_at_the_beginning(trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    """The same from the beginning: it wakes up while its joint moves fast."""
    return _dead(trace, machine, draw, slice(None, None, -1))


def _dead(trace: Trace, machine: Machine, draw: Generator, order: slice) -> Faulty | None:
    joint = _joint(machine, draw)
    name, signal = _source(trace, machine, joint)
    if name == "velocity":
        return None
    passed = signal[order].copy()
    quarter, around = len(passed) // 4, 4
    speeds = np.abs(passed[2 * around :] - passed[: -2 * around])[quarter - around : -quarter]
    row = quarter + int(draw.choice(np.flatnonzero(speeds >= np.quantile(speeds, 0.95))))
    passed[row:] = passed[row]
    first = row if order.step is None else 0
    return Faulty(_with(trace, name, joint, passed[order]), ("stuck", "saturated"), joint, float(trace.time[first]))


def saturated(trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    """Readings that end at a value which the motion passes at speed, and goes beyond for a while."""
    joint = _joint(machine, draw)
    name, signal = _source(trace, machine, joint)
    bound = float(np.quantile(signal, draw.uniform(0.7, 0.9)))
    cut = np.minimum(signal, bound)
    above = np.flatnonzero(np.diff(np.concatenate([[0], (signal >= bound).astype(int), [0]])))
    usual = float(np.sqrt(np.mean(np.diff(cut) ** 2)))
    entered = [int(k) for k, end in zip(above[::2], above[1::2], strict=True) if end - k >= 8 and k > 8]
    entered = [k for k in entered if np.diff(signal[k - 4 : k + 1]).min() > 1.5 * usual]
    if not entered:
        return None
    return Faulty(_with(trace, name, joint, cut), ("saturated",), joint, float(trace.time[entered[0]]))


def cut_out(trace: Trace, machine: Machine, draw: Generator) -> Faulty:
    """Two seconds that are not in the file."""
    rows = round(2.0 / float(np.median(np.diff(trace.time))))
    row = int(draw.integers(20, max(21, len(trace) - rows - 20)))
    kept = np.r_[0 : row + 1, row + rows : len(trace)]
    return Faulty(_rows(trace, kept), ("gap",), None, float(trace.time[row]))


def bursts(trace: Trace, machine: Machine, draw: Generator) -> Faulty:
    """Stamps of arrival through a buffer that is emptied after 1.2 to 4 samples."""
    usual = float(np.median(np.diff(trace.time)))
    latency = usual * draw.uniform(1.2, 4.0)
    time = np.ceil(trace.time / latency - draw.uniform(0.0, 1.0)) * latency
    for row in range(1, len(time)):
        time[row] = max(time[row], time[row - 1] + min(2e-4, 0.02 * usual))
    return Faulty(replace(trace, time=time), ("bursts",))


def milliseconds(trace: Trace, machine: Machine, draw: Generator) -> Faulty:
    """Times in ms."""
    return Faulty(replace(trace, time=1e3 * trace.time), ("time-scale", "drive-scale", "velocity-differs"))


def slow_times(trace: Trace, machine: Machine, draw: Generator) -> Faulty:
    """Times twice as long."""
    return Faulty(replace(trace, time=2.0 * trace.time), ("time-scale", "velocity-differs"))


def slipped(trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    """An encoder that slips by nearly a turn, or by several, while it turns."""
    turning = [j for j in machine.modelled_joints if machine.joint(j).kind == "revolute"]
    turning = [j for j in turning if _source(trace, machine, j)[0] == "position"]
    if not turning:
        return None
    joint = int(draw.choice(turning))
    _, signal = _source(trace, machine, joint)
    row = int(draw.choice(np.flatnonzero(np.diff(signal[:-20]))[20:])) + 2
    signal[row:] += 2 * math.pi * draw.choice([0.92, 1.08, 2.0, 3.0])
    return Faulty(_with(trace, "position", joint, signal), ("jump",), joint, float(trace.time[row]))


def late_drive(trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    """Drives one row too low."""
    if trace.drive is None:
        return None
    return Faulty(replace(trace, drive=np.concatenate([trace.drive[:1], trace.drive[:-1]])), ("drive-late",))


def swapped_set_points(trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    """Positions and set points exchanged."""
    if trace.set_point is None:
        return None
    return Faulty(replace(trace, position=trace.set_point, set_point=trace.position), ("columns-swapped",))


def swapped_drive(trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    """Positions and drives exchanged."""
    if trace.drive is None:
        return None
    swapped = replace(trace, position=trace.drive, drive=trace.position)
    return Faulty(swapped, ("columns-swapped", "units-differ", "drive-scale", "drive-zero", "position-unit"))


def degrees(trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    """Angles in degrees."""
    if any(machine.joint(j).kind != "revolute" for j in machine.modelled_joints):
        return None
    turned: dict[str, Any] = {
        name: np.degrees(getattr(trace, name))
        for name in ("position", "set_point", "velocity")
        if getattr(trace, name) is not None
    }
    return Faulty(replace(trace, **turned), ("position-unit",))


def thousand_drive(trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    """A drive in mA for A, mV for V."""
    return None if trace.drive is None else Faulty(replace(trace, drive=1e3 * trace.drive), ("drive-scale",))


def no_drive(trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    """A drive that nobody recorded."""
    return None if trace.drive is None else Faulty(replace(trace, drive=0.0 * trace.drive), ("drive-zero",))


def turned_drive(trace: Trace, machine: Machine, draw: Generator) -> Faulty | None:
    """A drive of the other sign."""
    kinds = ("drive-sign", "gravity-reversed")
    return None if trace.drive is None else Faulty(replace(trace, drive=-trace.drive), kinds)


def _rows(trace: Trace, kept: Any) -> Trace:
    names = ("time", "position", "set_point", "error", "drive", "velocity", "power_raw", "tick", "host_time", "status")
    names = (*names, "taken")
    return replace(trace, **{n: getattr(trace, n)[kept] for n in names if getattr(trace, n) is not None})


FAULTS: dict[str, Fault] = {
    one.__name__: one
    for one in (
        spikes,
        drive_spikes,
        set_point_spikes,
        wraps,
        slipped,
        stuck,
        dead_from_the_middle,
        dead_at_the_beginning,
        saturated,
        cut_out,
        bursts,
        milliseconds,
        slow_times,
        late_drive,
        swapped_set_points,
        swapped_drive,
        degrees,
        thousand_drive,
        no_drive,
        turned_drive,
    )
}
