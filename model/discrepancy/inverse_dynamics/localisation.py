"""Where residual torques exceed noise, and the shape of what no effect explains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from model.arrays import Floats
from model.discrepancy.diagnosis import (
    CLEAR_SHAPE,
    UNWRITTEN,
    AgainstWhat,
    Dependence,
    Phase,
    PhaseCell,
    RemainingShape,
    Where,
    WorstPlace,
)
from model.discrepancy.engine.fitting import Fit
from model.discrepancy.localisation.disagreement import WINDOW
from model.discrepancy.localisation.statistics import (
    LEAST,
    Quantities,
    correlation_of,
    dependence,
    dependences,
    optional,
    significance_of_chi_square,
    table_of,
    units_of,
)
from model.discrepancy.localisation.structure import LINE
from model.inverse_dynamics.recorded_motion import RecordedMotion
from model.machine_model.model import Model

FAST = 0.5
"""Acceleration above which a joint starts to move or turns back, as a share of its larger ones (95 % quantile)."""
SLOW = 0.15
"""Speed below which a joint creeps, as a share of its larger ones (95 % quantile)."""
SHAPE_SHARE = 0.15
"""Least share of the remaining torque's variance that a shape must explain."""
BEYOND_NOISE = 1.5
"""Least remaining torque that is given a shape, in noise floors."""


def phases(record: RecordedMotion, joint: int) -> list[Phase]:
    """Phase of motion of a joint (index) at each compared sample."""
    speed, change = record.speed[record.rows, joint], record.acceleration[record.rows, joint]
    fast = FAST * float(np.quantile(np.abs(change), 0.95)) + 1e-12
    slow = SLOW * float(np.quantile(np.abs(speed), 0.95)) + 1e-12
    turns, creeps, moves = np.abs(change) > fast, np.abs(speed) < slow, record.moving[:, joint]
    names: list[Phase] = ["hold", "reversal", "creep", "ramp_start", "steady_ramp"]
    number = np.where(~moves, 0, np.where(creeps, np.where(turns, 1, 2), np.where(turns, 3, 4)))
    return [names[k] for k in number]


def torque_unit(model: Model, joint: int) -> str:
    """N·m, or N on a prismatic joint."""
    return "N·m" if model.machine.joint(joint).kind == "revolute" else "N"


def locate(now: Fit, records: Sequence[RecordedMotion], noise: Floats) -> Where:
    """Map of the residual, in units of its noise (n,), and the quantities that it depends on."""
    model, residual, samples = now.model, now.signals, now.compared.samples
    cells: list[PhaseCell] = []
    dependences: list[Dependence] = []
    places: list[WorstPlace] = []
    sizes = np.sqrt(now.squares)
    for j, joint in enumerate(model.machine.modelled_joints):
        pieces = samples.pieces(residual, j)
        if not pieces or not np.isfinite(sizes[j]):
            continue
        correlation = correlation_of([p / noise[j] for p in pieces], LEAST)
        squares: dict[Phase, float] = {}
        for i, rows in samples.runs[j]:
            record = records[i]
            named = phases(record, j)
            size = max(1, round(WINDOW / (record.period * record.every)))
            for begin in range(rows.start, rows.stop, size):
                window = slice(begin, min(begin + size, rows.stop))
                square = float(np.mean((residual[i][window, j] / noise[j]) ** 2))
                count = window.stop - window.start
                phase = max(dict.fromkeys(named[window]), key=named[window].count)
                squares[phase] = squares.get(phase, 0.0) + square * count
                significance = significance_of_chi_square(square, correlation.samples_of_square(count))
                cells.append(
                    PhaseCell(
                        joint=joint,
                        start=_time(record, window.start),
                        end=_time(record, window.stop),
                        phase=phase,
                        mean_square=square,
                        significance=float(significance),
                        trace=i,
                    )
                )
        signal, floor = _signal(now, j), LEAST * float(noise[j])
        dependences += table_of(signal, j, joint, _quantities(now, records, j), floor)
        phase = max(squares, key=lambda p: squares[p])
        relative = float(sizes[j]) / noise[j]
        rms, unit = relative * noise[j], torque_unit(model, joint)
        places.append(WorstPlace(joint=joint, phase=phase, ratio=relative, rms=rms, unit=unit, whole_record=True))
    if not places:
        return Where(joint=None, phase=None, summary=UNWRITTEN, cells=(), dependences=())
    worst = max(places, key=lambda p: p.ratio)
    largest = max((p for p in places if p.unit == worst.unit), key=lambda p: p.rms or 0.0)
    return Where(
        joint=worst.joint,
        phase=worst.phase,
        summary=UNWRITTEN,
        cells=tuple(cells),
        dependences=tuple(dependences),
        worst=worst,
        largest=None if largest is worst else largest,
    )


