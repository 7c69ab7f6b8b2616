"""Traces as a diagnosis sees them: the simulated controller is given most of what the real one has read.

The noise of a reading goes through the controller into the motor and round the loop. A closed-loop simulation that does
not know this noise is off by what the noise has moved, comes to rest where the real arm creeps on, and hides a missing
torque behind its controller, which makes up for it. A simulation whose controller reads the record has all of that
right, but nothing brings it back: the smallest error of a torque adds up. So the controller reads a share of the way
from the simulated to the recorded reading (Forssell and Ljung 1999 compare the two ends). The residual, measured less
simulated, is then nearly white where the model is right, and a missing torque shows 1/(1 − share) times as large as in
closed loop.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from daq.contracts.machine import BoardPid, Machine, PlainGain, SampledPid
from daq.contracts.trace import Trace
from model import layout as at
from model.arrays import Floats
from model.discrepancy.thresholds import FEEDBACK_SHARE
from model.drives import controller as pid
from model.effects.effect import JointScale, Tone
from model.fitting.fit import fit_problem
from model.fitting.options import FitOptions, Prior
from model.fitting.phases import is_phase
from model.fitting.records import Record
from model.fitting.simulated import SimulatedProblem
from model.fitting.unknowns import Unknown
from model.fitting.whitening import Whitener
from model.inverse_dynamics.recorded_sizes import as_driven
from model.machine_model.model import Model
from model.machine_model.parameter import Kind
from model.machine_model.posterior import load_posterior
from model.simulation.batch import BatchRun
from model.simulation.inputs import readings_on_grid
from model.simulation.period import OUT_DRIVE, OUT_READING, OUTPUTS
from model.simulation.prepared import Options, Prepared, prepare
from model.simulation.simulate import at_rows

Signals = tuple[Floats, ...]
"""One array (m, n) a record."""
State = tuple[list[Floats], list[Floats]]
"""What a simulation begins with in every record: the model's flat vector, and initial states (n, 2)."""

STEP, COARSE_STEP = 2e-3, 7e-3
"""Longest step of integration, s: ten steps per control period of 20 ms, and three for probes, which are
differences and need no more. With steps longer than the first, a delay explains an inductance as well."""
HALVINGS = 2
"""How often the step of integration is halved at most, for runs that do not stay finite."""
DIFFERENCE = 0.05
"""Step of a finite difference, as a share of the parameter's expected deviation."""
TONE_DIFFERENCE = 0.02
"""Step of a finite difference by a tone's rate, in waves over a turn or over the longest record: it moves the phase by
an eighth of a radian."""
BEND_TERMS = 8
"""Terms of the sine series that describes a sound potentiometer's curve. An arm moves over a part of the range, and the
series must be able to describe a bend of a count or two there."""
BEND_SHARE = 0.3
"""Standard deviation of each term of a potentiometer's curve, as a share of the stated linearity."""
CONTACT_STEP = 1e-3
"""Longest step of integration of models with play, s: parts in contact swing at up to 1500 rad/s, which steps of 2 ms
cannot follow."""
SHORTEST_PRESLIDING = 1e-3
"""Lower bound of the distance over which friction builds up, as a share of the expected one, half a count: so short
that friction is there at once. With a larger bound, friction that jumps looks like a law that is missing."""
SHORT, SUDDEN = 0.2, 0.05
"""Shares of the expected distance below which friction is as stiff a contact as a gear, for derivatives and for all
other simulations. Longer steps make such joints creep, and derivatives of that are noise."""
LOOSE_START = 8.0
"""Prior width of the initial posture, in sensor tolerances. Wide, because the sensor itself may have the missing
effect."""
WHOLE = 1e-3
"""Distance of a board's gain, in counts of drive per count of error, from a whole number that rounds nothing: counts
of error are never more than some hundreds."""
BATCH = 64
"""Simulations per call of the engine. It bounds the memory: 64 runs of 55 s take 26 MB."""
FAST = 0.99
"""Quantile of a joint's speed from reading to reading that it is said to reach: single readings are noise."""


@dataclass(frozen=True)
class ShownNoise:
    """Noise of the readings as records show it, in stated standard deviations of a reading.

    whiteners: one filter per joint. sizes: (n,) standard deviations.
    """

    whiteners: tuple[Whitener, ...]
    sizes: Floats


