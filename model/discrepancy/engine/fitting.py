"""Fits unknowns to what a model leaves of records: weighted least squares with priors, re-linearised until it settles.

Derivatives take most of the time. They are computed where a fit begins and kept; every trial of a step corrects them
along the step (Broyden 1965, in the metric of the information). They are computed anew only where a step has moved the
residual otherwise than they said.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from model.arrays import Floats
from model.discrepancy.diagnosis import FoundValue
from model.discrepancy.engine.bodies import unknown_bodies
from model.discrepancy.engine.priors import prior_cost, prior_rows
from model.discrepancy.engine.residual import Residual, Signals, Values
from model.fitting.covariance import sandwich
from model.fitting.fit import INTERVAL
from model.fitting.least_squares import bounded_step
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

Slopes = dict[str, Floats]
"""Derivatives (N,) of the residual, by unknown."""

ROUNDS = 8
"""Most steps of a fit that begins near its end."""
ATTEMPTS = ((1.0, 0.0), (1.0, 1e-3), (0.4, 0.0), (1.0, 1e-2), (1.0, 0.1), (0.12, 0.0), (1.0, 1.0))
"""Steps that are tried until one is downhill, as a share of the whole one and a damping in shares of the information's
diagonal (Marquardt 1963), each from derivatives that those before have corrected. A short step helps where the cost is
strongly curved. Along a valley in which records tell little a whole step is far too long; a little damping shortens it
there alone."""
DAMPING = 0.01
"""Damping of a step, over the scales of its unknowns. It decides only what the records do not: a tilt about an axis
along gravity would be thrown to its bound otherwise, and all other numbers would stay where they are, since the step as
a whole leads uphill."""
LEAST_DAMPING = 1e-9
"""The least of that damping: where derivatives are huge, one by the scales alone is lost in rounding."""
LONG = 32
"""Most steps of a fit that has to find its way."""
STEPS_APART = 4
"""Steps after which derivatives by all unknowns are computed anew, if corrected ones have led so far."""
SETTLED = 0.3
"""Fall of −2 log posterior below which a fit has settled: one unit is one standard deviation of one parameter."""
BENT = (0.4, 0.12)
"""Shares of a step that leads uphill at which a curved path is tried: along a valley of two numbers whose product
counts, what a step misses tells how the valley bends."""
INNER = 12
"""Most rounds in which a step of bodies is found with the priors where it leads."""
HALVED = (1.0, 0.5, 0.25, 0.125)
"""Shares of such a round's step that are tried."""
FORETOLD = 0.1
"""Share of the residual's change that derivatives may have missed and still hold."""
FOLDS = 4
"""Blocks into which the fitted records are cut where none are held out."""
BLOCK_ROUNDS = 2
"""Rounds of the fit to all blocks but one."""
LONGEST_MEMORY = 60
"""Samples over which residuals are taken to be correlated: twenty periods of the cutoff of torques."""


@dataclass(frozen=True)
class Fit:
    """A model whose unknowns have values.

    signals, row: what it leaves of the compared records, as arrays and in a row. memory: (n,) samples that count as
    one. by_joint: −2 log likelihood (n,); prior: −2 log prior. known: derivatives by every unknown, from values that
    the last step hardly led away from; empty where none of its own are known.
    """

    compared: Residual
    unknowns: tuple[Unknown, ...]
    values: dict[str, float]
    signals: Signals
    row: Floats
    memory: Floats
    by_joint: Floats
    prior: float
    known: Slopes

    @property
    def model(self) -> Model:
        """The model, with its numbers as they were before the fit."""
        return self.compared.model

    @property
    def cost(self) -> float:
        """−2 log posterior up to a constant of the records; infinite where a simulation did not stay finite."""
        found = float(self.by_joint.sum()) + self.prior
        return found if math.isfinite(found) else math.inf

    @property
    def model_values(self) -> dict[str, float]:
        """The values of the model's parameters, without those of the records."""
        return {name: value for name, value in self.values.items() if name in self.model.by_name}

    @property
    def fitted_model(self) -> Model:
        """The model with these values."""
        return self.model.with_values(self.model_values)

    @cached_property
    def squares(self) -> Floats:
        """(n,) mean squares of what is left."""
        return self.compared.samples.mean_squares(self.signals)

    @cached_property
    def squares_of_blocks(self) -> Floats:
        """(n,) mean squares of what quarters of the records leave, each predicted from the others."""
        sums, counts = np.zeros(len(self.memory)), np.zeros(len(self.memory))
        for fold in range(FOLDS):
            others, inside = self.compared.within(fold, FOLDS)
            found = fit(others, self.unknowns, self.values, self.memory, rounds=BLOCK_ROUNDS)
            left = inside.samples
            sums += np.nan_to_num(left.mean_squares(found.signals)) * left.told
            counts += left.told
        return np.asarray(np.where(counts > 0.0, sums / np.maximum(counts, 1.0), np.nan))

    @cached_property
    def deviations(self) -> Floats:
        """(n,) with which samples are weighed."""
        return self.compared.deviations(self.row)

    def weighted(self, rows: Floats, joint: int | None = None) -> Floats:
        """Rows (…, N) as this fit weighs them; of one joint (index) alone, where it is given."""
        return self.compared.weighted(rows, self.deviations, self.memory, joint)

    @cached_property
    def standard_deviations(self) -> dict[str, float]:
        """Of the unknowns that change the residual at all, by name."""
        return standard_deviations(self)

    def slopes(self) -> Slopes:
        """Derivatives by every unknown."""
        if self.known or not self.unknowns:
            return self.known
        rows = slopes_at(self.compared, self.values, self.unknowns)
        return dict(zip((u.name for u in self.unknowns), rows, strict=True))

    def with_slopes(self) -> Fit:
        """The same with derivatives."""
        return replace(self, known=self.slopes())


