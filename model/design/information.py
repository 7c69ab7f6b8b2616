"""Predicts the information of an experiment on a model's parameters: Fisher information of simulated records.

Samples are weighted by the sensor's noise alone. The real residual is smaller than that at low frequencies, where the
loop suppresses it, and larger near the loop's bandwidth. So widths are predicted within a factor of about two.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.frozen import FrozenRecord
from daq.contracts.machine import Machine, NoController
from daq.contracts.trace import Trace, TraceRecord
from model.arrays import Floats
from model.fitting.covariance import inverse
from model.fitting.fit import INTERVAL, fit_problem
from model.fitting.options import FitOptions
from model.fitting.problem import whitened
from model.fitting.result import FitResult
from model.fitting.simulated import SimulatedProblem
from model.fitting.unknowns import Unknown, prior_precision, scales
from model.fitting.whitening import white
from model.machine_model.model import Model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate

Planner = Callable[[ExperimentSpec], Floats]
"""Computes the set points (k, joints of the machine) of an experiment in rad, one row per control period.

It raises a DaqError of one line for an experiment that the machine's limits do not allow. The caller supplies it, since
planning belongs to `daq`.
"""

FOLLOWING_SHARE = 0.6
"""Largest following error of a design, as a share of the error at which set points pause. It leaves a margin for a real
arm that is slower than the model."""


class ParameterGain(FrozenRecord):
    """Width of a parameter's 95 % interval (high − low, in its unit) without and with the proposed experiments."""

    name: str
    unit: str
    before: float
    after: float

    @property
    def share(self) -> float:
        """Share of the width that remains."""
        return self.after / self.before


class InformationGain(FrozenRecord):
    """Predicted gain of proposed experiments. `nats`: half the log of the ratio of the determinants of information."""

    parameters: tuple[ParameterGain, ...]
    nats: float


def information_gain(
    model: Model,
    specs: Sequence[ExperimentSpec],
    plan: Planner,
    *,
    options: FitOptions | None = None,
    fitted: FitResult | None = None,
) -> InformationGain:
    """Predicts how much narrower the intervals would be after the proposed experiments.

    Args:
        model: used in place of the real arm.
        options: selects parameters (`FitOptions.parameters`). fitted: prior knowledge; None: the priors.

    Raises SpecError if the experiments are not possible, or the fit was of other parameters.
    """
    if not specs:
        raise SpecError("no experiments: there is nothing to judge")
    options = options or (fitted.options if fitted is not None else FitOptions())
    added = [experiment_information(model, spec, plan, options) for spec in specs]
    unknowns = added[0][0]
    known = prior_information(unknowns) if fitted is None else _fitted_information(unknowns, fitted)
    total = known + sum(information for _, information in added)
    return gain_of(unknowns, known, total)


def gain_of(unknowns: Sequence[Unknown], known: Floats, total: Floats) -> InformationGain:
    """Returns the gain between two informations (p, p) in natural sizes."""
    widths = [np.sqrt(np.diag(np.linalg.inv(information))) for information in (known, total)]
    parameters = tuple(
        ParameterGain(name=u.name, unit=u.unit, before=2 * INTERVAL * s * b, after=2 * INTERVAL * s * a)
        for u, s, b, a in zip(unknowns, scales(tuple(unknowns)), *widths, strict=True)
    )
    return InformationGain(parameters=parameters, nats=log_det(total) - log_det(known))


def log_det(information: Floats) -> float:
    """Returns half of the logarithm of the determinant, in nats."""
    return 0.5 * float(np.linalg.slogdet(information)[1])


def prior_information(unknowns: Sequence[Unknown]) -> Floats:
    """Returns (p, p) information of the priors in natural sizes; without a stated deviation, that of 100 natural
    sizes."""
    precision = prior_precision(tuple(unknowns)) * scales(tuple(unknowns)) ** 2
    return np.diag(np.maximum(precision, 1e-4))


def experiment_information(
    model: Model, spec: ExperimentSpec, plan: Planner, options: FitOptions
) -> tuple[tuple[Unknown, ...], Floats]:
    """Returns unknowns (nuisances of the experiment itself marginalised) and their information (p, p) in natural sizes.

    Raises SpecError or SafetyError from the planner, and SpecError if the loop is unstable.
    """
    trace = imagined_trace(model, spec, plan)
    problem = fit_problem(model, [trace], options)
    check_followed(model, trace)
    values = np.array([u.start for u in problem.unknowns])
    floor = [white(d) for d in problem.floor]
    data = whitened(problem, problem.evaluate(values, derivatives=True), floor)
    natural = scales(problem.unknowns)
    information = replace(data, jacobian=data.jacobian * natural).information
    return _marginal(problem, information)


