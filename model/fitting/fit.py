"""Estimates a model's parameters from traces."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import NoController
from daq.contracts.progress import Cancel, CancelledError, Never, Progress, silent
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.fitting.choice import chosen_unknowns, with_nuisances
from model.fitting.consistent_bodies import coordinates_of, on_the_edge
from model.fitting.covariance import sandwich
from model.fitting.fitted import FittedParameter, JointError
from model.fitting.identifiability import IdentifiabilityReport, ParameterVerdict, judged
from model.fitting.judged import joints_left, rms_of
from model.fitting.least_squares import Search, Solution, influence, solve
from model.fitting.nelder_mead import climb
from model.fitting.noise import noise_effect
from model.fitting.options import FitOptions
from model.fitting.problem import Evaluation, whitened
from model.fitting.records import Signal, noise_floor, records_of
from model.fitting.result import FitResult
from model.fitting.simulated import SimulatedProblem
from model.fitting.unknowns import Coordinates, Unknown, prior_precision, scales
from model.fitting.whitening import Whitener, fitted_whitener, white
from model.machine_model.model import Lineage, Model
from model.machine_model.posterior import summarise_posterior
from model.machine_model.record_verdict import JointLeft, RecordVerdict
from model.record_check.check import as_used, check_records, require_computable
from model.record_check.finding import doubts_headline

INTERVAL = 1.959964
"""Number of standard deviations to either side that contain 95 % of a Gaussian."""
SETTLED = 0.33
"""Largest change of the values in a round, in their deviations, at which the rounds end."""
LEAST_SQUARES_EVALUATIONS = 60
ROUND_EVALUATIONS = 2
"""Most evaluations in a round that is not the last: the next round changes the weights anyway."""
FIRST_TOLERANCE = 100.0
"""Tolerance of the first search, as a multiple of that of the rounds: it only needs to come close."""
SIMPLEX_EVALUATIONS = 400
"""Most evaluations of the Nelder–Mead search per parameter."""


def fit(
    model: Model,
    traces: Sequence[Trace],
    options: FitOptions | None = None,
    progress: Progress = silent,
    cancel: Cancel | None = None,
) -> FitResult:
    """Returns the parameters with which the model reproduces the traces best, with intervals and identifiability.

    This is an output-error fit: the model's own control loop follows the recorded set points, and its readings are
    compared with the recorded ones. A first search weights every sample by the sensor's noise. Rounds follow, each in
    three steps: the mean effect of the noise is subtracted, residual and Jacobian are whitened, and the search
    continues. The traces are checked first; `record` of the result holds the findings.

    Raises:
        TraceError, SpecError: for traces or options that cannot give a result; one line says why.
        CancelledError: when cancelled.
    """
    options, cancel, begun = options or FitOptions(), cancel or Never(), time.perf_counter()
    record = check_records(model, traces, torques=False)
    require_computable(record)
    problem = fit_problem(model, traces, options).with_phases_begun()
    coordinates = coordinates_of(problem.model, problem.unknowns, options)
    before = problem.evaluate(_starts(problem), derivatives=False)
    solution = _first_search(problem, coordinates, options, progress, cancel)
    evaluations = solution.evaluations
    whiteners: list[Whitener] = [white(d) for d in problem.floor]
    for number in range(options.rounds):
        last, most = solution, options.most_evaluations or LEAST_SQUARES_EVALUATIONS
        if number + 1 < options.rounds:
            most = min(most, ROUND_EVALUATIONS)
        progress(0.5 + 0.4 * number / options.rounds, f"round {number + 1}: noise and whitening")
        problem, whiteners = with_noise(problem, solution.values, options)
        if options.method == "nelder_mead":
            break
        search = Search(options.robust, options.tolerance, most)
        solution = solve(problem, whiteners, solution.values, cancel, search, coordinates)
        evaluations += solution.evaluations
        if _settled(last.values, solution):
            solution = replace(solution, converged=True, message="values have converged")
            break
    progress(0.95, "intervals and identifiability")
    estimate = _estimate(problem, whiteners, solution.values, options)
    progress(1.0, "done")
    solution = replace(solution, evaluations=evaluations)
    result = _result(model, problem, solution, estimate, before, traces, options, time.perf_counter() - begun)
    assert result.verdict is not None
    return result.model_copy(update={"record": record, "verdict": result.verdict.doubted(doubts_headline(record))})


def fit_problem(model: Model, traces: Sequence[Trace], options: FitOptions) -> SimulatedProblem:
    """Returns residuals and unknowns of a fit, before any search. Raises TraceError and SpecError as `fit` does."""
    signal = _signal(model, options)
    unknowns = chosen_unknowns(model, options)
    loop = _loop(model, options)
    records = records_of(as_used(traces, model.machine, loop), model.machine, signal)
    samples = sum(r.samples for r in records)
    if samples <= len(unknowns):
        raise TraceError(
            f"{samples} samples for {len(unknowns)} parameters: there must be more samples than parameters"
        )
    wider, nuisances = with_nuisances(model, records, options, signal)
    floor = noise_floor(records, model.machine, signal)
    return SimulatedProblem(wider, records, (*unknowns, *nuisances), floor, signal, loop, options.step)


def _loop(model: Model, options: FitOptions) -> Literal["closed", "open"]:
    return options.loop or ("open" if isinstance(model.machine.controller, NoController) else "closed")


def _signal(model: Model, options: FitOptions) -> Signal:
    if options.signal is not None:
        return options.signal
    kinds = {s.measures for j in model.machine.modelled_joints if (s := model.machine.joint(j).sensor) is not None}
    if len(kinds) > 1:
        raise SpecError("some joints measure position and some velocity: state with `signal` which to fit")
    return "velocity" if kinds == {"velocity"} else "position"


def _starts(problem: SimulatedProblem) -> Floats:
    return np.array([u.start for u in problem.unknowns])


def _first_search(
    problem: SimulatedProblem, coordinates: Coordinates | None, options: FitOptions, progress: Progress, cancel: Cancel
) -> Solution:
    """Returns the best search from the model's own values and from seeded draws, with equal weights for all samples."""
    whiteners = [white(d) for d in problem.floor]
    found: list[Solution] = []
    failure: SpecError | None = None
    for number, begin in enumerate(_beginnings(problem, options)):
        share = 0.5 / options.starts

        def report(count: int, rms: float, number: int = number, share: float = share) -> None:
            done = share * (number + 1 - np.exp(-count / 20))
            progress(done, f"start {number + 1} of {options.starts}: {count} evaluations, residual {rms:.3g} noises")

        try:
            if options.method == "nelder_mead":
                most = options.most_evaluations or SIMPLEX_EVALUATIONS * len(problem.unknowns)
                found.append(climb(problem, begin, cancel, most, options.tolerance, report))
            else:
                most = options.most_evaluations or LEAST_SQUARES_EVALUATIONS
                search = Search(False, FIRST_TOLERANCE * options.tolerance, most, report)
                found.append(solve(problem, whiteners, begin, cancel, search, coordinates))
        except SpecError as error:
            failure = failure or error
    if not found:
        raise failure or SpecError("no search could begin")
    return min(found, key=lambda s: s.cost)


