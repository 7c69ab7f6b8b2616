"""A case that is compared in torques."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from model.arrays import Floats
from model.discrepancy.diagnosis import CLEAR_SHAPE, RemainingShape, Step, Where
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.case import Case
from model.discrepancy.engine.fitting import Fit, fit
from model.discrepancy.engine.judging import FAR_ABOVE_NOISE, noises_left
from model.discrepancy.engine.probing import Probe, Projection, Start, Trial
from model.discrepancy.grounds import Method
from model.discrepancy.inverse_dynamics.candidates import list_trials, take_back
from model.discrepancy.inverse_dynamics.localisation import is_function_of, locate, remaining_shapes, torque_unit
from model.discrepancy.inverse_dynamics.residual import TorqueResidual, samples_of
from model.discrepancy.inverse_dynamics.resolution import OF_CHANGES, is_resolved
from model.discrepancy.inverse_dynamics.tolerances import tolerances
from model.discrepancy.localisation.statistics import LEAST
from model.discrepancy.options import TorqueOptions
from model.discrepancy.thresholds import WITHIN_NOISE
from model.discrepancy.verdict import Errors
from model.fitting.phases import phase_unknowns
from model.fitting.unknowns import Unknown
from model.inverse_dynamics.drive_timing import timing_unknowns
from model.inverse_dynamics.recorded_motion import RecordedMotion
from model.inverse_dynamics.recorded_sizes import recorded_sizes
from model.inverse_dynamics.repeats import TorqueNoise
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter
from model.machine_model.posterior import load_posterior

LONG_MEMORY = 4.0
"""Memory of a residual, in samples, beyond which it is slower than noise. White noise of a drive comes to 1.9 behind
the low-pass, that of accelerations to 2.7."""


@dataclass(frozen=True, eq=False)
class TorqueCase(Case):
    """records, unseen: the motions that are fitted to, and that are not. earlier: deviations of numbers, by name, that
    earlier fits to other records know better. source: of noise in the fitted records."""

    records: tuple[RecordedMotion, ...] = ()
    unseen: tuple[RecordedMotion, ...] = ()
    earlier: Mapping[str, float] | None = None
    source: TorqueNoise | None = None

    method: ClassVar[Method] = "inverse-dynamics"
    measure = "torques"
    noise_error = 0.1
    law_error = 0.0  # `UNSURE_NOISE` asks for three times the evidence instead
    unresolved_kind = OF_CHANGES

    def unknowns(self, model: Model, added: Mapping[str, Parameter]) -> tuple[Unknown, ...]:
        """Numbers of the file within their tolerances, those that were added, and how late drives act."""
        names = frozenset(added)
        before = tolerances(self.given, sizes=recorded_sizes(self.given, self.records), fitted=self.earlier)[0]
        own = [u for u in before if u.name not in names]
        sizes = {**recorded_sizes(model, self.records), **added}
        found = [u for u in tolerances(model, names, sizes)[0] if u.name not in {o.name for o in own}]
        return (*own, *found, *timing_unknowns(model), *phase_unknowns(model, len(self.records)))

    def first(self, unknowns: Sequence[Unknown]) -> Fit:
        """The model as it was given, with its numbers fitted."""
        return fit(self.compared.of_model(self.given), unknowns, {})

    def kept(self, now: Fit, wider: Model) -> Iterable[Unknown]:
        """The unknowns of a fit that a model with a further effect has as well, and those of records that it brings: a
        delay replaces the lateness, a disturbance has phases."""
        own = {u.name: u for u in (*timing_unknowns(wider), *phase_unknowns(wider, len(self.records)))}
        kept = [u for u in now.unknowns if not u.nuisance or u.name in own]
        return (*kept, *(u for name, u in own.items() if name not in now.values))

    def trials(self, clear: Projection, probed: Sequence[Probe]) -> Iterable[Trial]:  # noqa: ARG002 (of another kind)
        """Effects that the model of a fit lacks, and numbers that the file may state wrongly."""
        trials = list(list_trials(clear.now, self.records, self.options))
        places = sum(len(t.starts) for t in trials)
        return [t.among(places) for t in trials]

    def take_back(self, effect: str, own: Sequence[Parameter], now: Fit) -> Start:
        """Values with which an effect has taken over what a fit has made of stated numbers, as stated again."""
        return take_back(effect, own, now)

    def least_gain(self, trial: Trial, needed: float) -> float:  # noqa: ARG002 (of all)
        """Nothing: on a joint whose residual is large and slow, no effect promises much before it is fitted."""
        return 0.0

    def is_resolved(self, found: Fitted, before: Fit) -> bool:
        """Whether the records can tell an effect from a healthy machine."""
        return is_resolved(found, before, self.records, self.noise, self.options)

    def where(self, now: Fit) -> Where:
        """Where a model disagrees with the fitted records."""
        return locate(now, self.records, self.noise)

    def shapes(self, now: Fit) -> tuple[RemainingShape, ...]:
        """What is left, as a torque that a person could write an effect after."""
        return remaining_shapes(now, self.records, self.noise)

    def noise_beside(self, now: Fit) -> Floats:
        """(n,) noise of a residual, no more than what differs between passages of the same motion beside a model: a
        torque that goes with time differs as well."""
        return self.noise if self.source is None else np.minimum(self.noise, self.source.of(now.signals))

    def joints_left(self, now: Fit, first: Fit, *, named: bool) -> tuple[int, ...]:  # noqa: ARG002 (its own kind)
        """Joints whose residual is above noise on fitted and on held-out records, and is no noise: far above and
        slower, or of a shape. While nothing is named, any shape beyond noise counts."""
        least, shapes = noises_left(self, now), self.shapes(now)
        slow = (least > FAR_ABOVE_NOISE) & (now.memory > LONG_MEMORY)
        joints = now.model.machine.modelled_joints
        clear = {s.joint for s in shapes if s.explained >= CLEAR_SHAPE}
        shaped = (least > WITHIN_NOISE) & np.array([j in clear for j in joints])
        if not named:
            shaped |= np.array([j in {s.joint for s in shapes} for j in joints])
        return tuple(j for j, left in zip(joints, slow | shaped, strict=True) if left)

    def is_unlike(self, now: Fit, step: Step, left: Sequence[int]) -> bool:
        """Whether what is left is a function of a step's own torque, on a joint with something `left`.

        The numbers of a law are fitted. What is left as a function of the law's own torque is then something that the
        form of the law has not: another law of the same quantity acts beside it, or in its place.
        """
        absent = {p.name: p.null for n in step.parameters if (p := now.model.by_name[n]).null is not None}
        on = set(left) & set(step.joints)
        if not on or not absent:
            return False
        without = now.compared.at({**now.values, **absent})
        own = [less - all_of_it for less, all_of_it in zip(without, now.signals, strict=True)]
        joints = now.model.machine.modelled_joints
        return any(j in on and is_function_of(own, now, self.noise, k) for k, j in enumerate(joints))

    def unit(self, joint: int) -> str:
        """N·m, or N on a prismatic joint."""
        return torque_unit(self.given, joint)

    def errors(self, now: Fit) -> Errors:
        """Root mean squares of every joint."""
        held = () if self.held_out is None else _roots(self.held_squares(now))
        return {"fitted": _roots(self.compared.samples.mean_squares(now.signals)), "held_out": held}

    def noise_of_errors(self, now: Fit) -> tuple[Floats, Floats]:  # noqa: ARG002 (of the records)
        """The noise of the torques, which is not known well."""
        return self.noise, WITHIN_NOISE * self.noise

    def bias(self, now: Fit, parameters: Sequence[Parameter]) -> dict[str, float]:  # noqa: ARG002
        """None is known."""
        return {}

    def torque_left(self, now: Fit) -> float:
        """√(Σ residual² / Σ torque²) over all joints and compared samples of held-out records, else of the fitted
        ones, joints at rest included; NaN where nothing is driven."""
        seen = self.held_out is None
        left = sum(float((r**2).sum()) for r in (now.signals if seen else self.held(now)))
        records = self.records if seen else self.unseen
        whole = sum(float((r**2).sum()) for r in TorqueBalance(now.model, records).supplied_by_drive())
        return float(np.sqrt(left / whole)) if whole > 0.0 else math.nan


def torque_case(
    given: Model,
    records: tuple[RecordedMotion, ...],
    unseen: tuple[RecordedMotion, ...],
    source: TorqueNoise,
    options: TorqueOptions,
) -> TorqueCase:
    """The case of records."""
    balance = TorqueBalance(given, records)
    noise = source.of(balance.residual({}))
    floor = np.maximum(LEAST * noise, 1e-12)
    compared = TorqueResidual(balance, samples_of(records), floor)
    held = TorqueResidual(TorqueBalance(given, unseen), samples_of(unseen), noise, own_phases=True) if unseen else None
    return TorqueCase(
        given,
        compared,
        held,
        noise,
        noise,
        options,
        records=records,
        unseen=unseen,
        earlier=load_posterior(given, (r.name for r in (*records, *unseen))),
        source=source,
    )


def _roots(squares: Floats) -> tuple[float | None, ...]:
    return tuple(float(np.sqrt(s)) if np.isfinite(s) else None for s in squares)