def imagined_trace(model: Model, spec: ExperimentSpec, plan: Planner) -> Trace:
    """Returns the record that the experiment would give on this model without noise. Raises as the planner does."""
    machine = model.machine
    if isinstance(machine.controller, NoController):
        raise SpecError(f"machine {machine.name} has no controller, so experiments with set points cannot be simulated")
    angles = np.asarray(plan(spec), dtype=np.float64)
    period = machine.controller.period.value
    record = TraceRecord(
        trace_id=spec.name or spec.trajectory.kind,
        created=datetime(2000, 1, 1, tzinfo=UTC),
        software="imagined",
        source="imported",
        robot=machine.name,
        spec=spec,
        gains=spec.gains or None,
        period=period,
    )
    joints = machine.modelled_joints
    wanted = np.ascontiguousarray(angles[:, [j - 1 for j in joints]])
    tick = np.arange(len(wanted))
    time = np.asarray(period * tick, dtype=np.float64)
    return Trace(record, joints, time, wanted, set_point=wanted, drive=np.zeros_like(wanted), tick=tick)


def check_followed(model: Model, trace: Trace) -> None:
    """Raises SpecError if the arm would fall so far behind that set points pause."""
    if model.machine.limits.following_error_counts is None:
        return
    assert trace.set_point is not None  # of an imagined trace
    error = simulate(model, trace, Options(quantise=False)).error
    if (why := falls_behind(model.machine, trace.set_point, error)) is not None:
        raise SpecError(why)


def falls_behind(machine: Machine, set_points: Floats, error: Floats) -> str | None:
    """Returns why set points might pause on an arm that is slightly slower than the model; None if they would not.

    The modelled joints have these errors (k, n) behind their set points (k, n), rad.
    """
    most = machine.limits.following_error_counts
    if most is None or isinstance(machine.controller, NoController):
        return None
    period = machine.controller.period.value
    for column, joint in enumerate(machine.modelled_joints):
        count = machine.joint(joint).count
        if not count:
            continue
        speed = machine.limits.joint(joint).speed
        smooth = FOLLOWING_SHARE / 2 * most if speed is None else speed * period / count
        counts = np.abs(error[:, column]) / count
        change = np.abs(np.diff(set_points[:, column], prepend=set_points[0, column])) / count
        if (worst := _falls_behind(counts, change, smooth, most)) is not None:
            return (
                f"joint {joint} would fall {counts[worst]:.0f} counts behind; set points pause at {most}, and a margin "
                "is kept"
            )
    return None


def _falls_behind(error: Floats, change: Floats, smooth: float, most: float) -> int | None:
    """Returns the first sample at which set points might pause on a slower arm than the model; None without one.

    All in ADC counts: `error` and `change` of the set point (n,), and the largest change of a smooth motion. The lag in
    a smooth motion depends on the arm, so a margin is kept. A step's size does not. It is judged as the runner judges
    it, by the limit itself, and its error may decay as long as it does not grow again.
    """
    dying_away = False
    for k in range(len(error)):
        if change[k] > smooth * (1 + 1e-6):
            before = error[k - 1] if k else 0.0
            if change[k] + before / FOLLOWING_SHARE > most:
                return k
            dying_away = True
        elif error[k] <= FOLLOWING_SHARE * most:
            dying_away = False
        elif not (dying_away and error[k] <= error[k - 1]):
            return k
    return None


def _marginal(problem: SimulatedProblem, information: Floats) -> tuple[tuple[Unknown, ...], Floats]:
    """Returns information about the unknowns of interest; nuisances are marginalised with their priors."""
    nuisance = np.array([u.nuisance for u in problem.unknowns])
    own = tuple(u for u in problem.unknowns if not u.nuisance)
    if not nuisance.any():
        return own, information
    inner = information[np.ix_(nuisance, nuisance)] + np.eye(int(nuisance.sum()))
    cross = information[np.ix_(nuisance, ~nuisance)]
    left = information[np.ix_(~nuisance, ~nuisance)] - cross.T @ np.linalg.solve(inner, cross)
    return own, 0.5 * (left + left.T)


def _fitted_information(unknowns: Sequence[Unknown], fitted: FitResult) -> Floats:
    """Returns information (p, p) in natural sizes from a fit, its priors included."""
    rows = []
    for u in unknowns:
        if u.name not in fitted.names:
            raise SpecError(f"{u.name}: was not fitted; fitted were {', '.join(p.name for p in fitted.parameters)}")
        rows.append(fitted.names.index(u.name))
    natural = scales(tuple(unknowns))
    covariance = fitted.covariance_matrix[np.ix_(rows, rows)] / np.outer(natural, natural)
    return inverse(covariance)
