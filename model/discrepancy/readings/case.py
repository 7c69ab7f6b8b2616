"""A case that is compared in readings: the closed loop is simulated, and follows the record."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.discrepancy.diagnosis import RemainingShape, SignalError, Step, Where
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.case import Case, Watch, expected_values
from model.discrepancy.engine.fitting import LONG, STEPS_APART, Fit, evaluate, fit
from model.discrepancy.engine.lifted import is_far_everywhere
from model.discrepancy.engine.priors import free_unknown, prior_distance, strain
from model.discrepancy.engine.probing import Probe, Projection, Start, Trial, projection
from model.discrepancy.engine.residual import Residual, Signals, Values
from model.discrepancy.engine.step_record import signal_errors
from model.discrepancy.grounds import Method
from model.discrepancy.localisation.disagreement import locate
from model.discrepancy.localisation.phases import Residuals
from model.discrepancy.localisation.statistics import chance_significance
from model.discrepancy.localisation.structure import joints_with_structure
from model.discrepancy.options import TorqueOptions
from model.discrepancy.readings.noise_model import LARGER, shown_noise
from model.discrepancy.readings.observation import Observation, observe
from model.discrepancy.readings.residual import ReadingResidual, samples_of
from model.discrepancy.readings.tones import propose_tones
from model.discrepancy.readings.trials import list_trials
from model.discrepancy.thresholds import FEEDBACK_SHARE, LARGER_PART, THRESHOLDS, WITHIN_NOISE
from model.discrepancy.verdict import Errors, unexplained
from model.effects.library import effect
from model.fitting.covariance import inverse
from model.fitting.judged import replicas_for
from model.fitting.phases import phase_unknowns
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model
from model.machine_model.parameter import Kind, Parameter
from model.machine_model.record_verdict import FAR_OFF, most_by_chance
from model.units import joint_unit

FLAGGED_SHARE = 0.1
"""A joint is flagged where its best probe promises this share of the best of all."""
REMEMBERED = 0.3
"""A trial is probed again where what it changed before promises this share of an interesting gain."""
NEARER = (0.0, 0.5)
"""Shares of the record that the simulated controller is given in turn, before the usual one."""
NOISE_ROUNDS = 2
"""Fits with the noise that the one before has left."""
SHORT_DISTANCE = 0.3
"""Share of the expected distance over which friction builds up, below which a fit is tried with its other form too."""
REPLICAS, SEED = 6, 1991
NUMBERS = {
    "link_mass": ("mass",),
    "payload": ("mass",),
    "input_delay": ("delay",),
    "weakened_magnet": ("torque_constant", "back_emf_constant"),
}
"""By effect, the parts of a machine's numbers that it changes."""