def slopes_at(compared: Residual, values: Values, unknowns: Sequence[Unknown]) -> Floats:
    """(k, N) derivatives of a residual; none of those whose products are no normal numbers: what a start does to a
    record fades below them, and a processor takes a hundred times as long over them."""
    rows = compared.slopes(values, unknowns)
    rows[np.abs(rows) < math.sqrt(np.finfo(float).tiny)] = 0.0
    return rows


def fit(
    compared: Residual,
    unknowns: Sequence[Unknown],
    begin: Values,
    memory: Floats | None = None,
    known: Slopes | None = None,
    rounds: int = ROUNDS,
    goal: float = math.inf,
) -> Fit:
    """Values that make the residual most probable, starting from `begin` where it names an unknown.

    Args:
        memory: (n,) memory of the residual, where it is to be that of another fit, so that the two can be compared.
        known: derivatives of a place near it, of another model with some of these unknowns. goal: a cost; the fit ends
            where the steps that are left, each as good as the last, would not lead there.
    """
    values = start_values(unknowns, begin)
    near = known or {}
    slopes = {u.name: near[u.name] for u in unknowns if u.name in near}
    first = evaluate(compared, unknowns, values, np.ones(len(compared.floor)) if memory is None else memory)
    first = descend(first, slopes, rounds, goal)
    if memory is not None:
        return first
    memory = compared.memory(first.row)
    if np.array_equal(memory, first.memory):
        return first
    return descend(evaluate(compared, unknowns, first.values, memory), first.known, rounds, goal)


def start_values(unknowns: Sequence[Unknown], begin: Values) -> dict[str, float]:
    """Values of the unknowns within their bounds, as expected where `begin` names none."""
    return {u.name: float(np.clip(begin.get(u.name, u.expected), u.low, u.high)) for u in unknowns}


def evaluate(compared: Residual, unknowns: Sequence[Unknown], values: dict[str, float], memory: Floats) -> Fit:
    """A model with these values, whatever they are."""
    signals = compared.at(values)
    row = compared.samples.flat(signals)
    cost = compared.costs(row, memory)
    return Fit(compared, tuple(unknowns), values, signals, row, memory, cost, prior_cost(unknowns, values), {})


def descend(best: Fit, slopes: Slopes, rounds: int = ROUNDS, goal: float = math.inf) -> Fit:
    """The fit after Gauss–Newton steps until it settles.

    Args:
        slopes: derivatives of a place near it, of some unknowns or of all. Those of all are computed anew where
            steps by the corrected ones end; of some, they are only corrected, and all others are computed at every step
            that they have not foretold.
    """
    if not best.unknowns or not math.isfinite(best.cost):
        return best
    names = [u.name for u in best.unknowns]
    own = [k for k, name in enumerate(names) if name not in slopes]
    partly = 0 < len(own) < len(names)
    J = np.zeros((len(names), len(best.row)))
    for k, name in enumerate(names):
        if name in slopes:
            J[k] = slopes[name]
    due, since, begun, bodies = bool(own), 0, best.cost, unknown_bodies(best.model, best.unknowns)
    for number in range(rounds):
        if due:
            which = own if partly else list(range(len(names)))
            rows = slopes_at(best.compared, best.values, [best.unknowns[k] for k in which])
            J[which] = np.where(np.isfinite(rows).all(axis=1, keepdims=True), rows, 0.0)  # none where it runs away
            since, begun = 0, best.cost
        following, J, foretold = _step(best, J)
        if following is not best:
            before, after = (np.array([one.values[name] for name in names]) for one in (best, following))
            for body in bodies:
                body.transport(J, before, after)
        fell = 0.0 if following is best else best.cost - following.cost
        best = following
        since, ends = since + 1, fell < SETTLED
        if ends and (partly or begun - best.cost < SETTLED or (due and foretold)):
            break
        due = not foretold if partly else ends or since == STEPS_APART
        if number > 0 and best.cost - fell * (rounds - number - 1) > goal:
            break
    return replace(best, known=dict(zip(names, J, strict=True)))


