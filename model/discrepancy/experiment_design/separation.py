"""How far apart candidates would be on an experiment that has not been made.

The distance of two candidates is how badly the wrong one would fit a record of the other, after its parameters have
moved as far as the traces made so far and their priors allow: d′² = min over Δ of |δ − TΔ|² + Δᵀ S Δ, with δ the
difference of their readings in deviations of one reading, T the derivatives on the new experiment and S the information
there is already. Either may be the wrong one; the smaller of the two d′ counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.experiment import OfferedExperiment
from model.arrays import Floats
from model.discrepancy.candidates.candidate_fit import CandidateFit
from model.discrepancy.experiment_design.prediction import Imagined, Prediction

Pair = tuple[int, int]
"""Two rivals, by their places in a list, the first place first."""

LEAST = 3.0
"""Separation of a pair, in deviations, that tells it apart: the evidence then moves by 9, more than the margin of a
name."""
ENOUGH = 10.0
"""Separation beyond which a shorter experiment is better than more separation, in deviations."""


@dataclass(frozen=True)
class Separations:
    """An experiment with its pairs' separations, and the part of each difference that could not be hidden, (N,)."""

    experiment: OfferedExperiment
    there: Imagined
    sizes: dict[Pair, float]
    left: dict[Pair, Floats]

    def least(self, pairs: Sequence[Pair]) -> float:
        """The separation of that one of some pairs which is hardest to tell apart."""
        return min(self.sizes[p] for p in pairs)

    def worth(self, pairs: Sequence[Pair]) -> tuple[bool, float]:
        """Its rank for some pairs: experiments that separate them come first, then the most separation (up to `ENOUGH`)
        per second."""
        separation = self.least(pairs)
        return separation >= LEAST, min(separation, ENOUGH) ** 2 / self.there.duration


def recorded_by(rivals: Sequence[CandidateFit], there: Imagined) -> list[Prediction]:
    """The rivals on the records that arms like them would leave of an experiment."""
    return [Prediction(there, r.fit.point).recorded() for r in rivals]


def separations(
    rivals: Sequence[CandidateFit], experiment: OfferedExperiment, own: Sequence[Prediction]
) -> Separations | None:
    """How far apart the rivals would be on an experiment; None where a simulation does not stay finite.

    Args:
        own: each rival on the record that an arm like it would leave.
    """
    points = [r.fit.point for r in rivals]
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
    return Separations(experiment, own[0].there, sizes, left)


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