@dataclass(frozen=True, eq=False)
class ReadingCase(Case):
    """base: the unknowns of the given model. excluded: effects that need not be tried."""

    compared: ReadingResidual
    held_out: ReadingResidual | None
    base: tuple[Unknown, ...] = ()
    excluded: tuple[str, ...] = ()
    _responses: dict[tuple[str, tuple[int, ...], str], Floats] = field(default_factory=dict, init=False, repr=False)

    method: ClassVar[Method] = "output-error"
    measure = "closed-loop"
    law_error = 0.03
    noise_error = 0.0  # the file states it, or the records show it
    unresolved_kind = frozenset()

    def unknowns(self, model: Model, added: Mapping[str, Parameter]) -> tuple[Unknown, ...]:
        """Numbers of the file within their tolerances, bends, postures, the form of friction; and those added."""
        own = (u for u in self.base if u.name not in added)
        numbers = (free_unknown(added[p.name]) for p in model.parameters if p.name in added)
        return (*own, *numbers, *self._phases(model))

    def _phases(self, model: Model) -> tuple[Unknown, ...]:
        return phase_unknowns(model, len(self.compared.observation.records))

    def first(self, unknowns: Sequence[Unknown]) -> Fit:
        """The tolerance parameters, fitted in the closed loop first, which is robust far from the solution; then along
        the record, with the noise that it shows.

        Raises SpecError where no simulation stays finite.
        """
        ones, given = np.ones(len(self.noise)), {u.name: u.start for u in unknowns}
        values = given
        for share in NEARER:
            nearer = self.compared.on(self.compared.observation.with_feedback_share(share))
            found = fit(nearer, unknowns, values, ones, rounds=STEPS_APART)
            values = found.values if math.isfinite(found.cost) else values
        begun = [evaluate(self.compared, unknowns, one, ones) for one in (values, given)]
        finite = [one for one in begun if math.isfinite(one.cost)]
        if not finite:
            raise SpecError("the simulation does not stay finite: the control loop is unstable")
        nearest = min(finite, key=lambda one: one.cost)
        return self.or_across(fit(self.compared, unknowns, nearest.values, ones, rounds=LONG))

    def or_across(self, ended: Fit, goal: float = math.inf) -> Fit:
        """The fit, or a better one of the other form of friction on joints where it builds up over a short distance or
        at once: between the two the cost has a ridge, and at once it has no slope."""
        across = {
            u.name: u.low if u.low < ended.values[u.name] else u.expected
            for u in ended.unknowns
            if u.kind is Kind.PRESLIDING and ended.values[u.name] < SHORT_DISTANCE * u.expected
        }
        if not across:
            return ended
        values = {**ended.values, **across}
        return min(ended, fit(ended.compared, ended.unknowns, values, ended.memory, goal=goal), key=lambda f: f.cost)

    def kept(self, now: Fit, wider: Model) -> Iterable[Unknown]:
        """The unknowns of a fit that a model with a further effect has as well, and phases that it brings."""
        return (*now.unknowns, *(u for u in self._phases(wider) if u.name not in now.values))

    def trials(self, clear: Projection, probed: Sequence[Probe]) -> Iterator[Trial]:
        """Effects that the model of a fit lacks; flexible gears, which take five times as long to simulate, last, and
        only on joints where something is wrong. What an earlier step has ruled out is not simulated again."""
        options, observation = self.options, self.compared.observation
        every = list(list_trials(clear.now, observation, options, self.excluded))
        flexible = [t for t in every if effect(t.effect).is_flexible]
        for trial in every:
            if trial not in flexible and self._is_promising(clear, trial):
                yield trial
        joints = options.joints or clear.now.model.machine.modelled_joints
        asked = options.effects
        if asked is None or any(effect(name).tone for name in asked):
            compared = self.compared.of_model(clear.now.model)
            yield from (t for t in propose_tones(clear, compared, joints) if asked is None or t.effect in asked)
        best = {j: max((p.gain for p in probed if j in p.trial.joints), default=0.0) for j in joints}
        least = max(THRESHOLDS.interesting, FLAGGED_SHARE * max(best.values(), default=0.0))
        for probe in probed:
            if probe.row is not None:
                self._responses[probe.trial.effect, probe.trial.joints, probe.trial.law] = probe.row
        yield from (t for t in flexible if best[t.joints[0]] >= least and self._is_promising(clear, t))

    def _is_promising(self, clear: Projection, trial: Trial) -> bool:
        row = self._responses.get((trial.effect, trial.joints, trial.law))
        if row is None or trial.stated:
            return True
        squares, products = clear.products(clear.now.weighted(row)[None])
        return bool(products[0] ** 2 >= REMEMBERED * THRESHOLDS.interesting * squares[0, 0])

    def where_expected(self, now: Fit) -> Fit:
        """The same, in the closed loop."""
        closed = self.compared.on(self.compared.observation.with_feedback_share(0.0)).of_model(now.model)
        return evaluate(closed, now.unknowns, expected_values(now), now.memory)

    def from_expected(
        self, compared: Residual, unknowns: Sequence[Unknown], begin: Values, memory: Floats, goal: float = math.inf
    ) -> Fit:
        """A fit that begins where the file states its numbers: in the closed loop first, which stays near the record
        whatever is missing."""
        assert isinstance(compared, ReadingResidual)
        closed = compared.on(compared.observation.with_feedback_share(0.0))
        there = fit(closed, unknowns, begin, memory, rounds=STEPS_APART)
        begun = there.values if math.isfinite(there.cost) else begin
        return fit(compared, unknowns, begun, memory, rounds=LONG, goal=goal)

    def take_back(self, effect: str, own: Sequence[Parameter], now: Fit) -> Start:
        """An effect that has all of the distance of a number far from its expectation, while that is as expected."""
        parts, main = NUMBERS.get(effect), [p for p in own if p.null is not None]
        if parts is None or len(main) != 1:
            return {}
        # a controller's delay is of every joint
        near = [
            u
            for u in now.unknowns
            if u.deviation is not None
            and u.parameter.part in parts
            and u.parameter.effect is None
            and (u.joints == main[0].joints or (effect == "input_delay" and not u.joints))
        ]
        far = [u for u in near if abs(prior_distance(u, now.values[u.name])[0]) >= FAR_OFF]
        if not far:
            return {}
        most = max(far, key=lambda u: abs(prior_distance(u, now.values[u.name])[0]))
        distance = now.values[most.name] - most.expected
        if effect == "weakened_magnet":
            distance /= -most.expected
        size = float(np.clip((main[0].null or 0.0) + distance, main[0].low, main[0].high))
        return {main[0].name: size, **{u.name: u.expected for u in near}}

    def least_gain(self, trial: Trial, needed: float) -> float:
        """Half of what would make it significant."""
        price = trial.size * math.log(float(self.compared.samples.told.sum())) + 2 * math.log(trial.places)
        return LARGER_PART * (needed + price)

    def is_resolved(self, found: Fitted, before: Fit) -> bool:  # noqa: ARG002 (the other kind asks)
        """Whether what the file states of it is really off."""
        return is_far_everywhere(found.stated, found.fit.values)

    def residuals(self, now: Fit, signals: Signals, observation: Observation) -> Residuals:
        """Residuals as their shape is looked for."""
        return Residuals(now.fitted_model, observation.records, tuple(signals), observation.sizes)

    def where(self, now: Fit) -> Where:
        """Where a model disagrees with the fitted records."""
        return locate(self.residuals(now, now.signals, self.compared.observation))

    def shapes(self, now: Fit) -> tuple[RemainingShape, ...]:  # noqa: ARG002 (readings show none)
        """None: a residual of readings is no torque."""
        return ()

    def joints_left(self, now: Fit, first: Fit, *, named: bool) -> tuple[int, ...]:
        """Joints whose error is above what noise leaves, and what a nearly right law of an effect would leave. While
        nothing is named, what is left needs a shape as well."""
        left = set(unexplained(*self._sides(now, first, named), THRESHOLDS, named=named, samples=self._counts))
        if named:
            return tuple(j for j in now.model.machine.modelled_joints if j in left)
        cells = self.where(now).cells
        line = chance_significance(len(cells), THRESHOLDS.place)
        left |= {c.joint for c in cells if c.significance >= line}
        return tuple(j for j in self.with_structure(now) if j in left)

    def with_structure(self, now: Fit) -> tuple[int, ...]:
        """Joints on which what is left has a shape, on fitted or on held-out records."""
        found = set(joints_with_structure(self.residuals(now, now.signals, self.compared.observation)))
        if self.held_out is not None:
            found |= set(joints_with_structure(self.residuals(now, self.held(now), self.held_out.observation)))
        return tuple(j for j in now.model.machine.modelled_joints if j in found)

    def _sides(self, now: Fit, first: Fit, named: bool) -> tuple[tuple[SignalError, ...], tuple[SignalError, ...]]:
        """Errors on fitted and on held-out records; with play noise decides where a joint comes to rest, so an added
        effect may raise what noise leaves."""
        floor, floor_held = self.noise, self.noise_held
        if named:
            floor = np.maximum(floor, noise_floor(self.compared.of_model(now.model), now.values))
        fitted = signal_errors(self, first.squares, now.squares, floor)
        if self.held_out is None:
            return fitted, ()
        if named:
            floor_held = np.maximum(floor_held, noise_floor(self.held_out.of_model(now.model), now.values))
        before, after = (self._held_beyond_numbers(f) for f in (first, now))
        return fitted, signal_errors(self, before, after, floor_held)

    def _held_beyond_numbers(self, now: Fit) -> Floats:
        """(n,) mean squares that held-out records leave beyond what is expected of numbers that the fitted records tell
        only to their deviations: rᵀ S⁻¹ r with the covariance S of noise and numbers, in variances of the noise.

        A short record fits some numbers to its noise, and they are wrong elsewhere.
        """
        assert self.held_out is not None
        clear = projection(now.with_slopes())
        own = [k for k, u in enumerate(now.unknowns) if u.trace is None]
        numbers = [now.unknowns[k] for k in own]
        held, scale = replace(self.held_out, own=()).of_model(now.model), np.array([u.scale for u in numbers])
        values = {u.name: now.values[u.name] for u in numbers}  # postures and phases are of other records
        rows, left = held.slopes(values, numbers), held.samples.flat(self.held(now))
        if not (np.isfinite(rows).all() and np.isfinite(left).all()):
            return self.held_squares(now)
        J, r = held.weighted(rows, held.floor, now.memory) * scale[:, None], held.weighted(left, held.floor, now.memory)
        step = np.linalg.solve(inverse(clear.inverse[np.ix_(own, own)]) + J @ J.T, J @ r)
        products = left * (left - (step * scale) @ rows)  # S⁻¹ r is what is left where the numbers follow (Woodbury)
        return np.array([max(np.mean(products[c]), 0.0) for c in held.samples.columns])

    @cached_property
    def _counts(self) -> tuple[int, int]:
        held = 0.0 if self.held_out is None else self.held_out.samples.told[0]
        return int(self.compared.samples.told[0]), int(held)

    def wrong_on(self, step: Step, left: Sequence[int]) -> tuple[int, ...]:
        """Joints of an effect that are left: from there the search was on a wrong way."""
        return tuple(left) if not step.joints or set(step.joints) & set(left) else ()

    def unit(self, joint: int) -> str:
        """rad or m."""
        return joint_unit(self.given.machine, joint)

    def errors(self, now: Fit) -> Errors:
        """Root mean squares of the closed loop alone: in the search, the simulation follows a share of the record, so
        that one with a wrong effect stays near enough to be compared. There the gap is smaller.

        The nuisances of a record have the values that suit the loop alone: a part of what the form of friction near
        rest does shows only there.
        """
        best = self._in_loop_alone(now)
        found: Errors = {"fitted": _roots(best.squares), "held_out": ()}
        if self.held_out is not None:
            alone = _alone(self.held_out, now)
            found["held_out"] = _roots(alone.samples.mean_squares(alone.at({**now.values, **best.values})))
        return found

    def noise_of_errors(self, now: Fit) -> tuple[Floats, Floats]:
        """Of the closed loop alone, and by the criterion of a fit's verdict."""
        values = {**now.values, **self._in_loop_alone(now).values}
        seconds = sum(p.period * len(p.noise) for p in self.compared.observation.prepared)
        squares = _noise_squares(_alone(self.compared, now), values, replicas_for(seconds))
        if not np.isfinite(squares).all():
            return self.noise, WITHIN_NOISE * self.noise
        mean = np.mean(squares, axis=0)
        scatter = np.std(squares, axis=0, ddof=1) / mean
        return np.sqrt(mean), np.sqrt(mean) * [most_by_chance(s, self._counts[0]) for s in scatter]

    def _in_loop_alone(self, now: Fit) -> Fit:
        """The nuisances of a fit that suit the closed loop alone."""
        nuisances = [u for u in now.unknowns if u.nuisance]
        names = {u.name for u in nuisances}
        others = {name: value for name, value in now.values.items() if name not in names}
        return fit(replace(_alone(self.compared, now), fixed=others), nuisances, now.values, now.memory)

    def bias(self, now: Fit, parameters: Sequence[Parameter]) -> dict[str, float]:
        """How far estimates move when the simulated controller is given more of the record: a measure of the bias from
        the noise that it does not see.

        Noise that passes a law with a corner or a limit does not average out: a dead zone looks narrower, friction near
        zero speed softer. As in the extrapolation of simulated noise (Cook and Stefanski 1994), the bias shows where
        there is less noise. The distance that remains to no noise is about as long again, and two deviations cover it.
        """
        half = 0.5 * (1.0 + FEEDBACK_SHARE)
        nearer = self.compared.on(self.compared.observation.with_feedback_share(half)).of_model(now.model)
        names = {p.name for p in parameters}
        own = [u for u in now.unknowns if u.name in names]
        fixed = {n: v for n, v in now.values.items() if n not in names}
        moved = fit(replace(nearer, fixed=fixed), own, now.values, now.memory)
        return {u.name: moved.values[u.name] - now.values[u.name] for u in own} if math.isfinite(moved.cost) else {}


