"""Computes residuals of a simulated model on recorded set points, with exact derivatives, on all cores."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from daq.contracts.errors import SpecError
from model.arrays import Floats
from model.fitting.phases import is_phase, turned_direction, turned_pairs
from model.fitting.problem import Evaluation
from model.fitting.records import Record, Signal
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model
from model.simulation.batch import BatchRun
from model.simulation.period import OUT_READING, OUT_SPEED
from model.simulation.prepared import LONGEST_STEP, Options, Prepared, prepare
from model.simulation.simulate import at_rows


@dataclass(frozen=True)
class _Simulated:
    """Simulated signal (m, n) of one record, and its derivatives (p, m, n)."""

    signal: Floats
    jacobian: Floats | None


@dataclass(frozen=True)
class SimulatedProblem:
    """Simulated − measured for records of one machine.

    Args:
        offset: per record the expected residual (m, n), rad, of a right model; None for none.
        memory: the last simulation without and the last with derivatives. Problems that differ only in offset or
            readings share it: a round begins where the last one ended and reuses its simulation.
    """

    model: Model
    records: tuple[Record, ...]
    unknowns: tuple[Unknown, ...]
    floor: Floats
    signal: Signal = "position"
    loop: Literal["closed", "open"] = "closed"
    step: float = LONGEST_STEP
    offset: tuple[Floats, ...] | None = None
    memory: dict[bool, tuple[bytes, list[_Simulated]]] = field(default_factory=dict, compare=False, repr=False)

    @property
    def runs(self) -> Sequence[Sequence[slice]]:
        """Per trace, the stretches of samples without a gap."""
        return [record.runs for record in self.records]

    def with_offset(self, offset: Sequence[Floats] | None) -> SimulatedProblem:
        """Returns the problem with another expected residual."""
        return replace(self, offset=None if offset is None else tuple(offset))

    def with_readings(self, readings: Sequence[Floats]) -> SimulatedProblem:
        """Returns the problem with other measurements (m, n) in place of the recorded ones."""
        return replace(self, records=tuple(replace(r, measured=m) for r, m in zip(self.records, readings, strict=True)))

    def noisy_readings(self, values: Floats, rng: np.random.Generator) -> list[Floats]:
        """Returns readings (m, n) of each record, simulated with these values, drawn noise and rounded readings."""
        machine = self.model.machine
        sensors = [machine.joint(j).sensor for j in machine.modelled_joints]
        deviations = np.array([0.0 if s is None or s.noise is None else s.noise.value for s in sensors])
        options = Options(loop=self.loop, quantise=True, step=self.step)
        prepared = [
            replace(p, noise=deviations * rng.standard_normal(p.noise.shape))
            for p in (prepare(self.model, record.inputs, options) for record in self.records)
        ]
        vectors, initials = self._state(values)
        out = BatchRun(self.model, prepared, np.arange(len(prepared)), vectors, initials, self.step).run()
        if not np.isfinite(out).all():
            raise SpecError("a simulation with noise does not stay finite: the control loop is unstable")
        return [at_rows(out[t, OUT_READING, : len(r.inputs)], r.inputs.rows) for t, r in enumerate(self.records)]

    def with_phases_begun(self) -> SimulatedProblem:
        """Returns the problem with the phase of each disturbance in a record begun at the quarter turn that fits best.

        A search that begins on the wrong half of a turn ends without the disturbance.
        """
        values = np.array([u.start for u in self.unknowns])
        for k, unknown in enumerate(self.unknowns):
            if not is_phase(unknown) or unknown.trace is None:
                continue
            costs = []
            for quarter in range(4):
                values[k] = quarter * math.pi / 2.0
                costs.append(float((self.evaluate(values, derivatives=False)[unknown.trace].residual ** 2).sum()))
            values[k] = int(np.argmin(costs)) * math.pi / 2.0
        begun = tuple(replace(u, start=float(v)) for u, v in zip(self.unknowns, values, strict=True))
        return replace(self, unknowns=begun)

    @cached_property
    def _prepared(self) -> list[Prepared]:
        options = Options(loop=self.loop, quantise=False, step=self.step)
        return [prepare(self.model, record.inputs, options) for record in self.records]

    def evaluate(self, values: Floats, derivatives: bool) -> list[Evaluation]:
        """Returns residuals of every record. Raises SpecError if a simulation does not stay finite."""
        found = []
        for t, (record, simulated) in enumerate(zip(self.records, self._simulated(values, derivatives), strict=True)):
            residual = simulated.signal - record.measured
            if self.offset is not None:
                residual = residual - self.offset[t]
            found.append(Evaluation(residual, simulated.jacobian))
        return found

    def _simulated(self, values: Floats, derivatives: bool) -> list[_Simulated]:
        key = values.tobytes()
        for kind in {derivatives, True}:
            if kind in self.memory and self.memory[kind][0] == key:
                return self.memory[kind][1]
        found = self._simulate(values, derivatives)
        self.memory[derivatives] = (key, found)
        return found

    def _simulate(self, values: Floats, derivatives: bool) -> list[_Simulated]:
        vectors, initials = self._state(values)
        count, column = len(self.records), OUT_SPEED if self.signal == "velocity" else OUT_READING
        batch = BatchRun(self.model, self._prepared, np.arange(count), vectors, initials, self.step, outputs=(column,))
        free = [[k for k, u in enumerate(self.unknowns) if u.trace is None or u.trace == t] for t in range(count)]
        if derivatives:
            named = self._named(values)
            runs = batch.derivatives(
                [
                    [turned_direction(self.model, named, t, p) or p for p in (self.unknowns[k].parameter for k in own)]
                    for t, own in enumerate(free)
                ]
            )
        else:
            runs = [(out, np.zeros(0)) for out in batch.run()]
        found = []
        for record, own, ((signal,), slopes) in zip(self.records, free, runs, strict=True):
            simulated, rows = signal[: len(record.inputs)], record.inputs.rows
            if not np.isfinite(simulated).all():
                raise SpecError(f"the simulation of {record.name} does not stay finite: the control loop is unstable")
            jacobian = None
            if derivatives:
                jacobian = np.zeros((len(self.unknowns), *record.measured.shape))
                for k, slope in zip(own, slopes, strict=True):
                    jacobian[k] = at_rows(slope[0, : len(record.inputs)], rows)
            found.append(_Simulated(at_rows(simulated, rows), jacobian))
        return found

    def _named(self, values: Floats) -> dict[str, float]:
        return {u.name: float(v) for u, v in zip(self.unknowns, values, strict=True)}

    def _state(self, values: Floats) -> tuple[Floats, Floats]:
        """Returns the flat vectors (t, layout size) and the initial states (t, n, 2) of the records for values of the
        unknowns."""
        vectors, named = np.tile(self.model.vector, (len(self.records), 1)), self._named(values)
        initials = np.array([record.inputs.initial for record in self.records])
        for value, unknown in zip(values, self.unknowns, strict=True):
            place = unknown.parameter.initial
            vectors[:, list(unknown.parameter.slots)] = value
            if place is not None:
                for t in range(len(initials)) if unknown.trace is None else (unknown.trace,):
                    initials[t][place] += value
        for t, vector in enumerate(vectors):
            for p, value in turned_pairs(self.model, named, t):
                vector[list(p.slots)] = value
        return vectors, initials
