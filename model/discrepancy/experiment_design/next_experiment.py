"""Which experiment to make next: the one on which the remaining candidates would differ most, for its robot time.

The distance of two candidates is how badly the wrong one would fit a record of the other, after its parameters have
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

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, OfferedExperiment
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.discrepancy.candidates.candidate_fit import CandidateFit, judge, same_answer
from model.discrepancy.candidates.decision import Decision
from model.discrepancy.candidates.ranking import Ranking
from model.discrepancy.diagnosis import UNWRITTEN, DifferencePlace, NextExperiment, Verdict
from model.discrepancy.experiment_design.prediction import Imagined, Planner, Prediction, imagine
from model.discrepancy.grounds import Note
from model.discrepancy.localisation.phases import PHASES, AskedMotion
from model.discrepancy.output_error.observation import Observation
from model.discrepancy.output_error.search import Point, converge
from model.effects.names import effect_on

Pair = tuple[int, int]

LEAST = 3.0
"""Separation of a pair, in deviations, that tells it apart: the evidence then moves by 9, more than the margin of a
name."""
SURE = 20.0
"""Margin of evidence below which an experiment is asked for although one effect was named."""
MOST_RIVALS = 4
"""Most rivals among which an experiment is to decide: each of them is simulated on every experiment."""
SETTLING = 5
"""Steps of each search that runs a rival's fit to convergence."""
ENOUGH = 10.0
"""Separation beyond which a shorter experiment is better than more separation, in deviations."""


@dataclass(frozen=True)
class Asked:
    """The experiment to make next, or None. note: why there is none, or which candidates it will not tell apart."""

    experiment: NextExperiment | None
    note: Note | None = None


@dataclass(frozen=True)
class ExperimentChooser:
    """The experiments that may be asked for. budget: s of robot time that are left; None for no limit."""

    experiments: tuple[OfferedExperiment, ...]
    plan: Planner
    budget: float | None = None

    def after(self, verdict: Verdict, current: Point, rivals: Sequence[CandidateFit], traces: Sequence[Trace]) -> Asked:
        """What to make next: what separates the rivals of a name or a group; else the most informative one."""
        if verdict in ("named", "ambiguous"):
            ended = converge_rivals(rivals)
            return best_experiment(ended, self) if len(ended) > 1 else Asked(None)
        done = [t.record.spec for t in traces if t.record.spec is not None]
        return most_information(current, self, done)

    def imagine(self, experiment: OfferedExperiment, point: Point) -> Imagined | None:
        """An experiment as a diagnosis would see it; None where it cannot be run or takes too long."""
        there = imagine(point.model, experiment.spec, self.plan)
        return None if there is None or (self.budget is not None and there.duration > self.budget) else there


@dataclass(frozen=True)
class _Separations:
    """An experiment with its pairs' separations, and the part of each difference that could not be hidden, (N,)."""

    experiment: OfferedExperiment
    there: Imagined
    sizes: dict[Pair, float]
    left: dict[Pair, Floats]


def rivals_of(ranking: Ranking, decision: Decision) -> tuple[CandidateFit, ...]:
    """Candidates that another experiment should tell apart: a group, and what comes close to a name."""
    best = decision.best
    if best is None or decision.kind == "nothing":
        return ()
    close = [
        f
        for f in ranking.fitted
        if f is not best and not same_answer(f, best) and best.evidence - f.evidence < SURE and f.evidence > 0
    ]
    return (best, *close) if close else ()


def converge_rivals(rivals: Sequence[CandidateFit]) -> list[CandidateFit]:
    """Rivals with their fits run to convergence and new derivatives: a difference that a fit would still remove
    separates nothing. A rival on the verge of instability has no derivatives and is left out."""
    found = []
    for rival in rivals[:MOST_RIVALS]:
        point = converge(rival.fit.point, SETTLING)
        with suppress(SpecError):
            found.append(replace(rival, fit=judge(point.with_new_tangents())))
    return found


def best_experiment(rivals: Sequence[CandidateFit], chooser: ExperimentChooser) -> Asked:
    """The experiment on which the rivals that are hardest to tell apart differ most for its robot time; pairs that no
    experiment tells apart are named in the note."""
    names = [effect_on(r.hypothesis.name, r.hypothesis.joints) for r in rivals]
    judged = [j for e in chooser.experiments if (j := _separations(rivals, e, chooser)) is not None]
    if not judged:
        return Asked(None, Note(kind="no-experiment-left", values={"candidates": names, "budget": chooser.budget}))
    pairs = list(combinations(range(len(rivals)), 2))
    best = {pair: max(j.sizes[pair] for j in judged) for pair in pairs}
    hopeless = [pair for pair in pairs if best[pair] < LEAST]
    separable = [pair for pair in pairs if pair not in hopeless]
    note = _hopeless(hopeless, best, names, chooser.budget)
    if not separable:
        return Asked(None, note)
    chosen = max(judged, key=lambda j: _worth(min(j.sizes[p] for p in separable), j.there.duration))
    hardest = min(separable, key=lambda p: chosen.sizes[p])
    separation = chosen.sizes[hardest]
    members = sorted({k for pair in separable for k in pair})
    place = _differs_at(rivals[hardest[0]], chosen.there.observation, chosen.left[hardest])
    asked = _next(chosen.experiment, chosen.there, tuple(names[k] for k in members), separation)
    hardest_names = (names[hardest[0]], names[hardest[1]])
    return Asked(asked.model_copy(update={"hardest": hardest_names, "differs_at": place}), note)