@dataclass(frozen=True)
class Observation:
    """Records of one machine, and how well a reading can be known.

    records: inputs of the simulations and what was measured. deviations: (n,) rad, noise and rounding of one reading.
    unit: (n,) rad per count, 1 where the machine states no sensor. prepared: the records as compiled code reads them,
    with the share of the recorded readings that the simulated controller is given. scales: natural sizes, from the
    records, of joints (from 1) whose file does not say how far they are driven. noise: of the readings as the records
    show it, where it is not what the file states.
    """

    machine: Machine
    records: tuple[Record, ...]
    deviations: Floats
    unit: Floats
    prepared: tuple[Prepared, ...]
    scales: Mapping[int, JointScale] = field(default_factory=dict)
    noise: ShownNoise | None = None

    @property
    def samples(self) -> int:
        """Readings that are compared, all joints together."""
        return sum(r.samples for r in self.records) * len(self.deviations)

    @property
    def sizes(self) -> Floats:
        """(n,) rad, standard deviation of the noise of a reading: as the records show it, or as the file states it."""
        return self.deviations if self.noise is None else self.deviations * self.noise.sizes

    @cached_property
    def range_of_motion(self) -> float:
        """rad or m, the longest way between two readings of a joint."""
        return max(float(np.max(np.nanmax(r.measured, axis=0) - np.nanmin(r.measured, axis=0))) for r in self.records)

    def with_feedback_share(self, share: float) -> Observation:
        """The same with another share of the recorded readings that the simulated controller is given."""
        return replace(self, prepared=tuple(replace(p, following=share) for p in self.prepared))

    @property
    def drive_is_input(self) -> bool:
        """Whether the recorded drive is the input of the simulations."""
        return all(p.settings[at.DRIVE_RECORDED] != 0 for p in self.prepared)

    def with_drive_as_input(self, recorded: bool) -> Observation:
        """The same with the recorded drive as the input of the simulations, or with the controller's own."""
        prepared = tuple(p.with_setting(at.DRIVE_RECORDED, int(recorded)) for p in self.prepared)
        return replace(self, prepared=prepared)

    def imagined(self, model: Model, state: State, noise: Sequence[Floats]) -> Observation:
        """The same experiments on an arm that is the model, in closed loop, with noise (k, n) of its readings, counts.

        Readings and drives take the place of the recorded ones. Not finite where the simulation is not.
        """
        alone = tuple(
            replace(p, following=0.0, noise=own)
            .with_setting(at.DRIVE_RECORDED, 0)
            .with_setting(at.QUANTISE, at.DRIVE_ROUNDED if forms_rounded_drive(model, p.gains) else 0)
            for p, own in zip(self.prepared, noise, strict=True)
        )
        outputs = replace(self, prepared=alone).outputs(model, [state])
        shown = [at_rows(out[0, OUT_READING], r.inputs.rows) for out, r in zip(outputs, self.records, strict=True)]
        records = tuple(replace(r, measured=own) for r, own in zip(self.records, shown, strict=True))
        prepared = tuple(
            replace(
                p,
                readings=readings_on_grid(r.measured, r.inputs.rows, len(r.inputs)),
                recorded=np.ascontiguousarray(out[0, OUT_DRIVE]),
            )
            for p, r, out in zip(self.prepared, records, outputs, strict=True)
        )
        return replace(self, records=records, prepared=prepared)

    def readings(self, model: Model, states: Sequence[State], longest_step: float = STEP) -> list[Floats]:
        """Simulated readings of p states of a model, per record (p, m, n) rad, with noise where the simulation has
        some; NaN where a run diverged. longest_step: of the integration, s."""
        found = []
        outputs = self.outputs(model, states, longest_step, (OUT_READING,))
        for record, out in zip(self.records, outputs, strict=True):
            found.append(np.stack([at_rows(one, record.inputs.rows) for one in out[:, 0]]))
        return found

    def outputs(
        self,
        model: Model,
        states: Sequence[State],
        longest_step: float = STEP,
        columns: Sequence[int] = range(OUTPUTS),
    ) -> list[Floats]:
        """Simulations of p states of a model, with noise where they have some; NaN where a run diverged.

        Args:
            longest_step: of the integration, s. columns: which outputs.

        Returns:
            per record (p, columns, k, n), in the order of `model.simulation.period`.
        """
        vectors, initials = (
            [np.stack([state[part][t] for state in states]) for t in range(len(self.records))] for part in (0, 1)
        )
        longest = max(len(r.inputs) for r in self.records)
        count = len(self.records)
        found: list[list[Floats]] = [[] for _ in self.records]
        for begin in range(0, len(states), BATCH):
            batch = slice(begin, begin + BATCH)
            own, starts = (np.concatenate([part[batch] for part in parts]) for parts in (vectors, initials))
            size = len(own) // count
            which = np.repeat(np.arange(count), size)
            out = np.zeros((len(which), OUTPUTS, longest, model.joint_count), dtype=np.float64)
            left, step = (
                np.arange(len(which)),
                min(longest_step, longest_step_of(model), _step_of_contacts(model, own, longest_step)),
            )
            for _ in range(1 + HALVINGS):
                tried = BatchRun(model, self.prepared, which[left], own[left], starts[left], step).run()
                out[left] = tried
                left = left[~np.isfinite(tried[:, OUT_READING]).all(axis=(1, 2))]
                if not len(left):
                    break
                step /= 2
            for t, record in enumerate(self.records):
                rows = slice(t * size, (t + 1) * size)
                found[t].append(out[rows][:, list(columns), : len(record.inputs)])
        return [np.concatenate(parts) for parts in found]

    def derivatives(
        self, model: Model, state: State, unknowns: Sequence[Unknown], longest_step: float = STEP
    ) -> list[Floats]:
        """Exact derivatives (p, m, n) of the simulated readings of every record, rad by each unknown's unit; not finite
        where a run diverged. longest_step: of the integration, s."""
        vectors, initials = (np.stack(part) for part in state)
        count = len(self.records)
        step = min(longest_step, longest_step_of(model), _step_of_contacts(model, vectors, longest_step))
        batch = BatchRun(
            model,
            self.prepared,
            np.arange(count),
            vectors,
            initials,
            step,
            outputs=(OUT_READING,),
        )
        own = [[k for k, u in enumerate(unknowns) if u.trace is None or u.trace == t] for t in range(count)]
        runs = batch.derivatives([[unknowns[k].parameter for k in one] for one in own])
        found = []
        for record, free, (_, slopes) in zip(self.records, own, runs, strict=True):
            rows = np.zeros((len(unknowns), *record.measured.shape))
            for k, slope in zip(free, slopes, strict=True):
                rows[k] = at_rows(slope[0, : len(record.inputs)], record.inputs.rows)
            found.append(rows)
        return found

    @property
    def units(self) -> tuple[str, ...]:
        """Of the joints' positions: rad or m."""
        kinds = [self.machine.joint(joint).kind for joint in self.machine.modelled_joints]
        return tuple("rad" if kind == "revolute" else "m" for kind in kinds)


