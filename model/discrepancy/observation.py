"""Traces as a diagnosis sees them: models are simulated with the noise that the record itself shows.

A simulation without noise comes to rest where the real arm, its readings trembling by a count, creeps on; and it stays
in the middle of a count where the arm sits at an edge. So the fast part of the residual, which is noise and rounding
and which no model of the arm can explain, is added to what the simulated controller reads. The slow part is left to
be explained: a mean over three samples is what separates the two (five would put structure of real effects into the
noise).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from daq.contracts.trace import Trace
from model.fitting.fit import fit_problem
from model.fitting.options import FitOptions
from model.fitting.records import Record
from model.fitting.simulated import INITIAL, SimulatedProblem, unknown_place
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model
from model.simulation.engines import engine_for
from model.simulation.period import OUT_READING, OUTPUTS
from model.simulation.simulate import Options, Prepared, at_rows, prepare

Floats = NDArray[np.float64]
Signals = tuple[Floats, ...]
"""One array (m, n) a record."""

SMOOTHING = 3
"""Samples over which the residual is averaged before what is left counts as noise."""
STEP, STEP_OF_GEARS_THAT_GIVE = 7e-3, 2e-3
"""s; longest step of integration: three a control period of 20 ms, and ten where a stiff gear would make longer ones
unstable. Readings are right to 0.005 counts (root mean square), 0.02 with backlash, far below the noise."""
HALVINGS = 2
"""Of the step, for runs that do not stay finite with it."""
DIFFERENCE = 0.05
"""Of an expected deviation: over it, derivatives are taken."""
BEND_SHARE = 0.45
"""Standard deviation of each term of a potentiometer's curve, as a share of the stated linearity."""
GEARS_THAT_GIVE = ("backlash", "joint_compliance")
LOOSE_START = 8.0
"""Times the tolerance of a reading: how far a trace may begin from where its first reading says. The trace itself shows
where it began, and what it is read by may be what is missing."""
BATCH = 64
"""Runs at a time: bounds the memory, 64 runs of 55 s take 26 MB."""


@dataclass(frozen=True)
class Observation:
    """Records of one machine, and how well a reading can be known.

    records: what drives the simulations and what was measured. deviations: (n,) rad, noise and rounding of one reading.
    unit: (n,) rad a count, 1 where the machine states no sensor. prepared: the records as compiled code reads them.
    """

    records: tuple[Record, ...]
    deviations: Floats
    unit: Floats
    prepared: tuple[Prepared, ...]

    @property
    def samples(self) -> int:
        """Readings that are compared, all joints together."""
        return sum(r.samples for r in self.records) * len(self.deviations)

    @property
    def quiet(self) -> Signals:
        """No noise: (k, n) counts a record, on the grid of control periods."""
        return tuple(np.zeros_like(p.noise) for p in self.prepared)

    def readings(self, model: Model, vectors: Floats, initials: Sequence[Floats], noise: Signals) -> list[Floats]:
        """What each of p parameter sets would show, without the noise's direct part.

        Args:
            vectors: (p, size). initials: per record (p, n, 2).

        Returns:
            per record (p, m, n), rad; NaN where a run diverged.
        """  # fmt: skip
        prepared = [replace(p, noise=own) for p, own in zip(self.prepared, noise, strict=True)]
        longest = max(len(r.inputs) for r in self.records)
        engine, count = engine_for(model), len(self.records)
        found: list[list[Floats]] = [[] for _ in self.records]
        for begin in range(0, len(vectors), BATCH):
            own = vectors[begin : begin + BATCH]
            which = np.repeat(np.arange(count), len(own))
            out = np.zeros((len(which), OUTPUTS, longest, model.joint_count), dtype=np.float64)
            starts = np.concatenate([i[begin : begin + BATCH] for i in initials])
            repeated = np.ascontiguousarray(np.tile(own, (count, 1)))
            left, step = np.arange(len(which)), _longest_step(model)
            for _ in range(1 + HALVINGS):
                tried = out[left]
                engine.run(prepared, which[left], repeated[left], starts[left], model.flags, step, tried)
                out[left] = tried
                left = left[~np.isfinite(tried[:, OUT_READING]).all(axis=(1, 2))]
                if not len(left):
                    break
                step /= 2
            for t, record in enumerate(self.records):
                rows = slice(t * len(own), (t + 1) * len(own))
                shown = out[rows, OUT_READING, : len(record.inputs)] - noise[t] * self.unit
                found[t].append(np.stack([at_rows(one, record.inputs.rows) for one in shown]))
        return [np.concatenate(parts) for parts in found]

    def state(self, model: Model, unknowns: Sequence[Unknown], values: Floats) -> tuple[Floats, list[Floats]]:
        """Flat vector and initial states (n, 2) of every record, for values of the unknowns."""
        vector = model.vector.copy()
        initials = [record.inputs.initial.copy() for record in self.records]
        for value, unknown in zip(values, unknowns, strict=True):
            slots, place = unknown_place(model, unknown.name)
            if place is None:
                vector[slots] = value
            else:
                for t in range(len(initials)) if unknown.trace is None else (unknown.trace,):
                    initials[t][place] += value
        return vector, initials

    def residuals(self, model: Model, unknowns: Sequence[Unknown], values: Floats, noise: Signals) -> Signals:
        """Measured − simulated, rad. Not finite where the simulation is not."""
        vector, initials = self.state(model, unknowns, values)
        shown = self.readings(model, vector[None], [i[None] for i in initials], noise)
        return tuple(record.measured - one[0] for record, one in zip(self.records, shown, strict=True))

    def tangents(
        self,
        model: Model,
        unknowns: Sequence[Unknown],
        values: Floats,
        noise: Signals,
        which: Sequence[int] | None = None,
    ) -> Floats:
        """Derivatives of the weighted readings by the unknowns of those indices (all), (p, N): by differences over a
        small share of what each is expected to deviate, at a third of the price of dual numbers.

        Raises SpecError when the simulation does not stay finite.
        """  # fmt: skip
        which = range(len(unknowns)) if which is None else which
        moves = [_difference(model, unknowns[k], float(values[k])) for k in which]
        states = [self.state(model, unknowns, values)]
        for index, move in zip(which, moves, strict=True):
            moved = values.copy()
            moved[index] += move
            states.append(self.state(model, unknowns, moved))
        vectors = np.stack([vector for vector, _ in states])
        starts = [np.stack([initials[t] for _, initials in states]) for t in range(len(self.records))]
        shown = self.readings(model, vectors, starts, noise)
        found = self.weighted([one[1:] - one[:1] for one in shown]) / np.array(moves)[:, None]
        if not np.isfinite(found).all():
            raise SpecError("the simulation does not stay finite: the loop is unstable")
        return found

    def weighted(self, signals: Sequence[Floats]) -> Floats:
        """Signals (…, m, n) in standard deviations of a reading, all compared samples in one row: (…, N)."""
        parts = []
        for record, signal in zip(self.records, signals, strict=True):
            chosen = np.concatenate([signal[..., run, :] for run in record.runs], axis=-2) / self.deviations
            parts.append(chosen.reshape(*chosen.shape[:-2], -1))
        return np.concatenate(parts, axis=-1)

    def by_joint(self, weighted: Floats) -> list[list[Floats]]:
        """A weighted row (…, N) taken apart: per joint its uninterrupted runs (…, m)."""
        n = len(self.deviations)
        runs: list[list[Floats]] = [[] for _ in range(n)]
        done = 0
        for record in self.records:
            for run in record.runs:
                count = (run.stop - run.start) * n
                part = weighted[..., done : done + count].reshape(*weighted.shape[:-1], -1, n)
                done += count
                for joint in range(n):
                    runs[joint].append(part[..., joint])
        return runs

    def noise_of(self, residuals: Signals) -> Signals:
        """The fast part of residuals, in counts on the grid of control periods: what the controller's readings had
        beside the angle."""
        found = []
        for prepared, record, residual in zip(self.prepared, self.records, residuals, strict=True):
            half = SMOOTHING // 2
            padded = np.pad(residual, ((half, half), (0, 0)), mode="edge")
            mean = np.mean([padded[k : k + len(residual)] for k in range(SMOOTHING)], axis=0)
            on_grid = np.zeros_like(prepared.noise)
            on_grid[np.round(record.inputs.rows).astype(np.int64)] = (residual - mean) / self.unit
            found.append(on_grid)
        return tuple(found)


