"""Which experiment to make next: the one on which the remaining candidates would differ most, for its robot time.

It is a preset, or the best of experiments that were drawn at random. Candidates that no motion tells apart are answered
as one class of effects, with the measurement that would tell them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, OfferedExperiment
from daq.contracts.progress import Cancel, Never, stop_if
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.design.drawn_experiments import CALLED, drawn_experiment
from model.design.information import Planner
from model.discrepancy.diagnosis import UNWRITTEN, DifferencePlace, Inseparable, NextExperiment, PlacedEffect, Verdict
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.fitting import Fit
from model.discrepancy.experiment_design.separation import (
    NOISE_SEED,
    Imagined,
    Pair,
    Prediction,
    Separations,
    imagine,
    recorded_by,
    separations,
)
from model.discrepancy.explanation.effect_words import LAWS, MEASUREMENTS
from model.discrepancy.grounds import Measurement, Note, SharedLaw
from model.discrepancy.localisation.phases import PHASES, AskedMotion
from model.discrepancy.readings.observation import Observation
from model.discrepancy.thresholds import WITHIN_NOISE
from model.effects.names import effect_on


def classes_of(
    rivals: Sequence[PlacedEffect], hopeless: Mapping[Pair, tuple[float, str]], tried: int
) -> tuple[Inseparable, ...]:
    """Classes of rivals of which no two are told apart.

    Args:
        hopeless: pairs that nothing told apart, with the largest separation and the experiment that gives it.
        tried: experiments judged.
    """
    found = []
    for group in _cliques(hopeless):
        members = tuple(rivals[k] for k in group)
        separation, experiment = max(hopeless[p] for p in hopeless if set(p) <= set(group))
        shares = shared_law(members)
        found.append(
            Inseparable(
                members=members,
                separation=separation,
                needed=WITHIN_NOISE,
                experiment=experiment,
                tried=tried,
                shares=shares,
                told_by=() if shares is None else measurements(shares, members),
            )
        )
    return tuple(found)


def shared_law(members: Sequence[PlacedEffect]) -> SharedLaw | None:
    """The narrowest law of the table that all these effects have in common; None where there is none."""
    effects, places = {m.effect for m in members}, {m.joints for m in members}
    for name, law in LAWS.items():
        if effects <= set(law.effects) and len(effects) > 1 and (not law.one_joint or len(places) == 1):
            return name
    return None


def measurements(law: SharedLaw, members: Sequence[PlacedEffect]) -> tuple[Measurement, ...]:
    """The measurements that tell these effects, which have a law in common."""
    effects = {m.effect for m in members}
    return tuple(m for m in LAWS[law].told_by if effects & set(MEASUREMENTS[m].shows))


def notes_on(classes: Sequence[Inseparable], budget: float | None) -> tuple[Note, ...]:
    """Notes on classes: one for each that has a name, and one for all pairs of the others. budget: s of robot time."""
    named = tuple(
        Note(kind="one-class", values=c.model_dump(mode="json") | {"budget": budget})
        for c in classes
        if c.shares is not None
    )
    pairs = [
        [*(effect_on(m.effect, m.joints) for m in pair), c.separation]
        for c in classes
        if c.shares is None
        for pair in combinations(c.members, 2)
    ]
    if not pairs:
        return named
    return (*named, Note(kind="not-separable", values={"pairs": pairs, "least": WITHIN_NOISE, "budget": budget}))


def _cliques(pairs: Mapping[Pair, object]) -> list[tuple[int, ...]]:
    """Groups, as large as may be, of which every two are one of the pairs."""
    found: list[set[int]] = []
    for pair in pairs:
        if any(set(pair) <= group for group in found):
            continue
        group = set(pair)
        for other in sorted({k for p in pairs for k in p}):
            if all((min(k, other), max(k, other)) in pairs for k in group if k != other):
                group.add(other)
        found.append(group)
    return [tuple(sorted(group)) for group in found]


SURE = 20.0
"""Margin of evidence below which an experiment is asked for although one effect was named."""
MOST_RIVALS = 4
"""Most rivals among which an experiment is to decide: each of them is simulated on every experiment."""
LONGEST_DESIGN = 20.0
"""Longest designed motion, s of robot time."""
DURATIONS = (0.1, 0.2, 0.4, 0.8)
"""Durations of drawn experiments, as shares of the longest."""
SEED = 1
"""Seed of the draws."""
OTHER_NOISE = 3
"""Seed of the readings' noise with which the best draws are judged once more: among many, some promise too much."""


