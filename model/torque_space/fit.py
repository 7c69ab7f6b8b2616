"""Parameters from recorded torques, with what the records cannot tell, and the torque that is left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.progress import Cancel, Never, Progress, silent
from daq.contracts.trace import Trace
from model.fitting.choice import chosen_unknowns
from model.fitting.covariance import sandwich
from model.fitting.fit import fitted_parameter
from model.fitting.identifiability import IdentifiabilityReport, judged
from model.fitting.least_squares import Search, solve
from model.fitting.options import FitOptions
from model.fitting.problem import whitened
from model.fitting.records import records_of
from model.fitting.result import FittedParameter
from model.fitting.robust import influence
from model.fitting.unknowns import prior_precision, scales
from model.fitting.whitening import fitted_whitener, white
from model.machine_model.model import Lineage, Model
from model.torque_space.problem import TorqueProblem
from model.torque_space.recorded_motion import CUTOFF, RecordedMotion, recorded_motion

Floats = NDArray[np.float64]

LONGEST_MEMORY = 40
"""Samples that the whitening of torques looks back: a low-passed residual is correlated over many."""


_SENSOR = "positions are taken as they were recorded"
_ROTOR = "the rotor's own motion is not recorded"
_CONTROLLER = "the controller takes no part in it"
NOT_IN_TORQUES = {
    "stiction": "whether the joint sticks is not recorded",
    "backlash": _ROTOR,
    "joint_compliance": _ROTOR,
    "motor_inductance": "the current is taken as settled",
    "resistance_drift": "how warm the winding was is not recorded",
    "potentiometer_gain": _SENSOR,
    "potentiometer_offset": _SENSOR,
    "potentiometer_nonlinearity": _SENSOR,
    "wrong_gain": _CONTROLLER,
    "lost_set_points": _CONTROLLER,
}
"""Effects that leave no mark in the torque that a recorded motion needs, and why. All others take part."""


class TorqueError(BaseModel):
    """One trace: root mean square of what is left of each joint's torque, and as a share of the torque (0 to …)."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    trace: str
    held_out: bool
    rms: tuple[float, ...]
    torque: tuple[float, ...]
    share: float


class TorqueFit(BaseModel):
    """What a fit of torques found. `in_sample` and `held_out` are relative torque errors over all joints and samples:
    √(Σ residual² / Σ torque²)."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    model: Model
    parameters: tuple[FittedParameter, ...]
    identifiability: IdentifiabilityReport
    errors: tuple[TorqueError, ...]
    in_sample: float
    held_out: float | None
    cutoff: float
    evaluations: int
    converged: bool


def fit_torques(
    model: Model, traces: Sequence[Trace], held_out: Sequence[Trace] = (), options: FitOptions | None = None, *,
    cutoff: float = CUTOFF, progress: Progress = silent, cancel: Cancel | None = None,
) -> TorqueFit:  # fmt: skip
    """Fit the parameters that the options choose so that the motion needs the torque that was recorded.

    Least squares with priors; verdicts and 95 % intervals take the correlation of the residual into account.

    Raises:
        TraceError, SpecError: for traces or options that cannot give a result, and for an effect in the model that
            torques cannot show (`NOT_IN_TORQUES`). CancelledError: when asked to end.
    """
    options, cancel = options or FitOptions(), cancel or Never()
    _check_effects(model)
    records_of([*traces, *held_out], model.machine, "position")
    unknowns = chosen_unknowns(model, options)
    progress(0.0, "low-passing the records")
    records = tuple(_recorded(model, t, cutoff) for t in traces)
    judged_by = [_recorded(model, t, cutoff) for t in held_out]
    problem = TorqueProblem(model, records, unknowns, np.ones(model.joint_count))
    begin = np.array([u.start for u in unknowns])
    scale = _left(problem, begin)

    def tell(count: int, rms: float) -> None:
        progress(0.9 * (1 - float(np.exp(-count / 10))), f"{count} evaluations, residual {rms:.3g} of the first")

    search = Search(options.robust, options.tolerance, options.most_evaluations or 60, tell)
    found = solve(problem, [white(float(s)) for s in scale], begin, cancel, search)
    parameters, report = _judged(problem, found.values, options)
    fitted = model.with_values({u.name: float(v) for u, v in zip(unknowns, found.values, strict=True)})
    names = tuple(t.record.trace_id for t in traces)
    errors = [_error(problem, found.values, n, r, held=False) for n, r in zip(names, records, strict=True)]
    errors += [
        _error(problem, found.values, t.record.trace_id, r, held=True) for t, r in zip(held_out, judged_by, strict=True)
    ]
    own = [u.name for u in unknowns]
    lineage = Lineage(parent=model.identity, traces=names, fit={"fitted": own, "known": list(report.known)})
    progress(1.0, "done")
    return TorqueFit(
        model=fitted.with_lineage(lineage), parameters=parameters, identifiability=report,
        errors=tuple(e for e, _, _ in errors),
        in_sample=_share(errors[: len(traces)]), held_out=_share(errors[len(traces) :]) if held_out else None,
        cutoff=cutoff, evaluations=found.evaluations, converged=found.converged,
    )  # fmt: skip


def _recorded(model: Model, trace: Trace, cutoff: float) -> RecordedMotion:
    """The motion of a trace with its torque. Raises TraceError where there is none, which nothing can be a share of."""
    record = recorded_motion(model, trace, cutoff)
    if not record.torque[record.kept].any():
        raise TraceError(f"trace {trace.record.trace_id}: its drive is 0 throughout, so it has no torque to fit to")
    return record


def _left(problem: TorqueProblem, values: Floats) -> Floats:
    every = np.concatenate([e.residual for e in problem.evaluate(values, derivatives=False)])
    return np.asarray(np.sqrt((every**2).mean(axis=0)))


def _check_effects(model: Model) -> None:
    for use in model.effects:
        if use.name in NOT_IN_TORQUES:
            raise SpecError(
                f"effect {use.name}: cannot take part in a fit of torques: {NOT_IN_TORQUES[use.name]}; leave it out"
            )


def _judged(
    problem: TorqueProblem, values: Floats, options: FitOptions
) -> tuple[tuple[FittedParameter, ...], IdentifiabilityReport]:
    """Values with intervals, and what the records cannot tell."""
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


def _error(
    problem: TorqueProblem, values: Floats, trace: str, record: RecordedMotion, *, held: bool
) -> tuple[TorqueError, float, float]:
    """The error of one trace, and the sums of squares of residual and torque."""
    left = problem.with_records([record]).evaluate(values, derivatives=False)[0].residual
    torque = record.torque[record.kept]
    squares, whole = float((left**2).sum()), float((torque**2).sum())
    error = TorqueError(
        trace=trace, held_out=held, rms=_rms(left), torque=_rms(torque),
        share=float(np.sqrt(squares / whole)),
    )  # fmt: skip
    return error, squares, whole


def _rms(signal: Floats) -> tuple[float, ...]:
    return tuple(float(v) for v in np.sqrt((signal**2).mean(axis=0)))


def _share(errors: Sequence[tuple[TorqueError, float, float]]) -> float:
    return float(np.sqrt(sum(e[1] for e in errors) / sum(e[2] for e in errors)))
