"""Recorded drives, replayed in MuJoCo from a model's MJCF: a second opinion on a diagnosis.

Nothing here is code of our simulation. MuJoCo starts again from the recorded motion every `WINDOW`, because a drive
without its controller holds no arm for long.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from daq.contracts.errors import TraceError
from daq.contracts.trace import Trace
from extras.formats.robot_files.mjcf_writer import effects_not_in_mjcf, mjcf_text
from model import layout as at
from model.arrays import Floats
from model.machine_model.model import EffectUse, Model
from model.record_check.check import as_used

WINDOW = 0.25
"""Time (s) for which MuJoCo runs on its own: long enough for a torque to move a joint by more than its noise."""
SLOPE = 0.04
"""Time (s) before and after the start of a window from which the speed there is taken, by a parabola."""
FEWEST = 3
"""Least samples on each side of that start, and in a window."""
STEP = 1e-3
"""Longest step of integration, s."""
GAP = 5.0
"""Distance of two samples, in their median distance, across which nothing is replayed."""


@dataclass(frozen=True, eq=False)
class Replay:
    """What MuJoCo makes of recorded drives with two models.

    joints:  numbers of the joints, from 1; units: of their positions (rad, m)
    before, after: (n,) root mean square of recorded − replayed position with each model
    left_out: effects of the model after that MJCF cannot hold
    """

    joints: tuple[int, ...]
    units: tuple[str, ...]
    before: Floats
    after: Floats
    left_out: tuple[EffectUse, ...]


def replay(before: Model, after: Model, traces: Sequence[Trace]) -> Replay:
    """Replays the drives of traces with a model before and after a diagnosis.

    Raises TraceError for a trace without a recorded drive, or one too short; SpecError for a body that MuJoCo refuses.
    """
    machine = after.machine
    used = as_used(traces, machine)
    errors = [_root_mean_square(np.concatenate([_errors(model, one) for one in used])) for model in (before, after)]
    units = tuple(machine.joint(joint).units.position for joint in machine.modelled_joints)
    return Replay(machine.modelled_joints, units, errors[0], errors[1], effects_not_in_mjcf(after))


def _root_mean_square(errors: Floats) -> Floats:
    return np.asarray(np.sqrt(np.mean(errors**2, axis=0)))


def _errors(model: Model, trace: Trace) -> Floats:
    """Recorded − replayed positions (m, n) of every sample behind the start of a window."""
    columns = [trace.column(joint) for joint in model.machine.modelled_joints]
    if trace.drive is None:
        raise TraceError(f"{trace.called}: has no drive, which a replay needs")
    starts = _starts(trace.time)
    if len(starts) == 0:
        raise TraceError(f"{trace.called}: no {2 * WINDOW:g} s without a gap, which a replay needs")
    engine = mujoco.MjModel.from_xml_string(mjcf_text(model)[0])
    engine.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
    data = mujoco.MjData(engine)
    time, position = trace.time, trace.position[:, columns]
    acts = time + model.vector[at.DELAY]  # when each drive begins to act
    drive = trace.drive[:, columns]
    errors = []
    for first, last in starts:
        data.qpos[:], data.qvel[:] = _state(time, position, first)
        for k in range(first, last):
            _advance(engine, data, time[k], time[k + 1], acts, drive)
            errors.append(position[k + 1] - data.qpos)
    return np.array(errors)


def _advance(engine: mujoco.MjModel, data: mujoco.MjData, now: float, then: float, acts: Floats, drive: Floats) -> None:
    """Integrates from one sample to the next; the drive changes where a recorded one begins to act."""
    changes = acts[(acts > now) & (acts < then)]
    for begin, end in zip((now, *changes), (*changes, then), strict=True):
        data.ctrl[: drive.shape[1]] = drive[max(int(np.searchsorted(acts, begin, "right")) - 1, 0)]
        steps = math.ceil((end - begin) / STEP)
        engine.opt.timestep = (end - begin) / steps
        for _ in range(steps):
            mujoco.mj_step(engine, data)


def _starts(time: Floats) -> list[tuple[int, int]]:
    """First and last sample of each window, none across a gap, with samples for the slope before the first."""
    steps = np.diff(time)
    found = []
    for part in np.split(np.arange(len(time)), np.flatnonzero(steps > GAP * np.median(steps)) + 1):
        first = int(part[0]) + max(FEWEST, int(np.searchsorted(time[part], time[part[0]] + SLOPE)))
        while first <= part[-1] - FEWEST:
            last = max(first + FEWEST, int(np.searchsorted(time, time[first] + WINDOW, "right")) - 1)
            if last > part[-1]:
                break
            found.append((first, last))
            first = last
    return found


def _state(time: Floats, position: Floats, k: int) -> tuple[Floats, Floats]:
    """Position and speed (n,) at a sample: of the parabola through the readings around it."""
    near = np.flatnonzero(np.abs(time - time[k]) <= SLOPE)
    near = np.arange(max(0, min(near[0], k - FEWEST)), min(len(time), max(near[-1], k + FEWEST) + 1))
    away = time[near] - time[k]
    found, *_ = np.linalg.lstsq(np.stack([np.ones_like(away), away, away**2], axis=1), position[near], rcond=None)
    return found[0], found[1]