def _alone(compared: ReadingResidual, now: Fit) -> ReadingResidual:
    """A model's closed loop alone, along the same records."""
    return compared.on(compared.observation.with_drive_as_input(False).with_feedback_share(0.0)).of_model(now.model)


def _roots(squares: Floats) -> tuple[float | None, ...]:
    return tuple(float(np.sqrt(s)) if np.isfinite(s) else None for s in squares)


def noise_floor(compared: ReadingResidual, values: Values) -> Floats:
    """Root mean square of each joint's residual, (n,) rad, over simulated records of an arm that is this model. Where
    its simulations in closed loop do not stay finite: the noise of a reading.

    It is more than the noise of one reading: the part of that noise which the simulated controller is not given goes
    round the real loop and moves the arm a little near standstill.
    """
    found = np.sqrt(np.mean(_noise_squares(compared, values, REPLICAS), axis=0))
    return found if np.isfinite(found).all() else compared.observation.deviations


def _noise_squares(compared: ReadingResidual, values: Values, replicas: int) -> Floats:
    """(replicas, n) mean squares of simulated records of an arm that is this model."""
    observation = compared.observation
    truth = replace(compared, own=(), fixed={})
    if compared.own:  # the postures that are known are of other records
        truth = replace(truth, known={n: u for n, u in compared.known.items() if u.kind is not Kind.INITIAL_POSITION})
    rng = np.random.default_rng(SEED)
    scale = observation.deviations / observation.unit
    squares = []
    for _ in range(replicas):
        noise = [rng.normal(size=p.noise.shape) for p in observation.prepared]
        if observation.noise is not None:
            filters = observation.noise.whiteners
            noise = [np.stack([w.coloured(n) for w, n in zip(filters, one.T, strict=True)], axis=1) for one in noise]
        replica = observation.imagined(truth.model, truth.state(values), [scale * one for one in noise])
        squares.append(truth.samples.mean_squares(truth.on(replica).at(values)))
    return np.array(squares)