@dataclass(frozen=True)
class Asked:
    """The experiment to make next, or None. notes: why there is none, or which candidates it will not tell apart.
    inseparable: what no experiment tells apart."""

    experiment: NextExperiment | None
    notes: tuple[Note, ...] = ()
    inseparable: tuple[Inseparable, ...] = ()


@dataclass(frozen=True)
class ExperimentChooser:
    """The experiments that may be asked for. budget: s of robot time that are left; None for no limit. search: how many
    experiments are drawn at random for each question, too; None for none."""

    experiments: tuple[OfferedExperiment, ...]
    plan: Planner
    budget: float | None = None
    search: int | None = None

    def after(
        self,
        verdict: Verdict,
        current: Fit,
        rivals: Sequence[Fitted],
        traces: Sequence[Trace],
        cancel: Cancel | None = None,
    ) -> Asked:
        """What to make next: what separates the rivals of a name or a group; else the most informative one. Raises
        CancelledError when asked to end."""
        if verdict in ("named", "ambiguous", "partly"):
            ended = converge_rivals(rivals)
            return best_experiment(ended, self, cancel) if len(ended) > 1 else Asked(None)
        done = [t.record.spec for t in traces if t.record.spec is not None]
        return most_information(current, self, done)

    def imagine(self, experiment: OfferedExperiment, point: Fit, noise_seed: int = NOISE_SEED) -> Imagined | None:
        """An experiment as a diagnosis would see it; None where it cannot be run or takes too long."""
        there = imagine(point.fitted_model, experiment.spec, self.plan, noise_seed)
        return None if there is None or (self.budget is not None and there.duration > self.budget) else there


def converge_rivals(rivals: Sequence[Fitted]) -> list[Fitted]:
    """The first of several candidates and those that come close to it, with new derivatives."""
    close = [r for r in rivals[1:] if rivals[0].log_odds - r.log_odds < SURE and r.evidence > 0]
    found = [*rivals[:1], *close][:MOST_RIVALS]
    return [replace(r, fit=replace(r.fit, known={}).with_slopes()) for r in found]


def best_experiment(rivals: Sequence[Fitted], chooser: ExperimentChooser, cancel: Cancel | None = None) -> Asked:
    """The experiment on which the rivals that are hardest to tell apart differ most for its robot time; pairs that no
    experiment tells apart are named in notes. Raises CancelledError when asked to end."""
    names = [effect_on(r.effect, r.joints) for r in rivals]
    pairs = list(combinations(range(len(rivals)), 2))
    judged, tried = judge_experiments(rivals, chooser, pairs, cancel or Never())
    if not judged:
        return Asked(None, (Note(kind="no-experiment-left", values={"candidates": names, "budget": chooser.budget}),))
    best = {pair: max(judged, key=lambda j: j.sizes[pair]) for pair in pairs}
    hopeless = {p: (j.sizes[p], j.experiment.name) for p, j in best.items() if j.sizes[p] < WITHIN_NOISE}
    separable = [pair for pair in pairs if pair not in hopeless]
    placed = [PlacedEffect(effect=r.effect, joints=r.joints) for r in rivals]
    inseparable = classes_of(placed, hopeless, tried)
    notes = notes_on(inseparable, chooser.budget)
    if not separable:
        return Asked(None, notes, inseparable)
    chosen = max(judged, key=lambda j: j.worth(separable))
    hardest = min(separable, key=lambda p: chosen.sizes[p])
    separation = chosen.sizes[hardest]
    members = sorted({k for pair in separable for k in pair})
    place = _differs_at(rivals[hardest[0]], chosen.there.observation, chosen.left[hardest])
    asked = _next(chosen.experiment, chosen.there, tuple(names[k] for k in members), separation)
    hardest_names = (names[hardest[0]], names[hardest[1]])
    return Asked(asked.model_copy(update={"hardest": hardest_names, "differs_at": place}), notes, inseparable)


