"""The search for a free motion on which rivals differ most for its robot time.

Motions are drawn at random, the best of them are changed at random, and what is better is kept. Every motion is planned
and checked as `daq run` does it, and an arm like any of the rivals must follow it with a margin; then it is judged by
the separations that it promises, as a preset is. The same rivals and seed give the same motions. A search among
many finds those whose promise is too high, too, so the best ones are judged once more with another noise.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from daq.contracts.experiment import OfferedExperiment
from daq.contracts.progress import Cancel, stop_if
from model.design.information import falls_behind
from model.discrepancy.candidates.candidate_fit import CandidateFit
from model.discrepancy.experiment_design.drawn_motions import Drawer
from model.discrepancy.experiment_design.motions import Motion, can_be_designed, spec_of, words_of_motion
from model.discrepancy.experiment_design.prediction import NOISE_SEED, Imaginer, Prediction
from model.discrepancy.experiment_design.separation import LEAST, Pair, Separations, recorded_by, separations

NAME = "designed"
OTHER_NOISE = 3
"""Seed of the readings' noise with which the best motions are judged once more."""
CONFIRMED = 2
"""Motions that are judged once more."""
EXTRA_TIME = 1.0
"""Time (s) of an experiment that is neither in its blocks nor in its moves, at most."""


@dataclass(frozen=True)
class MotionSearch:
    """How much to search: motions `drawn` at random, and `changed` afterwards, the best few `kept` as their parents."""

    drawn: int = 16
    changed: int = 24
    kept: int = 4
    seed: int = 1


@dataclass(frozen=True)
class _Judged:
    motion: Motion
    found: Separations
    rank: tuple[float, ...]


def designed_motions(
    rivals: Sequence[CandidateFit],
    pairs: Sequence[Pair],
    imagine: Imaginer,
    search: MotionSearch,
    longest: float,
    cancel: Cancel,
) -> tuple[list[Separations], int]:
    """The best motion that was found for some pairs of rivals, and how many were judged. None is found where no motion
    is within the limits.

    Args:
        longest: s of robot time that it may take, with its moves there and back.

    Raises CancelledError when asked to end.
    """
    machine = rivals[0].fit.point.model.machine
    if not can_be_designed(machine):
        return [], 0
    judge = _Judge(rivals, pairs, imagine, longest + EXTRA_TIME)
    drawer = Drawer(np.random.default_rng([search.seed, len(pairs)]), machine, longest)
    kept: list[_Judged] = []
    count = 0
    for number, motion in enumerate(_candidates(drawer, search, kept)):
        stop_if(cancel)
        judged = judge.judged(motion, f"{NAME}-{search.seed}-{number}")
        count += judged is not None
        if judged is not None:
            kept[:] = sorted([*kept, judged], key=lambda j: j.rank, reverse=True)[: search.kept]
    confirmed = [sure for best in kept[:CONFIRMED] if (sure := judge.confirmed(best)) is not None]
    return sorted(confirmed, key=lambda s: _rank(s, pairs), reverse=True)[:1], count


@dataclass(frozen=True)
class _Judge:
    """Judges motions by the separations of rivals, for some pairs of them. longest: s."""

    rivals: Sequence[CandidateFit]
    pairs: Sequence[Pair]
    imagine: Imaginer
    longest: float

    def judged(self, motion: Motion, name: str, noise_seed: int = NOISE_SEED) -> _Judged | None:
        """A motion with its separations; None where it cannot be run, or an arm like a rival would not follow it."""
        machine = self.rivals[0].fit.point.model.machine
        spec = spec_of(motion, machine, name)
        offered = OfferedExperiment(name, words_of_motion(motion, machine), spec)
        there = self.imagine(offered, self.rivals[0].fit.point, noise_seed)
        if there is None or there.duration > self.longest:
            return None
        own = recorded_by(self.rivals, there)
        if not all(_is_followed(p) for p in own):
            return None
        found = separations(self.rivals, offered, own)
        return None if found is None else _Judged(motion, found, _rank(found, self.pairs))

    def confirmed(self, best: _Judged) -> Separations | None:
        """The smaller separations of two noises; None where the motion cannot be run with the other one."""
        again = self.judged(best.motion, best.found.experiment.name, OTHER_NOISE)
        if again is None:
            return None
        sizes = {pair: min(size, again.found.sizes[pair]) for pair, size in best.found.sizes.items()}
        return replace(best.found, sizes=sizes)


def _candidates(drawer: Drawer, search: MotionSearch, kept: Sequence[_Judged]) -> Iterator[Motion]:
    """Motions to judge, one after the other; what is `kept` so far are the parents of the later ones."""
    first = drawer.first()
    yield from first
    for _ in range(search.drawn - len(first)):
        yield drawer.drawn()
    for _ in range(search.changed):
        if not kept:
            return
        parent = kept[min(int(drawer.rng.exponential(1.0)), len(kept) - 1)]
        yield drawer.changed(parent.motion, [k.motion for k in kept])


def _rank(found: Separations, pairs: Sequence[Pair]) -> tuple[float, ...]:
    """What is better is larger: more pairs told apart, then the least separation of these for its robot time, then the
    least of the others."""
    apart = [p for p in pairs if found.sizes[p] >= LEAST]
    together = [p for p in pairs if found.sizes[p] < LEAST]
    worth = found.worth(apart)[1] if apart else 0.0
    return float(len(apart)), worth, found.least(together) if together else 0.0


def _is_followed(predicted: Prediction) -> bool:
    """Whether set points would not pause on an arm like a rival, which has made the record: a margin is kept."""
    record = predicted.there.observation.records[0]
    set_points = record.inputs.set_points
    return falls_behind(predicted.point.model.machine, set_points, set_points - record.measured) is None