@dataclass
class _Linearised:
    """A fit in scales of its unknowns, with derivatives that steps correct.

    rows, aims: of the priors (c, p), (c,). A: weighted derivatives (p, N). J: (p, N) those of the residual, by the
    unknowns themselves. seen: (p, p) A Aᵀ. low, high: (p,) room to the bounds.
    """

    now: Fit
    J: Floats

    def __post_init__(self) -> None:
        now = self.now
        scale, low, high = (np.array([getattr(u, side) for u in now.unknowns]) for side in ("scale", "low", "high"))
        self.scale, self.at = scale, np.array([now.values[u.name] for u in now.unknowns])
        rows, self.aims = prior_rows(now.unknowns, self.at)
        self.rows, self.left = rows * scale, now.weighted(now.row)
        self.A = now.weighted(self.J) * scale[:, None]
        self.seen = self.A @ self.A.T
        self.low, self.high = (low - self.at) / scale, (high - self.at) / scale
        self.bodies = unknown_bodies(now.model, now.unknowns)

    @property
    def information(self) -> Floats:
        """(p, p) of records and priors."""
        return np.asarray(self.seen + self.rows.T @ self.rows)

    def damping(self, share: float) -> Floats:
        """(p,) what is added to the diagonal of the information, a share of it."""
        return np.asarray(DAMPING**2 + (LEAST_DAMPING + share) * np.diag(self.information))

    def best_step(self, share: float) -> tuple[Floats, float]:
        """The step (p,) of the lowest cost as far as derivatives tell, damped by a share of the information, and how
        far the cost falls. Torques are linear in other numbers of bodies than priors, and neither costs a simulation:
        the step is found by both as they are."""
        damping, given = self.damping(share), self.A @ self.left

        def cost(step: Floats) -> float:
            _, aims = prior_rows(self.now.unknowns, self.at + step * self.scale)
            y = self.told(step)
            return float(y @ (self.seen @ y + 2.0 * given) + step @ (damping * step) + aims @ aims)

        step = np.zeros_like(self.at)
        first = least = cost(step)
        for _ in range(INNER if self.bodies else 1):
            rows, aims = prior_rows(self.now.unknowns, self.at + step * self.scale)
            rows, chain = rows * self.scale, self.told_by(step)
            curvature = chain.T @ self.seen @ chain + rows.T @ rows + np.diag(damping)
            pull = rows.T @ aims - chain.T @ (given + self.seen @ self.told(step)) - damping * step
            whole = bounded_step(curvature, pull, self.low - step, self.high - step)
            tried = ((found, cost(found)) for found in (step + s * whole for s in HALVED))
            found = next((one for one in tried if one[1] < least), None)
            if found is None:
                break
            settled = least - found[1] < 0.1 * SETTLED
            step, least = found
            if settled:
                break
        return step, first - least + float(step @ (damping * step))

    def told(self, step: Floats) -> Floats:
        """(p,) the step with which torques change in proportion."""
        change = step * self.scale
        for body in self.bodies:
            body.linearise(change, self.at, self.at + step * self.scale)
        return change / self.scale

    def told_by(self, step: Floats) -> Floats:
        """(p, p) its derivatives by the step."""
        found = np.diag(self.scale)
        for body in self.bodies:
            body.chain(found, self.at, self.at + step * self.scale)
        return found / self.scale[:, None]

    def moved_by(self, step: Floats) -> tuple[Fit, Floats, Floats]:
        """The fit a step away, the step as torques tell it, and (N,) the change that derivatives had not foretold."""
        step = np.clip(step, self.low, self.high)
        values = np.clip(self.at + step * self.scale, self.at + self.low * self.scale, self.at + self.high * self.scale)
        moved = self.told(step)
        named = {u.name: float(v) for u, v in zip(self.now.unknowns, values, strict=True)}
        tried = evaluate(self.now.compared, self.now.unknowns, named, self.now.memory)
        return tried, moved, tried.row - self.now.row - (moved * self.scale) @ self.J

    def along_valley(self, whole: Floats) -> Fit | None:
        """A better fit on a curved path, of which a whole step that leads uphill is the beginning; None without one.

        x(t) = t v + (t/h)² b: the change that a short step h v had not foretold grows with t², and b is the step that
        takes it back (Transtrum and Sethna 2012).
        """
        short, curvature = BENT[-1], self.information + np.diag(self.damping(0.0))
        tried, moved, missed = self.moved_by(short * whole)
        if not math.isfinite(tried.cost):
            return None
        bend = bounded_step(curvature, -self.A @ self.now.weighted(missed), self.low - moved, self.high - moved)
        for share in BENT:
            tried, *_ = self.moved_by(share * whole + (share / short) ** 2 * bend)
            if tried.cost < self.now.cost:
                return tried
        return None

    def correct(self, moved: Floats, missed: Floats) -> None:
        """Corrects the derivatives along a step, so that they foretell it (Broyden 1965)."""
        metric = np.diag(self.information) * moved
        if not (length := float(metric @ moved)) > 0.0:
            return
        metric, wrong = metric / length, self.now.weighted(missed)
        crossed = np.outer(self.A @ wrong, metric)
        self.seen = self.seen + crossed + crossed.T + float(wrong @ wrong) * np.outer(metric, metric)
        self.A = self.A + np.outer(metric, wrong)
        self.J = self.J + np.outer(metric / self.scale, missed)