def reading_case(
    given: Model,
    traces: Sequence[Trace],
    held_out: Sequence[Trace],
    options: TorqueOptions,
    settled: tuple[str, ...],
    watch: Watch | None,
) -> ReadingCase:
    """The case of traces. settled: effects of the controller that its own numbers prove or exclude.

    Raises TraceError, SpecError.
    """
    observation, model, unknowns = observe(given, traces, held_out=[t.record.trace_id for t in held_out])
    unknowns = tuple(u for u in unknowns if not u.parameter.is_gain_error)  # what the controller's numbers prove stays
    if observation.drive_is_input:
        settled = tuple(name for name in ("wrong_gain", "lost_set_points"))
    known = {u.name: u for u in unknowns if u.name not in model.by_name}
    compared = ReadingResidual(model, observation, samples_of(observation), known)
    held = None
    if held_out:
        unseen, _, theirs = observe(given, held_out)
        starts = tuple(u for u in theirs if u.kind is Kind.INITIAL_POSITION)
        held = ReadingResidual(model, unseen, samples_of(unseen), known, own=starts)
    sizes = observation.deviations
    names = tuple(t.record.trace_id for t in traces)
    return ReadingCase(model, compared, held, sizes, sizes, options, names, watch, base=unknowns, excluded=settled)