def most_information(point: Point, chooser: ExperimentChooser, done: Sequence[ExperimentSpec]) -> Asked:
    """Returns the most informative general experiment that was not made yet, or another one if all of those take too
    long. Returns none if a general experiment was made already."""
    if any(_same_motion(e.spec, s) for e in chooser.experiments if e.general for s in done):
        return Asked(None)
    new = [e for e in chooser.experiments if not any(_same_motion(e.spec, s) for s in done)]
    for general in (True, False):
        found = [j for e in new if e.general is general and (j := _information(point, e, chooser)) is not None]
        if found:
            experiment, there, nats = max(found, key=lambda f: f[2])
            return Asked(_next(experiment, there, (), 0.0).model_copy(update={"information": nats}))
    return Asked(None)


def _separations(
    rivals: Sequence[CandidateFit], experiment: OfferedExperiment, chooser: ExperimentChooser
) -> _Separations | None:
    points = [r.fit.point for r in rivals]
    there = chooser.imagine(experiment, points[0])
    if there is None:
        return None
    own = [Prediction(there, p).recorded() for p in points]
    signals = [prediction.shown() for prediction in own]
    if not all(np.isfinite(s).all() for s in signals):
        return None
    sizes, left = {}, {}
    try:
        first = own[0].named(own[0].tangents({}))
        for a, b in combinations(range(len(rivals)), 2):
            sides = [
                _unhidden(Prediction(own[true].there, points[wrong]), rivals[wrong], signals[true], first)
                for wrong, true in ((a, b), (b, a))
            ]
            sizes[a, b], left[a, b] = min(sides, key=lambda side: side[0])
    except SpecError:
        return None
    return _Separations(experiment, there, sizes, left)


def _unhidden(
    predicted: Prediction, wrong: CandidateFit, target: Floats, known: dict[str, Floats]
) -> tuple[float, Floats]:
    """d′ of a rival that is wrong from what the record's own model would show, and what of the difference is left once
    its parameters have moved. They move twice: what an effect does is not proportional to its parameters.

    Raises SpecError when the simulation does not stay finite.
    """
    information, begun = predicted.known_so_far(), predicted.begun.values
    derivatives = predicted.tangents(known)
    delta = target - predicted.shown()
    moved = begun + np.linalg.solve(information + derivatives @ derivatives.T, derivatives @ delta)
    moved = predicted.bounded(moved)
    own = {p.name for p in wrong.hypothesis.free}
    kept = {name: row for name, row in predicted.named(derivatives).items() if name not in own}
    derivatives = predicted.tangents(kept, moved)
    delta, distance = target - predicted.shown(moved), moved - begun
    if not np.isfinite(delta).all():
        raise SpecError("the simulation does not stay finite: the loop is unstable")
    gradient = derivatives @ delta - information @ distance
    step = np.linalg.solve(information + derivatives @ derivatives.T, gradient)
    square = float(delta @ delta + distance @ information @ distance - gradient @ step)
    return float(np.sqrt(max(square, 0.0))), delta - step @ derivatives


def _information(
    point: Point, experiment: OfferedExperiment, chooser: ExperimentChooser
) -> tuple[OfferedExperiment, Imagined, float] | None:
    """The experiment with the information that it would add about the arm's parameters, nats."""
    there = chooser.imagine(experiment, point)
    if there is None:
        return None
    try:
        new = Prediction(there, point).recorded().tangents({})
    except SpecError:
        return None
    known = Prediction(there, point).known_so_far()
    nats = 0.5 * (np.linalg.slogdet(known + new @ new.T)[1] - np.linalg.slogdet(known)[1])
    return experiment, there, float(nats)


def _worth(separation: float, duration: float) -> tuple[bool, float]:
    """The rank of an experiment: those that separate come first, then the most separation (up to `ENOUGH`) per
    second."""
    return separation >= LEAST, min(separation, ENOUGH) ** 2 / duration


def _same_motion(one: ExperimentSpec, other: ExperimentSpec) -> bool:
    return (one.trajectory, one.joints, one.start) == (other.trajectory, other.joints, other.start)


def _next(
    experiment: OfferedExperiment, there: Imagined, separates: tuple[str, ...], separation: float
) -> NextExperiment:
    return NextExperiment(
        name=experiment.name,
        spec=experiment.spec,
        duration=there.duration,
        separates=separates,
        predicted_separation=separation,
        reason=UNWRITTEN,
        description=experiment.description,
    )


def _hopeless(
    pairs: Sequence[Pair], best: dict[Pair, float], names: Sequence[str], budget: float | None
) -> Note | None:
    """The note on pairs that no experiment tells apart."""
    if not pairs:
        return None
    listed = [[names[a], names[b], best[a, b]] for a, b in pairs]
    return Note(kind="not-separable", values={"pairs": listed, "least": LEAST, "budget": budget})


def _differs_at(rival: CandidateFit, observation: Observation, left: Floats) -> DifferencePlace:
    """Joint and phase that hold most of the squared difference (N,) that a rival's parameters could not hide."""
    machine, joints = observation.machine, rival.hypothesis.joints
    record = observation.records[0]
    every = AskedMotion(machine, record).phases
    phases = np.concatenate([every[run] for run in record.runs])
    energy = left.reshape(phases.shape) ** 2
    total = max(float(energy.sum()), 1e-300)
    sums = {
        (joint, phase): float(energy[phases[:, column] == number, column].sum())
        for column, joint in enumerate(machine.modelled_joints)
        for number, phase in enumerate(PHASES)
    }
    (joint, phase), most = max(sums.items(), key=lambda item: item[1])
    return DifferencePlace(joint=joint, phase=phase, share=most / total, other_joint=tuple(joints) != (joint,))
