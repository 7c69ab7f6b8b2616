"""Which experiment to make next: the one on which the remaining candidates would differ most, for its robot time.

Two candidates are as far apart as the one that is wrong would misfit a record of the other, after its parameters have
moved as far as the traces made so far and their priors allow: d′² = min over Δ of |δ − TΔ|² + Δᵀ S Δ, with δ the
difference of their readings in deviations of one reading, T the derivatives on the new experiment and S the information
there is already. Either may be the wrong one; the smaller of the two d′ counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, OfferedExperiment
from daq.contracts.trace import Trace
from model.discrepancy.candidates.decision import Decision
from model.discrepancy.candidates.ranking import Ranking, describe
from model.discrepancy.diagnosis import NextExperiment, Verdict
from model.discrepancy.experiment_design.reason import most_informative, separating
from model.discrepancy.experiment_design.signals import (
    Imagined,
    Planner,
    bounded,
    imagined,
    known_so_far,
    names_of,
    recorded,
    shown,
    tangents,
    values_of,
)
from model.discrepancy.output_error import search
from model.discrepancy.output_error.observation import Observation
from model.discrepancy.output_error.refitting import Refitted, judge, same_answer
from model.discrepancy.output_error.search import Point, with_new_tangents

Floats = NDArray[np.float64]
Pair = tuple[int, int]

LEAST = 3.0
"""Deviations below which a pair counts as not told apart: the evidence moves by 9, more than the margin of a name."""
SURE = 20.0
"""Margin of evidence below which a name is asked about as well."""
MOST_RIVALS = 4
"""The best of a group; every further one costs its simulations on every experiment."""
SETTLING = 5
"""Steps of a rival's fit at most, twice."""
ENOUGH = 10.0
"""Deviations beyond which more is of no use: a shorter experiment is better."""


@dataclass(frozen=True)
class Asked:
    """The experiment to make next, or None; `note` says why there is none, or what it will not tell apart."""

    experiment: NextExperiment | None
    note: str | None = None


@dataclass(frozen=True)
class Asker:
    """What may be asked for. budget: s of robot time that are left; None for no limit."""

    experiments: tuple[OfferedExperiment, ...]
    plan: Planner
    budget: float | None = None

    def after(
        self, verdict: Verdict, observation: Observation, current: Point, rivals: Sequence[Refitted],
        traces: Sequence[Trace],
    ) -> Asked:  # fmt: skip
        """What to make next: what separates the rivals of a name or a group; else what tells most of the arm."""
        if verdict in ("named", "ambiguous"):
            if not rivals:
                return Asked(None)
            ended = settled(observation, rivals)
            return best_experiment(ended, self.experiments, self.plan, self.budget) if len(ended) > 1 else Asked(None)
        done = [t.record.spec for t in traces if t.record.spec is not None]
        return most_information(current, self.experiments, self.plan, done, self.budget)


@dataclass(frozen=True)
class _Judged:
    """An experiment with its pairs' separations, and what of each difference could not be hidden, (N,)."""

    experiment: OfferedExperiment
    there: Imagined
    separations: dict[Pair, float]
    left: dict[Pair, Floats]


def rivals_of(ranking: Ranking, decision: Decision) -> tuple[Refitted, ...]:
    """Candidates of a turn that another experiment should tell apart: a group, and what comes close to a name."""
    best = decision.best
    if best is None or decision.kind == "nothing":
        return ()
    close = [
        f
        for f in ranking.fitted
        if f is not best and not same_answer(f, best) and best.evidence - f.evidence < SURE and f.evidence > 0
    ]
    return (best, *close) if close else ()


def settled(observation: Observation, rivals: Sequence[Refitted]) -> list[Refitted]:
    """Rivals with their fits taken to the end, from derivatives computed there: a difference that a fit would still
    take away separates nothing. A rival at the brink of instability, which has none, is left out."""
    found = []
    for rival in rivals[:MOST_RIVALS]:
        point = search.settled(observation, rival.judged.point, SETTLING)
        with suppress(SpecError):
            found.append(replace(rival, judged=judge(observation, with_new_tangents(observation, point))))
    return found


def best_experiment(
    rivals: Sequence[Refitted], experiments: Sequence[OfferedExperiment], plan: Planner, budget: float | None = None
) -> Asked:
    """The experiment on which the rivals that are hardest to tell apart differ most for its robot time; pairs that no
    experiment tells apart are named in the note."""
    names = [describe(r.candidate.name, r.candidate.joints) for r in rivals]
    points = [r.judged.point for r in rivals]
    judged = [j for e in experiments if (j := _judged(rivals, e, plan, budget)) is not None]
    if not judged:
        return Asked(None, f"no experiment within the limits{_within(budget)} is left that could tell {_or(names)}")
    pairs = list(combinations(range(len(rivals)), 2))
    best = {pair: max(j.separations[pair] for j in judged) for pair in pairs}
    hopeless = [pair for pair in pairs if best[pair] < LEAST]
    told = [pair for pair in pairs if pair not in hopeless]
    note = _hopeless(hopeless, best, names, budget)
    if not told:
        return Asked(None, note)
    chosen = max(judged, key=lambda j: _worth(min(j.separations[p] for p in told), j.there.duration))
    hardest = min(told, key=lambda p: chosen.separations[p])
    separation = chosen.separations[hardest]
    members = sorted({k for pair in told for k in pair})
    reason = separating(
        chosen.experiment.description, names[hardest[0]], names[hardest[1]], separation, points[hardest[0]].model,
        chosen.there.observation, chosen.left[hardest], rivals[hardest[0]].candidate.joints,
    )  # fmt: skip
    return Asked(_next(chosen.experiment, chosen.there, tuple(names[k] for k in members), separation, reason), note)


