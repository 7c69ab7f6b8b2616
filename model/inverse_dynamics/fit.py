"""Fits parameters to recorded torques (`daq fit --torques`), with verdicts and the residual torque."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.frozen import FrozenRecord
from daq.contracts.progress import Cancel, Never, Progress, silent
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.fitting.choice import chosen_unknowns
from model.fitting.consistent_bodies import coordinates_of, on_the_edge
from model.fitting.covariance import sandwich
from model.fitting.fit import fitted_parameter
from model.fitting.fitted import FittedParameter, html_of, known_of, text_of
from model.fitting.identifiability import IdentifiabilityReport, judged
from model.fitting.least_squares import Search, influence, solve
from model.fitting.options import FitOptions
from model.fitting.problem import Evaluation, whitened
from model.fitting.records import records_of
from model.fitting.unknowns import Unknown, prior_precision, scales
from model.fitting.whitening import fitted_whitener, white
from model.inverse_dynamics.drive_limits import find_drives_at_limit
from model.inverse_dynamics.recorded_motion import RecordedMotion, recorded_motion, recorded_motions
from model.inverse_dynamics.recorded_sizes import recorded_sizes, with_recorded_sizes
from model.inverse_dynamics.repeats import noise_of_torques
from model.inverse_dynamics.torque_balance import NOT_IN_TORQUES, TorqueBalance
from model.machine_model.model import Lineage, Model
from model.machine_model.posterior import summarise_posterior
from model.machine_model.record_verdict import JointLeft, RecordVerdict
from model.record_check.check import as_used, check_records, require_computable
from model.record_check.finding import RecordFinding, doubts_headline
from model.record_check.pieces import in_pieces
from model.units import joint_unit

CUTOFF = 12.0
"""Default cutoff of the low-pass, Hz."""
LEAST_LEFT = 1e-4
"""Least residual used for weights: in the first round a share of the drive's torque, in the last a share of the first.
A record without noise leaves almost none."""
LONGEST_MEMORY = 40
"""Most preceding samples that the whitening of residual torques uses: a low-passed residual is correlated."""


class TorqueError(FrozenRecord):
    """Errors of one trace: root mean square of each joint's residual torque and of its recorded torque.

    `share` is √(Σ residual² / Σ torque²) over all joints.
    """

    trace: str
    held_out: bool
    rms: tuple[float, ...]
    torque: tuple[float, ...]
    share: float


class TorqueFit(FrozenRecord):
    """Result of a fit of torques. `in_sample` and `held_out` are √(Σ residual² / Σ torque²) over all joints and
    samples."""

    model: Model
    parameters: tuple[FittedParameter, ...]
    identifiability: IdentifiabilityReport
    errors: tuple[TorqueError, ...]
    verdict: RecordVerdict | None = None
    """Whether the model explains the records fitted to; None in results of older versions."""
    in_sample: float
    held_out: float | None
    cutoff: float
    evaluations: int
    converged: bool
    at_limit: tuple[tuple[int, float], ...] = ()
    """Joints whose drives are at limits that the file does not state, with their share of the time. The missing torque
    is estimated as well."""
    unknown_joints: tuple[int, ...] = ()
    """Those of them whose torque is not known in some trace for that reason."""
    on_the_edge: tuple[str, ...] = ()
    """With consistent inertias, links with a flat or thin fitted body: the traces suggest an inconsistent one."""
    record: tuple[RecordFinding, ...] = ()
    """Findings of the check of the traces before the fit."""

    def __repr__(self) -> str:
        """Returns one line; `print` shows the parameters, too."""
        held_out = "" if self.held_out is None else f", held out {self.held_out:.1%}"
        left = f"remaining torque {self.in_sample:.1%}{held_out}"
        return f"<TorqueFit {self.model.identity}: {known_of(self.parameters)}, {left}>"

    def __str__(self) -> str:
        """Returns the line of `repr`, the parameters as a table, what is not determined, and the verdict."""
        return "\n".join([repr(self), text_of(self.parameters, self.identifiability), *self._said])

    def _repr_html_(self) -> str:
        """Returns the same as HTML, for a notebook."""
        return html_of(repr(self)[1:-1], self.parameters, self.identifiability, self._said)

    @property
    def _said(self) -> list[str]:
        return [] if self.verdict is None else [self.verdict.text]


@dataclass(frozen=True)
class TorqueCurves:
    """Torques along a trace at its compared times (m,), s: recorded and residual (m, n), N·m (N), low-passed alike."""

    trace: str
    joints: tuple[int, ...]
    time: Floats
    recorded: Floats
    left: Floats


def fit_torques(
    model: Model,
    traces: Sequence[Trace],
    held_out: Sequence[Trace] = (),
    options: FitOptions | None = None,
    *,
    cutoff: float = CUTOFF,
    progress: Progress = silent,
    cancel: Cancel | None = None,
) -> TorqueFit:
    """Fits the parameters that the options select, so that the motion needs the torque that was applied.

    Least squares with priors; verdicts and 95 % intervals allow for the correlation of the residual.

    Raises:
        TraceError, SpecError: for traces or options that cannot give a result, and for an effect in the model that
            torques cannot show (`NOT_IN_TORQUES`).
        CancelledError: when cancelled.
    """
    options, cancel = options or FitOptions(), cancel or Never()
    _check_effects(model)
    record = check_records(model, (*traces, *held_out), torques=True)
    require_computable(record)
    records_of([*traces, *held_out], model.machine, "position")
    traces, held_out = (in_pieces(as_used(some, model.machine)) for some in (traces, held_out))
    unknowns = chosen_unknowns(model, options)
    progress(0.0, "low-passing the records")
    motions = [_driven_motion(model, trace, cutoff) for trace in (*traces, *held_out)]
    asked_for = {n: p for n, p in recorded_sizes(model, motions[: len(traces)]).items() if n not in options.priors}
    unknowns = with_recorded_sizes(unknowns, asked_for)
    problem = TorqueProblem(model, tuple(motions[: len(traces)]), unknowns, np.ones(model.joint_count))
    coordinates = coordinates_of(model, unknowns, options)
    begin = np.array([u.start for u in unknowns])
    first = np.concatenate([e.residual for e in problem.evaluate(begin, derivatives=False)])

    def report_search(count: int, rms: float) -> None:
        progress(0.9 * (1 - float(np.exp(-count / 10))), f"{count} evaluations, residual {rms:.3g} of the first")

    search = Search(options.robust, options.tolerance, options.most_evaluations or 60, report_search)
    # the residual is 0 on a joint without information in any record; avoid a division by it
    torques = np.array(_rms(np.concatenate(problem.balance.supplied_by_drive())))
    begun = np.maximum(_rms(first), LEAST_LEFT * np.where(torques > 0.0, torques, 1.0))
    found = solve(problem, [white(float(size)) for size in begun], begin, cancel, search, coordinates)
    # fit again, weighted by the remaining residual: with that of the given model, priors would weigh too much
    left = np.concatenate([e.residual for e in problem.evaluate(found.values, derivatives=False)])
    sizes = np.maximum(_rms(left), LEAST_LEFT * begun)
    found = solve(problem, [white(float(size)) for size in sizes], found.values, cancel, search, coordinates)
    parameters, report = _judge_parameters(problem, found.values, options)
    fitted = model.with_values({u.name: float(v) for u, v in zip(unknowns, found.values, strict=True)})
    errors = [_error(fitted, motion, held_out=k >= len(traces)) for k, motion in enumerate(motions)]
    lineage = Lineage(
        parent=model.identity,
        traces=tuple(dict.fromkeys(t.record.trace_id for t in traces)),
        fit={
            "fitted": [u.name for u in unknowns],
            "known": list(report.known),
            **summarise_posterior(
                model.lineage,
                list(dict.fromkeys(t.record.trace_id for t in traces)),
                ((p.name, p.model_value, p.deviation) for p in parameters),
            ),
        },
    )
    limits = find_drives_at_limit(motions, model.machine.modelled_joints)
    progress(1.0, "done")
    return TorqueFit(
        model=fitted.with_lineage(lineage),
        parameters=parameters,
        identifiability=report,
        errors=tuple(error for error, _, _ in errors),
        verdict=_verdict(fitted, traces, motions[: len(traces)], cutoff).doubted(doubts_headline(record)),
        in_sample=_share(errors[: len(traces)]),
        held_out=_share(errors[len(traces) :]) if held_out else None,
        cutoff=cutoff,
        evaluations=found.evaluations,
        converged=found.converged,
        at_limit=limits.shares,
        unknown_joints=limits.unknown,
        on_the_edge=on_the_edge(model, fitted, options),
        record=record,
    )


def torque_curves(model: Model, trace: Trace, cutoff: float = CUTOFF) -> TorqueCurves:
    """Returns recorded and residual torque along a trace. Raises TraceError and SpecError as `fit_torques` does."""
    pieces = in_pieces(as_used([trace], model.machine))
    motions = recorded_motions(pieces, model.machine, cutoff)
    balance = TorqueBalance(model, motions)
    return TorqueCurves(
        trace.record.trace_id,
        model.machine.modelled_joints,
        np.concatenate([motion.time[motion.rows] for motion in motions]),
        np.concatenate(balance.supplied_by_drive()),
        np.concatenate(balance.residual({})),
    )


def _driven_motion(model: Model, trace: Trace, cutoff: float) -> RecordedMotion:
    """Returns the motion of a trace. Raises TraceError if its drive is zero throughout, without torque to fit to."""
    motion = recorded_motion(trace, model.machine, cutoff)
    if not TorqueBalance(model, (motion,)).supplied_by_drive()[0].any():
        raise TraceError(f"trace {motion.name}: its drive is 0 throughout, so there is no torque to fit to")
    return motion


def _check_effects(model: Model) -> None:
    for use in model.effects:
        if use.name in NOT_IN_TORQUES:
            raise SpecError(f"effect {use.name}: cannot be fitted to torques: {NOT_IN_TORQUES[use.name]}; leave it out")


def _judge_parameters(
    problem: TorqueProblem, values: Floats, options: FitOptions
) -> tuple[tuple[FittedParameter, ...], IdentifiabilityReport]:
    """Returns values with intervals, and the report on what the records do not determine."""
    evaluations = problem.evaluate(values, derivatives=True)
    whiteners = [
        fitted_whitener([e.residual[:, j] for e in evaluations], LONGEST_MEMORY, 1e-9)
        for j in range(problem.model.joint_count)
    ]
    data = whitened(problem, evaluations, whiteners)
    report = judged(data.jacobian.reshape(data.residual.size, -1), values, problem.unknowns)
    natural = scales(problem.unknowns)
    scaled = replace(data, jacobian=data.jacobian * natural)
    cut = influence(data.residual) if options.robust else data.residual
    prior = np.maximum(prior_precision(problem.unknowns) * natural**2, 1e-12)
    deviations = natural * np.sqrt(np.diag(sandwich(scaled.information, scaled.scores(cut), prior)))
    parameters = tuple(
        fitted_parameter(u, float(v), float(d), report.verdict(u.name))
        for u, v, d in zip(problem.unknowns, values, deviations, strict=True)
    )
    return parameters, report


def _error(model: Model, motion: RecordedMotion, *, held_out: bool) -> tuple[TorqueError, float, float]:
    """Returns the error of one trace, and the sums of squares of residual and torque."""
    balance = TorqueBalance(model, (motion,))
    left, torque = balance.residual({})[0], balance.supplied_by_drive()[0]
    squares, whole = float((left**2).sum()), float((torque**2).sum())
    share = float(np.sqrt(squares / whole))
    error = TorqueError(trace=motion.name, held_out=held_out, rms=_rms(left), torque=_rms(torque), share=share)
    return error, squares, whole


def _verdict(model: Model, traces: Sequence[Trace], motions: Sequence[RecordedMotion], cutoff: float) -> RecordVerdict:
    """Returns the verdict on the records that were fitted to; the noise is that of a diagnosis."""
    balance = TorqueBalance(model, tuple(motions))
    residual = np.concatenate(balance.residual({}))
    torque = _rms(np.concatenate(balance.supplied_by_drive()))
    noise = noise_of_torques(model, traces, balance, cutoff).of(balance.residual({}))
    joints = model.machine.modelled_joints
    left = [
        JointLeft(
            joint=joint,
            unit="N·m" if joint_unit(model.machine, joint) == "rad" else "N",
            rms=rms,
            noise=float(noise[column]),
            there=torque[column],
        )
        for column, (joint, rms) in enumerate(zip(joints, _rms(residual), strict=True))
    ]
    return RecordVerdict.of(model, left, len(residual))


def _rms(signal: Floats) -> tuple[float, ...]:
    return tuple(float(v) for v in np.sqrt((signal**2).mean(axis=0)))


def _share(errors: Sequence[tuple[TorqueError, float, float]]) -> float:
    return float(np.sqrt(sum(e[1] for e in errors) / sum(e[2] for e in errors)))


# --- A fit of torques as a problem for the numerics of fitting: residual torques and their derivatives by the unknowns


DIFFERENCE = 1e-3
"""Step of the finite differences, as a share of a parameter's natural size. With smaller steps, derivatives by
parameters without influence are rounding errors (such as the mass of a link that only turns about itself). A fit
without priors then ends where it began."""


@dataclass(frozen=True)
class TorqueProblem:
    """Torque that the motion needs − torque that was applied, N·m (N), for records of one machine."""

    model: Model
    records: tuple[RecordedMotion, ...]
    unknowns: tuple[Unknown, ...]
    floor: Floats

    @cached_property
    def balance(self) -> TorqueBalance:
        """The torque balance of all records."""
        return TorqueBalance(self.model, self.records, difference=DIFFERENCE)

    @property
    def runs(self) -> Sequence[Sequence[slice]]:
        """Per record, all of its compared samples."""
        return [[slice(0, len(record.moving))] for record in self.records]

    def evaluate(self, values: Floats, derivatives: bool) -> list[Evaluation]:
        """Returns residuals of every record, with their derivatives on request."""
        named = {u.name: float(v) for u, v in zip(self.unknowns, values, strict=True)}
        residual = self.balance.residual(named)
        if not derivatives:
            return [Evaluation(r, None) for r in residual]
        slopes = self.balance.slopes(named, self.unknowns)
        return [Evaluation(r, np.stack([slope[i] for slope in slopes])) for i, r in enumerate(residual)]