def _beginnings(problem: SimulatedProblem, options: FitOptions) -> list[Floats]:
    rng = np.random.default_rng(options.seed)
    own = _starts(problem)
    found = [own]
    for _ in range(options.starts - 1):
        spread = np.array([0.0 if u.nuisance else u.scale for u in problem.unknowns])
        draw = own + spread * rng.normal(size=len(own))
        low, high = (np.array([getattr(u, side) for u in problem.unknowns]) for side in ("low", "high"))
        found.append(np.clip(draw, low, high))
    return found


def with_noise(
    problem: SimulatedProblem, values: Floats, options: FitOptions
) -> tuple[SimulatedProblem, list[Whitener]]:
    """Subtracts the mean effect of noise in the control loop, and fits whiteners to the residual."""
    if options.replicas and problem.loop == "closed" and problem.signal == "position":
        problem = problem.with_offset(noise_effect(problem, values, options.replicas, options.seed))
    evaluations = problem.evaluate(values, derivatives=False)
    whiteners = []
    for column, floor in enumerate(problem.floor):
        runs = [e.residual[run, column] for e, runs in zip(evaluations, problem.runs, strict=True) for run in runs]
        if options.whiten:
            whiteners.append(fitted_whitener(runs, options.longest_memory, floor))
        else:
            whiteners.append(white(max(floor, float(np.sqrt(np.mean(np.concatenate(runs) ** 2))))))
    return problem, whiteners


@dataclass(frozen=True)
class _Estimate:
    """Estimates at the solution. `after` is simulated − measured, without subtracting the mean effect of the noise."""

    covariance: Floats
    report: IdentifiabilityReport
    after: list[Evaluation]
    mean_square: float


