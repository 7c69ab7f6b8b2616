"""Key figures of a trace for each joint."""

from __future__ import annotations

import math

import numpy as np

from daq.contracts.service.traces import JointFigureSet
from daq.contracts.trace import Floats, Trace

RISE_FROM, RISE_TO = 0.1, 0.9
"""Shares of the step between which rise time is measured, as usual in control."""
ONE_GO = 0.5
"""Changes of the set point further apart than this (s) are motions of their own."""
AT_REST = 0.01
"""Largest change (rad, m) of a position at rest, an assumption: noise, and bending under load."""


def joints_moved(trace: Trace) -> tuple[int, ...]:
    """Returns the joints that moved: those whose set point changes; without set points, whose position does."""
    return tuple(joint for joint in trace.joints if _moved(trace, trace.column(joint))) if len(trace) else ()


def joint_figures(trace: Trace) -> list[JointFigureSet]:
    """Returns the key figures of every joint of a trace; an empty list for a trace without samples."""
    return [_figures(trace, joint, trace.column(joint)) for joint in trace.joints] if len(trace) else []


def _figures(trace: Trace, joint: int, column: int) -> JointFigureSet:
    machine = trace.record.machine
    prismatic = trace.record.drive_unit == "N" if machine is None else machine.joint(joint).kind == "prismatic"
    scale = 1e3 if prismatic else math.degrees(1.0)
    position = trace.position[:, column] * scale
    set_point = None if trace.set_point is None else trace.set_point[:, column] * scale
    error = None if set_point is None else set_point - position
    drive = None if trace.drive is None else trace.drive[:, column]
    step = None if set_point is None else _step(trace.time, position, set_point)
    return JointFigureSet(
        joint=joint,
        unit="mm" if prismatic else "°",
        moved=_moved(trace, column),
        start=float(position[0]),
        end=float(position[-1]),
        overshoot=None if set_point is None or step is None else _overshoot(position, float(set_point[-1]), step[1]),
        rise_time=None if step is None else _rise_time(trace.time, position, *step),
        largest_error=None if error is None else float(np.abs(error).max()),
        final_error=None if error is None else float(error[-1]),
        largest_drive=None if drive is None else float(np.abs(drive).max()),
    )


def _moved(trace: Trace, column: int) -> bool:
    if trace.set_point is not None:
        return bool(np.ptp(trace.set_point[:, column]) > 0)
    return bool(np.ptp(trace.position[:, column]) > AT_REST)


def _step(time: Floats, position: Floats, set_point: Floats) -> tuple[float, float] | None:
    """Returns where the position rests before the set point changes, and the way of the set point; None unless it goes
    one way in one go."""
    change = np.diff(set_point)
    at = np.flatnonzero(change)
    if not len(at) or np.ptp(np.sign(change[at])) or (np.diff(time[at + 1]) > ONE_GO).any():
        return None
    return float(position[: at[0] + 1].mean()), float(set_point[-1] - set_point[0])


def _overshoot(position: Floats, target: float, way: float) -> float:
    return max(0.0, float(((position - target) * math.copysign(1.0, way)).max()))


def _rise_time(time: Floats, position: Floats, start: float, way: float) -> float | None:
    share = (position - start) / way
    reached = [np.flatnonzero(share >= level) for level in (RISE_FROM, RISE_TO)]
    if not all(len(found) for found in reached):
        return None
    return float(time[reached[1][0]] - time[reached[0][0]])
