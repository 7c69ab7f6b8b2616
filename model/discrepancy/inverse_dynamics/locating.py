"""Where residual torques are beyond noise, and the shape of what no effect explains."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from model.discrepancy.diagnosis import (
    UNWRITTEN,
    AgainstWhat,
    Dependence,
    Phase,
    PhaseCell,
    RemainingShape,
    Where,
    WorstPlace,
)
from model.discrepancy.inverse_dynamics.judging import torque_unit
from model.discrepancy.inverse_dynamics.likelihood import Stretches
from model.discrepancy.inverse_dynamics.records import TorqueRecord
from model.discrepancy.localisation.dependence import AGAINST, Quantities, dependence
from model.discrepancy.localisation.statistics import Bins, correlation_of, significance_of_chi_square
from model.machine_model.model import Model

Floats = NDArray[np.float64]

WINDOW = 0.5
"""s of one cell of the map."""
LEAST = 0.3
"""Least deviation of a residual, in that of noise, from which its correlation is taken."""
FAST = 0.5
"""Share of a joint's acceleration (95 % quantile) beyond which it starts to move, or turns; and"""
SLOW = 0.15
"""of its speed below which it creeps."""
SHAPE_SIGNIFICANCE = 6.0
SHAPE_SHARE = 0.15
"""What a shape of the remaining torque must have to be shown: standard deviations, and a share of the variance."""
BEYOND_NOISE = 1.5
"""Times the noise that a remaining torque must be."""


def phases(record: TorqueRecord, joint: int) -> list[Phase]:
    """Phase of a joint (index) at each compared sample, from its own motion."""
    speed, change = record.speed[record.rows, joint], record.acceleration[record.rows, joint]
    fast = FAST * float(np.quantile(np.abs(change), 0.95)) + 1e-12
    slow = SLOW * float(np.quantile(np.abs(speed), 0.95)) + 1e-12
    found: list[Phase] = []
    for v, a, moves in zip(speed, change, record.moving[:, joint], strict=True):
        if not moves:
            found.append("hold")
        elif abs(v) < slow:
            found.append("reversal" if abs(a) > fast else "creep")
        else:
            found.append("ramp_start" if abs(a) > fast else "steady_ramp")
    return found


def located(
    model: Model, records: Sequence[TorqueRecord], residual: Sequence[Floats], stretches: Stretches, floor: Floats
) -> Where:
    """Map of the residual, in units of its noise, and what it goes with."""
    cells: list[PhaseCell] = []
    dependences: list[Dependence] = []
    worst: tuple[float, int, Phase] | None = None
    for j, joint in enumerate(model.machine.modelled_joints):
        pieces = stretches.of_joint(residual, j)
        if not pieces:
            continue
        correlation = correlation_of([p / floor[j] for p in pieces], LEAST)
        squares: dict[Phase, float] = {}
        for i, rows in stretches.by_joint[j]:
            record = records[i]
            named = phases(record, j)
            size = max(1, round(WINDOW / (record.period * record.every)))
            for begin in range(rows.start, rows.stop, size):
                window = slice(begin, min(begin + size, rows.stop))
                square = float(np.mean((residual[i][window, j] / floor[j]) ** 2))
                count = window.stop - window.start
                phase = max(set(named[window]), key=named[window].count)
                squares[phase] = squares.get(phase, 0.0) + square * count
                cells.append(PhaseCell(
                    joint=joint, start=_time(record, window.start), end=_time(record, window.stop), phase=phase,
                    mean_square=square, trace=i,
                    significance=float(significance_of_chi_square(square, correlation.samples_of_square(count))),
                ))  # fmt: skip
        dependences += [_dependence(joint, a, b, u) for a, b, u in _bins(model, records, residual, stretches, j, floor)]
        phase = max(squares, key=lambda p: squares[p])
        relative = float(np.sqrt(np.mean(np.concatenate(pieces) ** 2))) / floor[j]
        if worst is None or relative > worst[0]:
            worst = relative, joint, phase
    if worst is None:
        return Where(joint=None, phase=None, summary=UNWRITTEN, cells=(), dependences=())
    ratio, joint, where = worst
    unit = torque_unit(model, joint)
    rms = ratio * floor[model.machine.modelled_joints.index(joint)]
    place = WorstPlace(joint=joint, phase=where, ratio=ratio, rms=rms, unit=unit, whole_record=True)
    return Where(
        joint=joint, phase=where, summary=UNWRITTEN, cells=tuple(cells), dependences=tuple(dependences), worst=place
    )


