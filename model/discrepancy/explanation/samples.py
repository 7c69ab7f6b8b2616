"""The samples in which patterns are looked for: residuals without and with an effect, and the joint's motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from daq.contracts.machine import NoController
from model.arrays import Floats, Mask
from model.discrepancy.localisation.phases import HOLD, AskedMotion
from model.fitting.records import Record, Signal
from model.machine_model.model import Model
from model.simulation.chain_of_model import gravity_loads
from model.simulation.prepared import Options
from model.simulation.simulate import Simulation, at_rows, simulate


@dataclass(frozen=True)
class Samples:
    """One joint over all records, (m,) each.

    without, left: measured − simulated without the effect, and with it. asked, speed, acceleration: of the set points.
    direction: of the motion, or of the last one. since_turn: s since that direction began. gravity: N·m (N).
    drive, error: as recorded; expected_drive, expected_error: of the simulation without the effect.
    rate: 1/s, samples a second.
    """

    without: Floats
    left: Floats
    time: Floats
    asked: Floats
    speed: Floats
    acceleration: Floats
    direction: Floats
    since_turn: Floats
    moving: Mask
    gravity: Floats
    drive: Floats
    error: Floats
    expected_drive: Floats
    expected_error: Floats
    rate: float


@dataclass(frozen=True)
class Motions:
    """The same of every joint, (m, n) each."""

    columns: dict[str, NDArray[np.generic]]
    rate: float

    def joint(self, index: int) -> Samples:
        """One joint, by its index from 0."""
        return Samples(**{name: values[:, index] for name, values in self.columns.items()}, rate=self.rate)  # type: ignore[arg-type]


Left = Callable[[Model], Sequence[Floats]]
"""Measured − simulated of a model, (m, n) per record; a caller may have a better simulation than one without noise."""


def motions(
    model: Model, without: Model, records: Sequence[Record], signal: Signal = "position", left: Left | None = None
) -> Motions:
    """Records beside simulations with an effect (`model`) and without it."""
    parts = [_of_record(model, without, record, signal) for record in records]
    if left is not None:
        for part, plain, full in zip(parts, left(without), left(model), strict=True):
            part["without"], part["left"] = plain, full
    names = parts[0].keys()
    columns = {
        name: np.concatenate([p[name][run] for p, r in zip(parts, records, strict=True) for run in r.runs])
        for name in names
    }
    return Motions(columns, 1.0 / records[0].inputs.period)


def _of_record(model: Model, without: Model, record: Record, signal: Signal) -> dict[str, NDArray[np.generic]]:
    inputs = record.inputs
    loop: Literal["open", "closed"] = "open" if isinstance(model.machine.controller, NoController) else "closed"
    options = Options(loop=loop, quantise=False)
    plain, full = simulate(without, inputs, options), simulate(model, inputs, options)
    asked = AskedMotion(model.machine, record)
    direction = asked.direction.astype(np.float64)
    rows = np.round(inputs.rows).astype(np.int64)
    return {
        "without": record.measured - _seen(plain, signal),
        "left": record.measured - _seen(full, signal),
        "time": np.repeat((inputs.rows * inputs.period)[:, None], asked.position.shape[1], axis=1),
        "asked": asked.position,
        "speed": asked.speed,
        "acceleration": np.gradient(asked.speed, inputs.period, axis=0),
        "direction": direction,
        "since_turn": _since_turn(direction, inputs.period),
        "moving": asked.phases != HOLD,
        "gravity": gravity_loads(model, asked.position),
        "drive": inputs.drive[rows],
        "error": inputs.set_points[rows] - record.measured,
        "expected_drive": at_rows(plain.drive, inputs.rows),
        "expected_error": at_rows(plain.error, inputs.rows),
    }


def _seen(run: Simulation, signal: Signal) -> Floats:
    return run.at_samples(run.velocity if signal == "velocity" else run.reading)


def _since_turn(direction: Floats, period: float) -> Floats:
    """s since the direction last changed, (m, n); large before the first motion."""
    changed = np.zeros(direction.shape, dtype=bool)
    changed[1:] = (direction[1:] != direction[:-1]) & (direction[:-1] != 0)
    rows = np.where(changed, np.arange(len(direction))[:, None], -(10**6))
    return np.asarray(period * (np.arange(len(direction))[:, None] - np.maximum.accumulate(rows, axis=0)))
