"""Computes which effects of the shared list an arm's records can distinguish from its hidden effect.

A rival is the arm without its effect, with another one. Its parameters and all tolerance parameters z (in their stated
deviations) are refitted by least squares to the readings of the true arm, in the mock's own plant, with the same noise:

    d′² = min over the rival's parameters and z of |y_rival(z) − y_true|² + |z|².

First the rival's parameters are searched from several starts with a linear response to z, then both together by
simulation. Every trial is an upper bound of d′. Below 5 the search ends, since the records do not distinguish them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mock_controller.board import default_board
from mock_controller.hidden.arm import HiddenArm
from mock_controller.hidden.closed_loop import LoopParts, reading_deviation, readings
from mock_controller.hidden.descent import Floats, Problem, descend, differences, square
from mock_controller.hidden.experiment import Experiment
from mock_controller.hidden.rivals import SEEN_IN_NUMBERS, Rival, rival_at
from mock_controller.hidden.separation import MODELLED, Tangents, move_parameters, step_length
from mock_controller.plant import default_plant

NOT_TOLD = 4.9
"""d′ below which a search ends, since the records do not distinguish (the threshold is 5)."""
_DECIDES = 30.0
"""d′ with linear tolerances above which they are not refitted by simulation."""
_MOSTLY_EXPLAINED = 0.2
"""Share of the difference below which tolerances explain most, and are refitted whatever remains."""
_BEGUN = 3
"""Number of starts that a search continues from."""
_SIZE_STEPS, _SIZE_RENEWALS = 12, 3
"""Steps, and recomputations of derivatives, of the search for a rival's parameters."""
_SAME = 0.05
"""Difference of coordinates below which two searches have the same end."""
_REFITTED = 2
"""Number of ends for which tolerances are refitted."""
_STEPS = 12
"""Steps of a refit of everything from one start."""
_AS_PREDICTED = 0.1
"""Share by which a refit may deviate from the prediction of linear tolerances for that to count as confirmed."""
_CLEAR = 10.0
"""d′ above which a prediction that one simulation confirms is not refined."""
_WORTH = 15.0
"""d′ below which all derivatives are recomputed once, which costs a simulation for each of 44 parameters."""
_STEP, _TOLERANCE_STEP = 0.02, 0.2
"""Steps of differences: in a rival's coordinates, and in deviations of the tolerances."""
_SEEN_WELL = 0.5
"""d′ at which the search for a rival's parameters ends."""
_FARTHEST = 1e4
"""Largest difference of a reading, in deviations; the difference of an unstable rival is limited to it."""


@dataclass(frozen=True)
class Told:
    """d′ of a rival at its joints, and the same with tolerances of linear effect."""

    effect: str
    joints: tuple[int, ...]
    d_prime: float
    linear: float