def observe(
    model: Model, traces: Sequence[Trace], feedback_share: float = FEEDBACK_SHARE, held_out: Sequence[str] = ()
) -> tuple[Observation, Model, tuple[Unknown, ...]]:
    """Traces ready for a diagnosis; the model as it was given, with potentiometers that may bend within their
    linearity; and its unknowns.

    These are the tolerance parameters, all numbers that may differ from the model's on a healthy machine: every number
    with an expected deviation, the potentiometers' bends, the form of friction near zero speed, and the initial
    postures.

    Args:
        held_out: identities of the traces that are not fitted to.

    Raises:
        TraceError, SpecError: as `model.fitting.fit.fit`.
    """
    stated = tuple(p.name for p in model.parameters if p.deviation is not None and p.deviation > 0 and p.null is None)
    effects = tuple(p.name for p in model.parameters if p.effect is not None and p.deviation is not None)
    known = load_posterior(model, (*(t.record.trace_id for t in traces), *held_out))
    priors: dict[str, Prior | None] = {
        name: Prior(expected=model.parameter(name).value, deviation=d) for name, d in known.items()
    }
    chosen = tuple(dict.fromkeys((*stated, *effects)))
    problem: SimulatedProblem = fit_problem(
        model, traces, FitOptions(parameters=chosen, bend_terms=BEND_TERMS, priors=priors)
    )
    unit = np.array([model.machine.joint(j).count or 1.0 for j in model.machine.modelled_joints])
    prepared = tuple(
        prepare(
            problem.model,
            r.inputs,
            Options(quantise=False, following=feedback_share, recorded_drive=_drive_is_input(model, r)),
        )
        for r in problem.records
    )
    given = {p.name: p.value for p in model.parameters if p.effect is not None}
    unknowns = tuple(_as_diagnosed(u, given, problem.model) for u in problem.unknowns if not is_phase(u))
    scales = _recorded_scales(model, problem.records)
    observation = Observation(model.machine, problem.records, problem.floor, unit, prepared, scales)
    return observation, problem.model, unknowns


