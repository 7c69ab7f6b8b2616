"""Where residual torques exceed noise, and the shape of what no effect explains."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from model.arrays import Floats
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
from model.discrepancy.inverse_dynamics.case import TorqueCase
from model.discrepancy.inverse_dynamics.estimates import torque_unit
from model.discrepancy.inverse_dynamics.fitting import BalanceFit
from model.discrepancy.localisation.dependence import AGAINST, Quantities, dependence
from model.discrepancy.localisation.statistics import Bins, correlation_of, significance_of_chi_square
from model.inverse_dynamics.recorded_motion import RecordedMotion

WINDOW = 0.5
"""Duration of one cell of the map, s."""
LEAST = 0.3
"""Least deviation of a residual from which its correlation is taken, in deviations of noise."""
FAST = 0.5
"""Acceleration above which a joint starts to move or turns back, as a share of its larger ones (95 % quantile)."""
SLOW = 0.15
"""Speed below which a joint creeps, as a share of its larger ones (95 % quantile)."""
SHAPE_SIGNIFICANCE = 6.0
"""Least significance of a shape of the remaining torque, in standard deviations."""
SHAPE_SHARE = 0.15
"""Least share of the remaining torque's variance that a shape must explain."""
ANOTHER_LAW = 0.4
"""Least share of the remaining torque's variance with which a shape says that a law is another one."""
BEYOND_NOISE = 1.5
"""Least remaining torque that is given a shape, in noise floors."""


def phases(record: RecordedMotion, joint: int) -> list[Phase]:
    """Phase of motion of a joint (index) at each compared sample."""
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


def locate(now: BalanceFit, case: TorqueCase) -> Where:
    """Map of the residual, in units of its noise, and the quantities that it depends on."""
    model, records, residual, floor = now.balance.model, now.balance.records, now.residual, case.noise
    cells: list[PhaseCell] = []
    dependences: list[Dependence] = []
    places: list[WorstPlace] = []
    sizes = np.sqrt(case.stretches.mean_squares(residual))
    for j, joint in enumerate(model.machine.modelled_joints):
        pieces = case.stretches.of_joint(residual, j)
        if not pieces or not np.isfinite(sizes[j]):
            continue
        correlation = correlation_of([p / floor[j] for p in pieces], LEAST)
        squares: dict[Phase, float] = {}
        for i, rows in case.stretches.by_joint[j]:
            record = records[i]
            named = phases(record, j)
            size = max(1, round(WINDOW / (record.period * record.every)))
            for begin in range(rows.start, rows.stop, size):
                window = slice(begin, min(begin + size, rows.stop))
                square = float(np.mean((residual[i][window, j] / floor[j]) ** 2))
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
        dependences += [_dependence(joint, a, b, u) for a, b, u in _Signals(now, case, j).bins()]
        phase = max(squares, key=lambda p: squares[p])
        relative = float(sizes[j]) / floor[j]
        rms, unit = relative * floor[j], torque_unit(model, joint)
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


def remaining_shapes(now: BalanceFit, case: TorqueCase) -> tuple[RemainingShape, ...]:
    """Per joint, the dependence that explains most of a torque beyond noise, where there is a significant one."""
    model, found = now.balance.model, []
    sizes = np.sqrt(np.nan_to_num(case.stretches.mean_squares(now.residual)))
    for j, joint in enumerate(model.machine.modelled_joints):
        if sizes[j] < BEYOND_NOISE * case.noise[j]:
            continue
        signals = _Signals(now, case, j)
        every = [(b, a, u, False) for a, b, u in signals.bins()]
        if (rubs := signals.friction_by_place()) is not None:
            every.append((rubs, "position", signals.quantities["position"][1], True))
        shown = [e for e in every if e[0].significance > SHAPE_SIGNIFICANCE and e[0].explained > SHAPE_SHARE]
        if shown:
            bins, against, unit, against_motion = max(shown, key=lambda e: e[0].explained)
            found.append(
                RemainingShape(
                    joint=joint,
                    against=against,
                    unit=unit,
                    torque_unit=torque_unit(model, joint),
                    centres=tuple(map(float, bins.centres)),
                    torque=_optional(bins.mean),
                    deviation=_optional(bins.deviation),
                    explained=bins.explained,
                    against_motion=against_motion,
                )
            )
    return tuple(found)


