"""Dependence of a joint's signal: its mean against time, position, speed, direction and drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np

from daq.contracts.machine import Machine, NoController
from model.arrays import Floats
from model.discrepancy.diagnosis import AgainstWhat
from model.discrepancy.localisation.phases import AskedMotion
from model.discrepancy.localisation.statistics import Bins, binned

AGAINST: tuple[AgainstWhat, ...] = get_args(AgainstWhat)
"""The quantities, in the order in which they are examined."""
BINS = 12
"""Most bins of a quantity."""
BIN_SECONDS = 1.0
"""Least duration of a bin of time, s."""
DIRECTION_EDGES = np.array([-1.5, -0.5, 0.5, 1.5])
"""Edges of the bins of direction: backwards, not yet moved, forwards."""


@dataclass(frozen=True)
class Quantities:
    """Quantities that a signal may depend on, all records of a machine in a row.

    values: by name (m, n), NaN where it is not known. stretches: rows without gaps.
    """

    values: dict[AgainstWhat, Floats]
    units: dict[AgainstWhat, tuple[str, ...]]
    stretches: tuple[slice, ...]


def quantities(motions: Sequence[AskedMotion]) -> Quantities:
    """The quantities of a machine's records. Time is each record's own; the drive is the recorded one."""
    machine = motions[0].machine
    kinds = [machine.joint(j).kind for j in machine.modelled_joints]
    angle = tuple("rad" if k == "revolute" else "m" for k in kinds)
    per_record = [_of_record(asked) for asked in motions]
    stretches, begin = [], 0
    for record in (asked.record for asked in motions):
        stretches += [slice(begin + run.start, begin + run.stop) for run in record.runs]
        begin += len(record.measured)
    return Quantities(
        {name: np.concatenate([q[name] for q in per_record]) for name in AGAINST},
        {
            "time": ("s",) * len(kinds),
            "position": angle,
            "speed": tuple(f"{a}/s" for a in angle),
            "direction": ("1",) * len(kinds),
            "drive": drive_units(machine),
        },
        tuple(stretches),
    )


def drive_units(machine: Machine) -> tuple[str, ...]:
    """Unit of each joint's drive: volts at a motor, or the torque or force of a plain gain."""
    units = []
    for joint in machine.modelled_joints:
        own = machine.joint(joint)
        torque = "N·m" if own.kind == "revolute" else "N"
        units.append({"dc_motor": "V", "current": "A"}.get(own.drive.kind, torque))
    return tuple(units)


def dependence(signal: Floats, joint: int, against: AgainstWhat, known: Quantities, floor: float) -> Bins | None:
    """Means of a signal (m,) of joint (index from 0) against a quantity; None where that does not vary."""
    quantity = known.values[against][:, joint]
    edges = _edges(quantity, against, known.stretches)
    return None if edges is None else binned(signal, quantity, edges, known.stretches, floor)


def _of_record(asked: AskedMotion) -> dict[AgainstWhat, Floats]:
    inputs = asked.record.inputs
    rows = np.round(inputs.rows).astype(np.int64)
    # A controller's drive contains the noise of the reading it responds to; one period later they are uncorrelated.
    late = 0 if isinstance(asked.machine.controller, NoController) else 1
    drive = inputs.drive[np.maximum(rows - late, 0)] if np.any(inputs.drive) else np.full_like(asked.position, np.nan)
    return {
        "time": np.repeat((inputs.time[rows] - inputs.time[0])[:, None], asked.position.shape[1], axis=1),
        "position": asked.position,
        "speed": asked.speed,
        "direction": asked.direction.astype(np.float64),
        "drive": drive,
    }


def _edges(quantity: Floats, against: AgainstWhat, stretches: Sequence[slice]) -> Floats | None:
    """Edges of the bins: equally spaced in time and position, equally filled in speed and drive, where most values are
    near zero."""
    values = np.concatenate([quantity[s] for s in stretches])
    values = values[np.isfinite(values)]
    if len(values) == 0 or np.ptp(values) < 1e-9:
        return None
    if against == "direction":
        return DIRECTION_EDGES
    low, high = float(values.min()), float(values.max())
    if against == "time":
        return np.linspace(low, high + 1e-9, 1 + int(np.clip((high - low) // BIN_SECONDS, 2, BINS)))
    if against == "position":
        return np.linspace(low, high + 1e-9, BINS + 1)
    moving = values[np.abs(values) > 0.02 * np.abs(values).max()]
    inner = np.quantile(moving, np.linspace(0, 1, BINS + 1)) if len(moving) > BINS else np.linspace(low, high, BINS + 1)
    edges = np.unique(np.concatenate([[low], inner[1:-1], [high + 1e-9]]))
    return edges if len(edges) > 2 else None