def observed(model: Model, traces: Sequence[Trace]) -> tuple[Observation, Model, tuple[Unknown, ...]]:
    """Traces ready for a diagnosis, the model with potentiometers that may bend within their linearity, and all that
    may differ from its values on a sound machine: every number with an expected deviation, the potentiometers' bends,
    the form of friction near zero speed, and the posture at the start.

    Raises:
        TraceError, SpecError: as `model.fitting.fit.fit`.
    """
    stated = tuple(p.name for p in model.parameters if p.deviation is not None and p.deviation > 0 and p.null is None)
    effects = tuple(p.name for p in model.parameters if p.effect is not None and p.deviation is not None)
    problem: SimulatedProblem = fit_problem(
        model, traces, FitOptions(parameters=tuple(dict.fromkeys((*stated, *effects))))
    )
    sensors = [model.machine.joint(j).sensor for j in model.machine.modelled_joints]
    unit = np.array([1.0 if s is None else s.range.value / 2**s.bits for s in sensors])
    prepared = tuple(prepare(problem.model, r.inputs, Options(quantise=False)) for r in problem.records)
    unknowns = tuple(_loose_start(_even_bend(u, problem.model)) for u in problem.unknowns)
    return Observation(problem.records, problem.floor, unit, prepared), problem.model, unknowns


def _longest_step(model: Model) -> float:
    gives = any(use.name in GEARS_THAT_GIVE for use in model.effects)
    return STEP_OF_GEARS_THAT_GIVE if gives else STEP


def _difference(model: Model, unknown: Unknown, value: float) -> float:
    """The move over which a derivative is taken, towards the inside of the unknown's bounds."""
    parameter = model.by_name.get(unknown.name)
    stated = None if parameter is None else parameter.deviation
    size = DIFFERENCE * (unknown.deviation or stated or unknown.scale)
    if unknown.name.startswith(INITIAL + "."):
        size /= LOOSE_START
    return -size if value + size > unknown.high else size


def _loose_start(unknown: Unknown) -> Unknown:
    """A posture at the start, free to be where the trace shows it."""
    if not unknown.name.startswith(INITIAL + ".") or unknown.deviation is None:
        return unknown
    limit = 2 * LOOSE_START * unknown.deviation
    return replace(unknown, deviation=LOOSE_START * unknown.deviation, low=-limit, high=limit)


def _even_bend(unknown: Unknown, model: Model) -> Unknown:
    """The bends of a sound potentiometer, every term alike: nothing says that its curve is a smooth one."""
    if not (unknown.nuisance and unknown.name.rpartition(".")[2].startswith("bend_")):
        return unknown
    sensor = model.machine.joint(int(unknown.name.partition(".")[0].removeprefix("joint"))).sensor
    if sensor is None or sensor.linearity is None:
        return unknown
    return replace(unknown, deviation=BEND_SHARE * sensor.linearity.value * sensor.range.value)