def _recorded_scales(model: Model, records: Sequence[Record]) -> dict[int, JointScale]:
    """Natural sizes, by joint, of drives that are plain gains: sizes that followed from the file alone would be others
    in every unit of the drive."""
    found = {}
    for column, joint in enumerate(model.machine.modelled_joints):
        driven = [r.inputs.drive[:, column] for r in records if r.inputs.has_drive]
        if not driven or not isinstance(model.machine.joint(joint).drive, PlainGain):
            continue
        steps = [np.abs(np.diff(r.inputs.readings[:, column])) / r.inputs.period for r in records]
        speed = float(np.nanquantile(np.concatenate(steps), FAST))
        found[joint] = as_driven(model, column, np.concatenate(driven), speed)
    return found


def _drive_is_input(model: Model, record: Record) -> bool:
    """Whether the record says what moved the arm in every period: its drive, however the controller came to it.

    The drive of a board that rounds nothing is simulated as it is: that it is recorded brings nothing then
    (docs/decisions/0033).
    """
    return forms_rounded_drive(model, record.inputs.gains) and record.inputs.drive_of_every_period


def forms_rounded_drive(model: Model, gains: Floats) -> bool:
    """Whether a controller with these gains (n, GAINS) may round its drive, so that a simulation without rounding has
    another. A board's power for whole counts of error is whole as long as its gains are, with the errors that the model
    has of them, and it sums up no errors."""
    if isinstance(model.machine.controller, SampledPid):
        return True
    if not isinstance(model.machine.controller, BoardPid):
        return False
    errors = model.vector[[at.slot(j, at.GAIN_ERROR) for j in model.machine.modelled_joints]]
    of_counts = gains[:, [pid.P, pid.D]] * (gains[:, pid.SCALE] * (1.0 + errors))[:, None]
    return bool(np.any(gains[:, pid.I]) or np.any(np.abs(of_counts - np.round(of_counts)) > WHOLE))


def longest_step_of(model: Model) -> float:
    """Longest step of integration, s, with which a model can be simulated."""
    return CONTACT_STEP if any(use.name == "backlash" for use in model.effects) else COARSE_STEP


def _step_of_contacts(model: Model, vectors: Floats, longest_step: float) -> float:
    """Longest step of integration, s, that follows the contacts of friction in all of these states (p, vector)."""
    places = [at.slot(j, at.PRESLIDING) for j in model.machine.modelled_joints]
    share = float((vectors[:, places] / model.vector[places]).min())
    if share < SUDDEN and longest_step <= STEP:
        return CONTACT_STEP
    return STEP if share < SHORT else longest_step


def step_of_derivatives(model: Model) -> float:
    """Longest step of integration, s, of the runs that a finite difference compares: with longer ones, derivatives of a
    model with a flexible gear would be unstable."""
    return STEP if (model.flags & at.HAS_FLEXIBILITY).any() else COARSE_STEP


def difference(model: Model, unknown: Unknown, value: float, seconds: float) -> float:
    """The step of the finite difference by an unknown, away from its upper bound. seconds: length of the longest
    record."""
    parameter = model.by_name.get(unknown.name)
    stated = None if parameter is None else parameter.deviation
    size = DIFFERENCE * (unknown.deviation or stated or unknown.scale)
    over = unknown.parameter.rate_of
    if over is not None:
        size = TONE_DIFFERENCE / (1.0 if over is Tone.OVER_POSITION else seconds)
    if unknown.kind is Kind.INITIAL_POSITION:
        size /= LOOSE_START
    return -size if value + size > unknown.high else size


def _as_diagnosed(unknown: Unknown, given: Mapping[str, float], model: Model) -> Unknown:
    """The unknown as a diagnosis searches it.

    The prior mean of an effect's parameter is the value that it has in the given model. An initial posture gets a prior
    so wide that the trace decides it. Friction may also be there at once. All bends of a sound potentiometer get the
    same prior, because nothing says that its curve is smooth.
    """
    if unknown.name in given:
        unknown = replace(unknown, expected=given[unknown.name])
    if unknown.kind is Kind.PRESLIDING:
        return replace(unknown, low=SHORTEST_PRESLIDING * unknown.expected)
    if unknown.kind is Kind.INITIAL_POSITION and unknown.deviation is not None:
        limit = 2 * LOOSE_START * unknown.deviation
        return replace(unknown, deviation=LOOSE_START * unknown.deviation, low=-limit, high=limit)
    if unknown.nuisance and unknown.parameter.effect == "potentiometer_nonlinearity":
        sensor = model.machine.joint(unknown.joints[0]).sensor
        if sensor is not None and sensor.linearity is not None:
            return replace(unknown, deviation=BEND_SHARE * sensor.linearity.value * sensor.range.value)
    return unknown