class Comparison:
    """The true arm of one hidden effect in some experiments, recorded together, for comparison with rivals.

    `known`: the tangents of each experiment, for the arm's load.
    """

    def __init__(self, arm: HiddenArm, experiments: Sequence[Experiment], known: Sequence[Tangents]) -> None:
        if len(arm.effects) != 1:
            raise ValueError(f"secret {arm.seed}: hides {len(arm.effects)} effects; rivals are those of one")
        self._hidden = arm.effects[0]
        self._experiments = tuple(experiments)
        first = known[0]
        self.known = Tangents(first.names, np.vstack([each.matrix for each in known]), first.deviations)
        self._true = arm.parts(default_plant(), default_board())
        self._sound = replace(self._true, modifications=())
        self._one = reading_deviation(self._true.board)
        self._kept: dict[tuple[str, int], Floats] = {}
        count = len(first.names)
        self._basis, self._triangle = np.linalg.qr(np.vstack([-self.known.matrix, np.eye(count)]))

    def rival(self, effect: str, joints: tuple[int, ...]) -> Told:
        """Returns d′ of a rival.

        If the controller's own values disprove the rival (or prove the hidden effect against it), or if the mock lacks
        it at these joints, it is no nearer than the healthy arm.
        """
        seen = {effect, self._hidden.name} & set(SEEN_IN_NUMBERS)
        found = None if seen else rival_at(effect, joints)
        least, linear = self._least(found)
        return Told(effect, joints, least, linear)

    def _least(self, rival: Rival | None) -> tuple[float, float]:
        """Returns the least d′ of a rival (None: of the healthy arm), and its value by linear tolerances."""
        step_us = step_length(self._true)
        if rival is not None:
            step_us = min(step_us, step_length(self._parts(rival, next(rival.starts()))))
        best, least = math.inf, math.inf
        for place in [np.zeros(0)] if rival is None else self._sought(rival, step_us):
            apart = self.apart(rival, place, step_us)
            linear = math.sqrt(square(self.less_tolerances(apart)))
            best = min(best, linear)
            if linear >= max(_DECIDES, _MOSTLY_EXPLAINED * math.sqrt(square(apart))):
                least = min(least, linear)
                continue
            least = min(least, _Refit(self, rival, place, step_us).least(linear))
            if least < NOT_TOLD:
                break
        return least, best

    def _sought(self, rival: Rival, step_us: int) -> list[Floats]:
        """Returns coordinates at which the rival is nearest with tolerances of linear effect, best first."""
        none = self.less_tolerances(self.apart(None, np.zeros(0), step_us))

        def left(place: Floats) -> Floats:
            return self.less_tolerances(self.apart(rival, place, step_us))

        low, high = rival.reach
        begun: list[tuple[float, Floats]] = []
        for start in rival.starts():
            response = left(start) - none
            if not response.any():
                begun.append((square(none), start))
                continue
            # Most laws are proportional to their size: a start is moved to the size that fits best.
            share = -float(response @ none) / square(response)
            moved = np.clip(np.where(rival.sizes, share * start, start), low, high)
            begun += [(square(none + response), start), (square(none) + share * float(response @ none), moved)]
        begun.sort(key=lambda each: each[0])
        problem = Problem(left, lambda at, there: differences(left, at, there, high, _STEP), low, high, _SEEN_WELL**2)
        ends: list[tuple[Floats, Floats]] = []
        for _, start in begun[:_BEGUN]:
            place, there = descend(problem, start, _SIZE_STEPS, _SIZE_RENEWALS)
            if all(np.max(np.abs(place - other)) > _SAME for other, _ in ends):
                ends.append((place, there))
        ends.sort(key=lambda end: square(end[1]))
        return [place for place, _ in ends[:_REFITTED]]

    def less_tolerances(self, apart: Floats) -> Floats:
        """Returns the part of a difference that the tolerances cannot remove, with their cost."""
        both = np.concatenate([apart, np.zeros(len(self.known.names))])
        return np.asarray(both - self._basis @ (self._basis.T @ both))

    def answer(self, apart: Floats) -> Floats:
        """Returns the tolerances (deviations) that remove most of a difference, if their effect is linear."""
        both = np.concatenate([apart, np.zeros(len(self.known.names))])
        return np.asarray(-np.linalg.solve(self._triangle, self._basis.T @ both), dtype=np.float64)

    def _parts(self, rival: Rival | None, place: Floats) -> LoopParts:
        return self._sound if rival is None else replace(self._sound, modifications=rival.modifications(place))

    def apart(self, rival: Rival | None, place: Floats, step_us: int, moved: Floats | None = None) -> Floats:
        """Returns readings of the true arm − those of a rival, in their deviations (periods·3 of all experiments)."""
        key = ("true", step_us)
        if key not in self._kept:
            self._kept[key] = self._readings(self._true, step_us)
        try:
            parts = self._parts(rival, place)
            rest = np.zeros(len(self.known.names))
            if moved is not None:
                parts, rest = move_parameters(parts, self.known, moved, step_us)
            apart = self._kept[key] - self._readings(parts, step_us) - self.known.matrix @ rest
        except (ValueError, ArithmeticError):  # the rival's arm is impossible
            apart = np.full(self._kept[key].size, _FARTHEST)
        return np.clip(np.nan_to_num(apart, nan=_FARTHEST), -_FARTHEST, _FARTHEST)

    def _readings(self, parts: LoopParts, step_us: int) -> Floats:
        rows = [readings(parts, experiment, step_us=step_us)[:, :MODELLED] for experiment in self._experiments]
        return np.asarray(np.concatenate(rows).ravel() / self._one)


class _Refit:
    """The refit of a rival's parameters and of the tolerances by simulation, started at one point."""

    def __init__(self, compared: Comparison, rival: Rival | None, place: Floats, step_us: int) -> None:
        self._compared, self._rival, self._place, self._step_us = compared, rival, place, step_us
        self._count, self._names = place.size, len(compared.known.names)
        low, high = (place, place) if rival is None else rival.reach
        reach = [compared.known.within_reach(np.full(self._names, sign * math.inf)) for sign in (-1.0, 1.0)]
        self._low, self._high = np.concatenate([low, reach[0]]), np.concatenate([high, reach[1]])

    def least(self, linear: float) -> float:
        """Returns the least d′, starting with the tolerances of the linear estimate and with none; `linear`: d′ of that
        estimate.
        """
        problem = Problem(self._left, self._slopes, self._low, self._high, NOT_TOLD**2)
        answer = self._compared.answer(self._compared.apart(self._rival, self._place, self._step_us))
        best, least = np.zeros(0), math.inf
        for moved in (answer, np.zeros(self._names)):
            start = np.clip(np.concatenate([self._place, moved]), self._low, self._high)
            looked = math.sqrt(square(self._left(start)))
            if linear > _CLEAR and abs(looked - linear) < _AS_PREDICTED * linear:
                return looked
            at, there = descend(problem, start, _STEPS, 0, self._first_slopes(start))
            if (d_prime := math.sqrt(square(there))) < least:
                best, least = at, d_prime
            if least < NOT_TOLD or abs(least - linear) < _AS_PREDICTED * linear:
                return least
        if least < _WORTH:
            _, there = descend(problem, best, _STEPS, 0)
            least = min(least, math.sqrt(square(there)))
        return least

    def _left(self, both: Floats) -> Floats:
        moved = both[self._count :]
        apart = self._compared.apart(self._rival, both[: self._count], self._step_us, moved)
        return np.concatenate([apart, moved])

    def _first_slopes(self, at: Floats) -> Floats:
        """Returns derivatives by the rival's parameters, and the tangents of the tolerances."""
        ahead, high = at[self._count :], self._high[: self._count]
        own = differences(
            lambda place: self._left(np.concatenate([place, ahead])), at[: self._count], self._left(at), high, _STEP
        )
        return np.hstack([own, np.vstack([-self._compared.known.matrix, np.eye(self._names)])])

    def _slopes(self, at: Floats, left: Floats) -> Floats:
        """Returns all derivatives by simulation."""
        units = np.concatenate([np.ones(self._count), np.full(self._names, _TOLERANCE_STEP / _STEP)])
        found = differences(lambda steps: self._left(steps * units), at / units, left, self._high / units, _STEP)
        return np.asarray(found / units)