def is_function_of(torque: Sequence[Floats], now: BalanceFit, case: TorqueCase, j: int) -> bool:
    """Whether much of what is left on a joint (index) is a function of a torque (m, n) of every record."""
    bins = _Signals(now, case, j).against(np.concatenate(list(torque)))
    return bins is not None and bins.significance > SHAPE_SIGNIFICANCE and bins.explained >= ANOTHER_LAW


def _time(record: RecordedMotion, row: int) -> float:
    return round(float(record.time[record.edge] + row * record.every * record.period - record.time[0]), 4)


class _Signals:
    """The residual of a joint (index), and what it may depend on, all records in a row."""

    def __init__(self, now: BalanceFit, case: TorqueCase, j: int) -> None:
        records, residual = now.balance.records, now.residual
        number = now.balance.model.machine.modelled_joints[j]
        joint = now.balance.model.machine.joint(number)
        angle = "rad" if joint.kind == "revolute" else "m"
        drive = {"dc_motor": "V", "current": "A"}.get(joint.drive.kind, torque_unit(now.balance.model, number))
        begins = np.cumsum([0, *(len(r) for r in residual)])
        count = residual[0].shape[1]
        times = [np.repeat((r.time[r.rows] - r.time[0])[:, None], count, axis=1) for r in records]
        speed = np.concatenate([r.speed[r.rows] for r in records])
        self.joint = j
        self.stretches = tuple(
            slice(int(begins[i]) + s.start, int(begins[i]) + s.stop) for i, s in case.stretches.by_joint[j]
        )
        self.signal = np.concatenate(list(residual))[:, j]
        self.floor = LEAST * float(case.noise[j])
        self.quantities: dict[AgainstWhat, tuple[Floats, str]] = {
            "time": (np.concatenate(times), "s"),
            "position": (np.concatenate([r.position[r.rows] for r in records]), angle),
            "speed": (speed, f"{angle}/s"),
            "direction": (np.sign(speed), "1"),
            "drive": (np.concatenate([r.drive[r.rows] for r in records]), drive),
        }

    def bins(self) -> list[tuple[AgainstWhat, Bins, str]]:
        """Dependences of the residual: quantity, bins, unit of the quantity."""
        found = [(a, self._dependence(self.signal, a), self.quantities[a][1]) for a in AGAINST]
        return [(against, bins, unit) for against, bins, unit in found if bins is not None]

    def friction_by_place(self) -> Bins | None:
        """The residual against the motion in bins of position, positive where it opposes that: friction of a tight spot
        changes its sign with the motion, so that its mean over both directions shows nothing."""
        return self._dependence(-self.signal * self.quantities["direction"][0][:, self.joint], "position")

    def against(self, torque: Floats) -> Bins | None:
        """The residual in bins of another torque (m, n)."""
        known = Quantities({"drive": torque}, {}, self.stretches)
        return dependence(self.signal, self.joint, "drive", known, self.floor)

    def _dependence(self, signal: Floats, against: AgainstWhat) -> Bins | None:
        count = self.quantities["time"][0].shape[1]
        known = Quantities(
            {name: values for name, (values, _) in self.quantities.items()},
            {name: (unit,) * count for name, (_, unit) in self.quantities.items()},
            self.stretches,
        )
        return dependence(signal, self.joint, against, known, self.floor)


def _dependence(joint: int, against: AgainstWhat, bins: Bins, unit: str) -> Dependence:
    return Dependence(
        joint=joint,
        against=against,
        unit=unit,
        centres=tuple(map(float, bins.centres)),
        residual=_optional(bins.mean),
        deviation=_optional(bins.deviation),
        significance=bins.significance,
    )


def _optional(values: Floats) -> tuple[float | None, ...]:
    return tuple(None if math.isnan(v) else float(v) for v in values)
