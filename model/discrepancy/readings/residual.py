"""Readings less simulated ones as the search compares them, of a loop that is given most of the record."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from model import layout as at
from model.arrays import Floats
from model.discrepancy.engine.fitting import fit
from model.discrepancy.engine.residual import Samples, Signals, Values
from model.discrepancy.readings.noise_model import fit_noise_model
from model.discrepancy.readings.observation import STEP, Observation, State, difference, step_of_derivatives
from model.fitting.phases import is_phase, turned_pairs
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model
from model.machine_model.parameter import Kind


def samples_of(observation: Observation, fold: tuple[int, int, bool] | None = None) -> Samples:
    """The compared samples. fold: its number, how many there are, and whether those inside or outside it are kept."""
    pieces: list[tuple[int, slice]] = []
    for t, record in enumerate(observation.records):
        for run in record.runs:
            if fold is None:
                pieces.append((t, run))
                continue
            number, count, inside = fold
            edges = np.linspace(run.start, run.stop, count + 1).astype(int)
            own = slice(int(edges[number]), int(edges[number + 1]))
            parts = [own] if inside else [slice(run.start, own.start), slice(own.stop, run.stop)]
            pieces += [(t, part) for part in parts if part.stop > part.start]
    joints = len(observation.deviations)
    count = sum(rows.stop - rows.start for _, rows in pieces)
    return Samples((tuple(pieces),) * joints, np.full(joints, float(count)))


@dataclass(frozen=True)
class ReadingResidual:
    """Measured − simulated readings, rad or m.

    known: the records' own unknowns and those of friction's form, by name: no parameters of the model. own: of records
    that are not fitted to, the unknowns that no other record tells: initial postures. Each residual has them at their
    best. fixed: values of numbers that are no unknowns here.
    """

    model: Model
    observation: Observation
    samples: Samples
    known: Mapping[str, Unknown]
    own: tuple[Unknown, ...] = ()
    fixed: Mapping[str, float] = field(default_factory=dict)
    _bases: dict[tuple[float, bytes], list[Floats]] = field(default_factory=dict, repr=False)

    @property
    def floor(self) -> Floats:
        """(n,) standard deviation of a reading."""
        return self.observation.sizes

    def of_model(self, model: Model) -> ReadingResidual:
        """The same records with another model."""
        return replace(self, model=model)

    def on(self, observation: Observation) -> ReadingResidual:
        """The same model and numbers with another way to simulate the records."""
        return replace(self, observation=observation, _bases={})

    def within(self, fold: int, folds: int) -> tuple[ReadingResidual, ReadingResidual]:
        """The same with samples outside and inside one of so many shares of every record."""
        outside, inside = (samples_of(self.observation, (fold, folds, side)) for side in (False, True))
        return replace(self, samples=outside), replace(self, samples=inside)

    def state(self, values: Values) -> State:
        """What a simulation begins with."""
        vector = self.model.vector.copy()
        initials = [record.inputs.initial.copy() for record in self.observation.records]
        for name, value in (*self.fixed.items(), *values.items()):
            unknown = self.known.get(name)
            parameter = self.model.by_name.get(name) or (None if unknown is None else unknown.parameter)
            if parameter is None:
                continue
            if parameter.initial is None:
                vector[list(parameter.slots)] = value
            elif unknown is not None:
                for t in range(len(initials)) if unknown.trace is None else (unknown.trace,):
                    initials[t][parameter.initial] += value
        vectors = [vector] * len(initials)
        for t in range(1, len(initials)):
            if turned := turned_pairs(self.model, values, t):
                vectors[t] = vector.copy()
                for p, value in turned:
                    vectors[t][list(p.slots)] = value
        return vectors, initials

    def at(self, values: Values) -> Signals:
        """Residuals (m, n) of every record. Not finite where the simulation is not."""
        if self.own:
            return self._with_own(values)
        shown = self.observation.readings(self.model, [self.state(values)], STEP)
        records = self.observation.records
        return tuple(record.measured - one[0] for record, one in zip(records, shown, strict=True))

    def _with_own(self, values: Values) -> Signals:
        """Each record with its own unknowns at their best: its initial posture, within a count or so, because friction
        holds the arm there; and its phase of a periodic disturbance, whose amplitude and frequency are kept."""
        found = []
        names = {u.name for u in self.own}
        for t, (record, prepared) in enumerate(zip(self.observation.records, self.observation.prepared, strict=True)):
            one = replace(self.observation, records=(record,), prepared=(prepared,))
            starts = [replace(u, trace=0) for u in self.own if u.trace == t]
            fixed = {n: v for n, v in values.items() if n not in names and not self._is_start(n)}
            here = replace(
                self, observation=one, samples=samples_of(one), own=(), known=self._known_here(starts), fixed=fixed
            )
            phases = here._phases()
            ones = np.ones(len(self.floor))
            if phases:
                fitted = fit(here, (*starts, *phases), {}, ones).values
                here = replace(here, fixed=here._turned(phases, fitted))
            found.append(fit(here, starts, {}, ones).signals[0])
        return tuple(found)

    def _is_start(self, name: str) -> bool:
        return name in self.known and self.known[name].kind is Kind.INITIAL_POSITION

    def _known_here(self, starts: Sequence[Unknown]) -> dict[str, Unknown]:
        forms = {n: u for n, u in self.known.items() if u.kind is not Kind.INITIAL_POSITION}
        return {**forms, **{u.name: u for u in starts}}

    def _phases(self) -> list[Unknown]:
        """Sine and cosine of every periodic disturbance, in pairs, free but for a prior of their amplitude."""
        found = []
        for pair in self.model.disturbances:
            values = [float(self.fixed.get(p.name, p.value)) for p in pair]
            size = math.hypot(*values)
            if size > 0.0:
                found += [Unknown(p, v, expected=0.0, deviation=size) for p, v in zip(pair, values, strict=True)]
        return found

    def _turned(self, phases: Sequence[Unknown], fitted: Values) -> dict[str, float]:
        """Fixed values with disturbances of their amplitude at the fitted phases: a spurious one cannot be fitted away
        on held-out data."""
        fixed = dict(self.fixed)
        for sine, cosine in zip(phases[::2], phases[1::2], strict=True):
            angle = math.atan2(fitted[cosine.name], fitted[sine.name])
            size = math.hypot(sine.start, cosine.start)
            fixed |= {sine.name: size * math.cos(angle), cosine.name: size * math.sin(angle)}
        return fixed

    def changes(self, base: Values, moved: Sequence[Values]) -> Floats:
        """(k, N) by which the residual differs at other values, with the long step of integration."""
        step = step_of_derivatives(self.model)
        first_state = self.state(base)
        key = step, b"".join(one.tobytes() for part in first_state for one in part)
        states = [self.state(values) for values in moved]
        if key not in self._bases:
            states = [first_state, *states]
        if not states:
            return np.zeros((0, sum(self.samples.sizes)))
        shown = self.observation.readings(self.model, states, step)
        if key not in self._bases:
            self._bases.clear()
            self._bases[key] = [one[:1] for one in shown]
            shown = [one[1:] for one in shown]
        first = self._bases[key]
        return self.samples.flat([y0 - y for y, y0 in zip(shown, first, strict=True)])

    def slopes(self, values: Values, unknowns: Sequence[Unknown]) -> Floats:
        """(k, N) derivatives: exact ones. Where a loop swings up or parts knock in their play, a derivative grows along
        the record beyond anything that a change does; differences over a small share of each unknown's expected
        deviation tell more there."""
        rows = np.full((len(unknowns), sum(self.samples.sizes)), np.inf)
        if not (self.model.flags & at.HAS_FLEXIBILITY).any():
            rows = -self.samples.flat(self.observation.derivatives(self.model, self.state(values), unknowns))
        seconds = max(len(r.inputs) * r.inputs.period for r in self.observation.records)
        moves = np.array([difference(self.model, u, values[u.name], seconds) for u in unknowns])
        largest = np.abs(rows).max(axis=1, initial=0.0) * np.abs(moves)
        turned = {p.name for pair in self.model.disturbances for p in pair} if len(self.observation.records) > 1 else ()
        wild = [
            k
            for k, (u, size) in enumerate(zip(unknowns, largest, strict=True))
            if u.name in turned or is_phase(u) or not size < self.observation.range_of_motion
        ]
        if wild:
            moved = [{**values, unknowns[k].name: values[unknowns[k].name] + moves[k]} for k in wild]
            rows[wild] = self.changes(values, moved) / moves[wild, None]
        return rows

    def told_slopes(self, values: Values, unknowns: Sequence[Unknown]) -> Floats:
        """(k, N) the same: friction at rest is part of the simulation."""
        return self.slopes(values, unknowns)

    def deviations(self, row: Floats) -> Floats:  # noqa: ARG002 (those of readings are known)
        """(n,) of the noise of a reading."""
        return self.floor

    def memory(self, row: Floats) -> Floats:  # noqa: ARG002 (likewise)
        """(n,) noise of readings is white, or whitened."""
        return np.ones(len(self.floor))

    def weighted(self, rows: Floats, deviations: Floats, memory: Floats, joint: int | None = None) -> Floats:
        """Rows (…, N) in standard deviations of the noise that is reckoned with: where it is coloured, of what a sample
        tells beyond those before it. Of one joint alone, where it is given."""
        noise = self.observation.noise
        if noise is None:
            size = deviations * np.sqrt(memory)
            return rows / (np.repeat(size, self.samples.sizes) if joint is None else size[joint])
        every = range(len(deviations)) if joint is None else (joint,)
        found = []
        for j in every:
            own = rows[..., self.samples.columns[j]] if joint is None else rows
            whitener, begin = noise.whiteners[j], 0
            for _, run in self.samples.runs[j]:
                part = own[..., begin : begin + run.stop - run.start] / self.observation.deviations[j]
                found.append(np.moveaxis(whitener.whitened(np.moveaxis(part, -1, 0)), 0, -1))
                begin += run.stop - run.start
        return np.concatenate(found, axis=-1)

    def costs(self, row: Floats, memory: Floats) -> Floats:
        """(n,) sum of the squares of a joint's weighted residual."""
        squares = self.weighted(row, self.floor, memory) ** 2
        return np.array([float(np.sum(squares[c])) for c in self.samples.columns])

    def descriptions(self, rows: Sequence[Floats]) -> tuple[list[Floats], Floats]:
        """Each with a noise model of its own (`noise_model`)."""
        return [self._described(row) for row in rows], np.ones(len(self.floor))

    def _described(self, row: Floats) -> Floats:
        if not np.isfinite(row).all():
            return np.full(len(self.floor), np.inf)
        return np.array(fit_noise_model(self.by_joint(row)).by_joint)

    def by_joint(self, row: Floats) -> list[list[Floats]]:
        """Runs of every joint, in stated deviations."""
        stated = self.observation.deviations
        return [self.samples.split(row / stated[j], j) for j in range(len(stated))]