def remaining_shapes(now: Fit, records: Sequence[RecordedMotion], noise: Floats) -> tuple[RemainingShape, ...]:
    """Per joint, the dependence that explains most of a torque beyond noise, where there is a significant one."""
    model, found = now.model, []
    sizes = np.sqrt(np.nan_to_num(now.squares))
    for j, joint in enumerate(model.machine.modelled_joints):
        if sizes[j] < BEYOND_NOISE * noise[j]:
            continue
        signal, floor = _signal(now, j), LEAST * float(noise[j])
        known = _quantities(now, records, j)
        every = [(bins, against, False) for against, bins in dependences(signal, j, known, floor)]
        # friction of a tight spot changes its sign with the motion: its mean over both directions shows nothing
        rubs = dependence(-signal * known.values["direction"][:, j], j, "position", known, floor)
        every += [] if rubs is None else [(rubs, "position", True)]
        shown = [e for e in every if e[0].significance > LINE and e[0].explained > SHAPE_SHARE]
        if shown:
            bins, against, against_motion = max(shown, key=lambda e: e[0].explained)
            found.append(
                RemainingShape(
                    joint=joint,
                    against=against,
                    unit=known.units[against][j],
                    torque_unit=torque_unit(model, joint),
                    centres=tuple(map(float, bins.centres)),
                    torque=optional(bins.mean),
                    deviation=optional(bins.deviation),
                    explained=bins.explained,
                    against_motion=against_motion,
                )
            )
    return tuple(found)


def is_function_of(torque: Sequence[Floats], now: Fit, noise: Floats, j: int) -> bool:
    """Whether much of what is left on a joint (index) is a function of a torque (m, n) of every record."""
    known = Quantities({"drive": np.concatenate(list(torque))}, {}, _stretches(now, j))
    bins = dependence(_signal(now, j), j, "drive", known, LEAST * float(noise[j]))
    return bins is not None and bins.significance > LINE and bins.explained >= CLEAR_SHAPE


def _time(record: RecordedMotion, row: int) -> float:
    return round(float(record.time[record.edge] + row * record.every * record.period - record.time[0]), 4)


def _signal(now: Fit, j: int) -> Floats:
    """The residual (m,) of a joint (index), all records in a row."""
    return np.concatenate(list(now.signals))[:, j]


def _stretches(now: Fit, j: int) -> tuple[slice, ...]:
    """Where a joint (index) moves, all records in a row."""
    begins = np.cumsum([0, *(len(r) for r in now.signals)])
    runs = now.compared.samples.runs[j]
    return tuple(slice(int(begins[i]) + s.start, int(begins[i]) + s.stop) for i, s in runs)


def _quantities(now: Fit, records: Sequence[RecordedMotion], j: int) -> Quantities:
    """What the residual of a joint (index) may depend on, where it moves."""
    times = [np.repeat((r.time[r.rows] - r.time[0])[:, None], r.speed.shape[1], axis=1) for r in records]
    speed = np.concatenate([r.speed[r.rows] for r in records])
    values: dict[AgainstWhat, Floats] = {
        "time": np.concatenate(times),
        "position": np.concatenate([r.position[r.rows] for r in records]),
        "speed": speed,
        "direction": np.sign(speed),
        "drive": np.concatenate([r.drive[r.rows] for r in records]),
    }
    return Quantities(values, units_of(now.model.machine), _stretches(now, j))