def most_information(
    point: Point, experiments: Sequence[OfferedExperiment], plan: Planner, done: Sequence[ExperimentSpec],
    budget: float | None = None,
) -> Asked:  # fmt: skip
    """Of the experiments for effects of every kind that were not made yet, the one that tells most of the arm; of the
    others, if those take too long. None when one of them was made."""
    if any(_same_motion(e.spec, s) for e in experiments if e.general for s in done):
        return Asked(None)
    new = [e for e in experiments if not any(_same_motion(e.spec, s) for s in done)]
    for general in (True, False):
        found = [j for e in new if e.general is general and (j := _information(point, e, plan, budget)) is not None]
        if found:
            experiment, there, nats = max(found, key=lambda f: f[2])
            return Asked(_next(experiment, there, (), 0.0, most_informative(experiment.description, nats)))
    return Asked(None)


def _judged(
    rivals: Sequence[Refitted], experiment: OfferedExperiment, plan: Planner, budget: float | None
) -> _Judged | None:
    points = [r.judged.point for r in rivals]
    there = _possible(points[0], experiment, plan, budget)
    if there is None:
        return None
    records = [recorded(there, p) for p in points]
    signals = [shown(own, p) for own, p in zip(records, points, strict=True)]
    if not all(np.isfinite(s).all() for s in signals):
        return None
    separations, left = {}, {}
    try:
        first = _named(records[0], points[0], tangents(records[0], points[0], {}))
        for a, b in combinations(range(len(rivals)), 2):
            sides = [_unhidden(records[true], rivals[wrong], signals[true], first) for wrong, true in ((a, b), (b, a))]
            separations[a, b], left[a, b] = min(sides, key=lambda side: side[0])
    except SpecError:
        return None
    return _Judged(experiment, there, separations, left)


def _named(there: Imagined, point: Point, derivatives: Floats) -> dict[str, Floats]:
    return dict(zip(names_of(there, point), derivatives, strict=True))


def _unhidden(there: Imagined, wrong: Refitted, target: Floats, known: dict[str, Floats]) -> tuple[float, Floats]:
    """d′ of a rival that is wrong from what the record's own model would show, and what of the difference is left once
    its parameters have moved. They move twice: what an effect does is not in proportion to its parameters.

    Raises SpecError when the simulation does not stay finite.
    """
    point, information = wrong.judged.point, known_so_far(there, wrong.judged.point)
    begun = values_of(there, point)
    derivatives = tangents(there, point, known)
    delta = target - shown(there, point)
    moved = begun + np.linalg.solve(information + derivatives @ derivatives.T, derivatives @ delta)
    moved = bounded(there, point, moved)
    own = {p.name for p in wrong.candidate.free}
    kept = {name: row for name, row in _named(there, point, derivatives).items() if name not in own}
    derivatives = tangents(there, point, kept, moved)
    delta, distance = target - shown(there, point, moved), moved - begun
    if not np.isfinite(delta).all():
        raise SpecError("the simulation does not stay finite: the loop is unstable")
    gradient = derivatives @ delta - information @ distance
    step = np.linalg.solve(information + derivatives @ derivatives.T, gradient)
    square = float(delta @ delta + distance @ information @ distance - gradient @ step)
    return float(np.sqrt(max(square, 0.0))), delta - step @ derivatives


def _information(
    point: Point, experiment: OfferedExperiment, plan: Planner, budget: float | None
) -> tuple[OfferedExperiment, Imagined, float] | None:
    there = _possible(point, experiment, plan, budget)
    if there is None:
        return None
    try:
        new = tangents(recorded(there, point), point, {})
    except SpecError:
        return None
    known = known_so_far(there, point)
    nats = 0.5 * (np.linalg.slogdet(known + new @ new.T)[1] - np.linalg.slogdet(known)[1])
    return experiment, there, float(nats)


def _possible(point: Point, experiment: OfferedExperiment, plan: Planner, budget: float | None) -> Imagined | None:
    there = imagined(point.model, experiment.spec, plan)
    return None if there is None or (budget is not None and there.duration > budget) else there


def _worth(separation: float, duration: float) -> tuple[bool, float]:
    """Experiments that tell come first; of them the one with the most separation, up to enough, a second."""
    return separation >= LEAST, min(separation, ENOUGH) ** 2 / duration


def _same_motion(one: ExperimentSpec, other: ExperimentSpec) -> bool:
    return (one.trajectory, one.joints, one.start) == (other.trajectory, other.joints, other.start)


def _next(
    experiment: OfferedExperiment, there: Imagined, separates: tuple[str, ...], separation: float, reason: str
) -> NextExperiment:
    return NextExperiment(
        name=experiment.name, spec=experiment.spec, duration=there.duration, separates=separates,
        predicted_separation=separation, reason=reason,
    )  # fmt: skip


def _hopeless(pairs: Sequence[Pair], best: dict[Pair, float], names: Sequence[str], budget: float | None) -> str | None:
    if not pairs:
        return None
    told = "; ".join(f"{names[a]} and {names[b]} ({best[a, b]:.1f} at most)" for a, b in pairs)
    return f"no experiment within the limits{_within(budget)} separates by {LEAST:g} standard deviations: {told}"


def _within(budget: float | None) -> str:
    return "" if budget is None else f" and {budget:.0f} s"


def _or(names: Sequence[str]) -> str:
    return " from ".join(names)