def judge_experiments(
    rivals: Sequence[Fitted], chooser: ExperimentChooser, pairs: Sequence[Pair], cancel: Cancel
) -> tuple[list[Separations], int]:
    """The experiments of the chooser that can be run, and the best of those that were drawn, with their separations;
    and how many were judged. Raises CancelledError when asked to end."""

    def judged(experiment: OfferedExperiment, noise_seed: int = NOISE_SEED) -> Separations | None:
        """None where it cannot be run, or an arm like a rival would not follow what was drawn."""
        stop_if(cancel)
        there = chooser.imagine(experiment, rivals[0].fit, noise_seed)
        if there is None:
            return None
        own = recorded_by(rivals, there)
        is_drawn = experiment not in chooser.experiments
        return None if is_drawn and not all(p.is_followed for p in own) else separations(rivals, experiment, own)

    offered = [found for one in chooser.experiments if (found := judged(one)) is not None]
    drawn = [found for one in _drawn(rivals, chooser) if (found := judged(one)) is not None]
    tried = len(offered) + len(drawn)
    for wanted in (pairs, *([pair] for pair in pairs)) if drawn else ():
        best = max(drawn, key=lambda one: one.worth(wanted))
        again = judged(best.experiment, OTHER_NOISE)
        if again is not None and all(best.experiment != one.experiment for one in offered):
            sizes = {pair: min(size, again.sizes[pair]) for pair, size in best.sizes.items()}
            offered.append(replace(best, sizes=sizes))
    return offered, tried


def _drawn(rivals: Sequence[Fitted], chooser: ExperimentChooser) -> Iterator[OfferedExperiment]:
    machine = rivals[0].fit.model.machine
    longest = min(LONGEST_DESIGN, chooser.budget or LONGEST_DESIGN)
    for number in range(chooser.search or 0):
        kind, turn = number % len(CALLED), number // len(CALLED)
        duration = longest * DURATIONS[turn % len(DURATIONS)]
        spec = drawn_experiment(machine, number, duration, SEED).model_copy(update={"name": f"designed-{number}"})
        yield OfferedExperiment(f"designed-{number}", f"{CALLED[kind]} that were drawn for these candidates", spec)


def most_information(point: Fit, chooser: ExperimentChooser, done: Sequence[ExperimentSpec]) -> Asked:
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


def _information(
    point: Fit, experiment: OfferedExperiment, chooser: ExperimentChooser
) -> tuple[OfferedExperiment, Imagined, float] | None:
    """The experiment with the information that it would add about the arm's parameters, nats."""
    there = chooser.imagine(experiment, point)
    if there is None:
        return None
    try:
        new = np.stack(list(Prediction(there, point).recorded().tangents({}).values()))
    except SpecError:
        return None
    known = Prediction(there, point).known_so_far()
    nats = 0.5 * (np.linalg.slogdet(known + new @ new.T)[1] - np.linalg.slogdet(known)[1])
    return experiment, there, float(nats)


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


def _differs_at(rival: Fitted, observation: Observation, left: Floats) -> DifferencePlace:
    """Joint and phase that hold most of the squared difference (N,) that a rival's parameters could not hide."""
    machine, joints = observation.machine, rival.joints
    record = observation.records[0]
    every = AskedMotion(machine, record).phases
    phases = np.concatenate([every[run] for run in record.runs])
    energy = left.reshape(phases.shape[::-1]).T ** 2
    total = max(float(energy.sum()), 1e-300)
    sums = {
        (joint, phase): float(energy[phases[:, column] == number, column].sum())
        for column, joint in enumerate(machine.modelled_joints)
        for number, phase in enumerate(PHASES)
    }
    (joint, phase), most = max(sums.items(), key=lambda item: item[1])
    return DifferencePlace(joint=joint, phase=phase, share=most / total, other_joint=tuple(joints) != (joint,))