def _step(now: Fit, J: Floats) -> tuple[Fit, Floats, bool]:
    """A step that descends, or the same fit; derivatives (p, N) corrected by what was tried; and whether they had said
    where it leads."""
    here = _Linearised(now, J)
    for number, (share, damping) in enumerate(ATTEMPTS):
        step, fall = here.best_step(damping)
        if share * fall < 0.5 * SETTLED:
            break
        step = share * step
        tried, moved, missed = here.moved_by(step)
        if not math.isfinite(tried.cost):
            continue
        wrong, whole = now.weighted(missed), now.weighted(tried.row - now.row)
        foretold = float(wrong @ wrong) <= FORETOLD**2 * float(whole @ whole)
        if tried.cost < now.cost and foretold:
            return tried, here.J, True
        if number == 0 and tried.cost >= now.cost and (better := here.along_valley(step)) is not None:
            return better, here.J, False
        here.correct(moved, missed)
        if tried.cost < now.cost:
            return tried, here.J, foretold
    return now, here.J, False


def standard_deviations(now: Fit) -> dict[str, float]:
    """Standard deviations, by name, of the unknowns that change the residual at all, for correlated residuals (White
    1980): none where no joint moves."""
    rows, samples = now.compared.told_slopes(now.values, now.unknowns), now.compared.samples
    slopes = {u.name: np.where(np.isfinite(row).all(), row, 0.0) for u, row in zip(now.unknowns, rows, strict=True)}
    used = [u for u in now.unknowns if np.abs(slopes[u.name]).max(initial=0.0) > 0]
    if not used:
        return {}
    scale = np.array([u.scale for u in used])
    single = np.ones(len(now.memory))
    J = np.stack([slopes[u.name] * u.scale for u in used])
    J, left = (now.compared.weighted(part, now.deviations, single) for part in (J, now.row))
    runs = [
        (part.T, own)
        for j in range(len(single))
        for part, own in zip(samples.split(J, j), samples.split(left, j), strict=True)
    ]
    information = J @ J.T
    prior = np.array([0.0 if u.deviation is None else (u.scale / u.deviation) ** 2 for u in used])
    loose = 1e-12 * max(float(np.trace(information)), 1.0)  # a direction without any information gets no interval
    scores = [part * own[:, None] for part, own in runs]
    covariance = sandwich(information + loose * np.eye(len(used)), scores, prior, LONGEST_MEMORY)
    return dict(zip([u.name for u in used], scale * np.sqrt(np.diag(covariance)), strict=True))


def found_values(
    now: Fit, parameters: Sequence[Parameter], bias: Mapping[str, float] | None = None
) -> dict[str, FoundValue]:
    """Estimates of an effect's parameters with 95 % intervals that hold for correlated residuals.

    bias: by name, how far an estimate may be off beside what noise does; its square is added to the variance.
    """
    deviations, result = now.standard_deviations, {}
    for p in parameters:
        value, deviation = now.values[p.name], deviations.get(p.name)
        if deviation is None or not np.isfinite(deviation):
            result[p.name] = FoundValue.of(p, value)
            continue
        half = INTERVAL * math.hypot(deviation, (bias or {}).get(p.name, 0.0))
        result[p.name] = FoundValue.of(p, value, max(value - half, p.low), min(value + half, p.high))
    return result