def _estimate(
    problem: SimulatedProblem, whiteners: Sequence[Whitener], values: Floats, options: FitOptions
) -> _Estimate:
    """Estimates covariance and identifiability at the solution."""
    evaluations = problem.evaluate(values, derivatives=True)
    data = whitened(problem, evaluations, whiteners)
    scale = scales(problem.unknowns)
    scaled = replace(data, jacobian=data.jacobian * scale)
    cut = influence(data.residual) if options.robust else data.residual
    prior = np.maximum(prior_precision(problem.unknowns) * scale**2, 1e-12)
    covariance = sandwich(scaled.information, scaled.scores(cut), prior) * np.outer(scale, scale)
    if options.replicas and problem.offset is not None:
        covariance = covariance * (1.0 + 1.0 / options.replicas)  # the mean of the replicas has its own noise
    report = judged(data.jacobian.reshape(data.residual.size, -1), values, problem.unknowns)
    after = problem.with_offset(None).evaluate(values, derivatives=False)
    return _Estimate(covariance, report, after, float(np.mean(data.residual**2)))


def _settled(last: Floats, solution: Solution) -> bool:
    """Whether the last round changed the values by little, averaged over all directions.

    Each round draws new noise for its replicas, which alone moves every direction by a third of its deviation. Values
    that stay only because no step of the search improved them have not settled.
    """
    if solution.information is None:
        return True
    if not solution.converged and solution.steps == 0:
        return False
    moved = solution.values - last
    return bool(moved @ solution.information @ moved < SETTLED**2 * len(last))


def _result(
    model: Model,
    problem: SimulatedProblem,
    solution: Solution,
    estimate: _Estimate,
    before: Sequence[Evaluation],
    traces: Sequence[Trace],
    options: FitOptions,
    seconds: float,
) -> FitResult:
    names = tuple(u.name for u in problem.unknowns)
    own = {u.name: float(v) for u, v in zip(problem.unknowns, solution.values, strict=True) if not u.nuisance}
    identities = tuple(record.name for record in problem.records)
    fitted = model.with_values(own)
    left = joints_left(problem, solution.values, estimate.after, traces)
    errors = _errors(problem, rms_of(problem, before), left)
    deviations = np.sqrt(np.diag(estimate.covariance))
    parameters = tuple(
        fitted_parameter(u, float(v), float(d), estimate.report.verdict(u.name))
        for u, v, d in zip(problem.unknowns, solution.values, deviations, strict=True)
        if not u.nuisance
    )
    summary = {
        "rmse": [e.after for e in errors],
        "whitened_mean_square": estimate.mean_square,
        "converged": solution.converged,
        "fitted": list(own),
        "known": list(estimate.report.known),
        **summarise_posterior(model.lineage, identities, ((p.name, p.model_value, p.deviation) for p in parameters)),
    }
    fitted = fitted.with_lineage(Lineage(parent=model.identity, traces=identities, fit=summary))
    return FitResult(
        model=fitted,
        parameters=parameters,
        identifiability=estimate.report,
        errors=errors,
        verdict=RecordVerdict.of(fitted, left, sum(r.samples for r in problem.records)),
        whitened_mean_square=estimate.mean_square,
        names=names,
        values=tuple(map(float, solution.values)),
        covariance=tuple(tuple(map(float, row)) for row in estimate.covariance),
        traces=identities,
        samples=sum(r.samples for r in problem.records),
        options=options,
        evaluations=solution.evaluations,
        seconds=seconds,
        converged=solution.converged,
        message=solution.message,
        on_the_edge=on_the_edge(model, fitted, options),
    )


def fitted_parameter(u: Unknown, value: float, deviation: float, verdict: ParameterVerdict) -> FittedParameter:
    """Returns the result for one parameter, without value and interval if the data do not determine it."""
    near = 1e-6 * u.scale
    at_bound = "low" if value - u.low < near else "high" if u.high - value < near else None
    known = verdict.verdict == "known"
    return FittedParameter(
        name=u.name,
        unit=u.unit,
        verdict=verdict.verdict,
        reason=verdict.reason,
        value=value if known else None,
        deviation=deviation if known else None,
        low=max(u.low, value - INTERVAL * deviation) if known else None,
        high=min(u.high, value + INTERVAL * deviation) if known else None,
        model_value=value,
        before=u.start,
        expected=None if u.deviation is None else u.expected,
        expected_deviation=u.deviation,
        at_bound=at_bound,
    )


def _errors(problem: SimulatedProblem, before: Floats, left: Sequence[JointLeft]) -> tuple[JointError, ...]:
    """Returns the residual of each joint before the fit, root mean squares (n,), and after it."""
    return tuple(
        JointError(
            joint=one.joint, unit=one.unit, before=float(first), after=one.rms, floor=float(floor), noise=one.noise
        )
        for one, first, floor in zip(left, before, problem.floor, strict=True)
    )


__all__ = ["CancelledError", "FitOptions", "FitResult", "fit", "fit_problem", "with_noise"]