def remaining_shapes(
    model: Model, records: Sequence[TorqueRecord], residual: Sequence[Floats], stretches: Stretches, floor: Floats
) -> tuple[RemainingShape, ...]:
    """Per joint, the dependence that explains most of a torque beyond noise, where there is a significant one."""
    found = []
    for j, joint in enumerate(model.machine.modelled_joints):
        pieces = stretches.of_joint(residual, j)
        if not pieces or float(np.sqrt(np.mean(np.concatenate(pieces) ** 2))) < BEYOND_NOISE * floor[j]:
            continue
        every = [
            (b.explained, a, b, u)
            for a, b, u in _bins(model, records, residual, stretches, j, floor)
            if b.significance > SHAPE_SIGNIFICANCE and b.explained > SHAPE_SHARE
        ]
        if every:
            explained, against, bins, unit = max(every, key=lambda e: e[0])
            found.append(RemainingShape(
                joint=joint, against=against, unit=unit, torque_unit=torque_unit(model, joint),
                centres=tuple(map(float, bins.centres)), torque=_optional(bins.mean),
                deviation=_optional(bins.deviation), explained=explained,
            ))  # fmt: skip
    return tuple(found)


def _time(record: TorqueRecord, row: int) -> float:
    return round(float(record.time[record.edge] + row * record.every * record.period - record.time[0]), 4)


def _bins(
    model: Model, records: Sequence[TorqueRecord], residual: Sequence[Floats], stretches: Stretches, j: int,
    floor: Floats,
) -> list[tuple[AgainstWhat, Bins, str]]:  # fmt: skip
    """Dependences of what is left of joint index `j`: quantity, bins, unit of the quantity."""
    joint = model.machine.joint(model.machine.modelled_joints[j])
    angle = "rad" if joint.kind == "revolute" else "m"
    drive = "V" if joint.drive.kind == "dc_motor" else torque_unit(model, model.machine.modelled_joints[j])
    begins = np.cumsum([0, *(len(r) for r in residual)])
    own = tuple(slice(int(begins[i]) + s.start, int(begins[i]) + s.stop) for i, s in stretches.by_joint[j])

    def every(pick: str) -> Floats:
        return np.concatenate([getattr(r, pick)[r.rows] for r in records])

    time = np.concatenate(
        [np.repeat((r.time[r.rows] - r.time[0])[:, None], residual[0].shape[1], axis=1) for r in records]
    )
    count = residual[0].shape[1]
    known = Quantities(
        {"time": time, "position": every("position"), "speed": every("speed"), "direction": np.sign(every("speed")),
         "drive": every("drive")},
        {"time": ("s",) * count, "position": (angle,) * count, "speed": (f"{angle}/s",) * count,
         "direction": ("1",) * count, "drive": (drive,) * count},
        own,
    )  # fmt: skip
    signal = np.concatenate(list(residual))[:, j]
    found = []
    for against in AGAINST:
        bins = dependence(signal, j, against, known, LEAST * float(floor[j]))
        if bins is not None:
            found.append((against, bins, known.units[against][j]))
    return found


def _dependence(joint: int, against: AgainstWhat, bins: Bins, unit: str) -> Dependence:
    return Dependence(
        joint=joint, against=against, unit=unit, centres=tuple(map(float, bins.centres)), residual=_optional(bins.mean),
        deviation=_optional(bins.deviation), significance=bins.significance,
    )  # fmt: skip


def _optional(values: Floats) -> tuple[float | None, ...]:
    return tuple(None if math.isnan(v) else float(v) for v in values)