def weighed_by_noise(case: ReadingCase) -> tuple[ReadingCase, Fit]:
    """The case with the noise that its records show, where that is more than the file states and has no shape; what
    that noise leaves of a residual; and the first fit.

    Twice, since a fit with too little noise has followed some of it.
    """
    fitted = case.first(case.unknowns(case.given, {}))
    for _ in range(NOISE_ROUNDS):
        row = fitted.row
        stated = float(np.mean(np.concatenate([np.concatenate(runs) for runs in case.compared.by_joint(row)]) ** 2))
        shape = joints_with_structure(case.residuals(fitted, fitted.signals, case.compared.observation))
        # noise moves no number by many of its own deviations: what does is missing
        driven_off = strain(fitted.unknowns, fitted.values) > FAR_OFF * math.sqrt(stated)
        if stated < LARGER or shape or driven_off:
            break
        noise = shown_noise(case.compared.by_joint(row))
        compared = case.compared.on(replace(case.compared.observation, noise=noise))
        case = replace(case, compared=compared)
        fitted = fit(compared, fitted.unknowns, fitted.values, fitted.memory)
    held, held_noise = case.held_out, case.noise_held
    floor = noise_floor(case.compared, fitted.values)
    if held is not None:
        held = held.on(replace(held.observation, noise=case.compared.observation.noise))
        held_noise = noise_floor(held, fitted.values)
    return replace(case, held_out=held, noise=floor, noise_held=held_noise), fitted
