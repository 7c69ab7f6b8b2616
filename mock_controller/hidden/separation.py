"""d′: how far the readings of an arm with a hidden effect are from those that a sound arm could give.

Run the arm with and without its effects, with the same noise. Their difference y, in standard deviations of a reading,
is what an observer sees who knows the arm without them. An observer who does not may adjust the tolerance parameters z
(in their standard deviations) at the cost of their prior. With J = ∂y/∂z there remains

    d′² = min_z |y − J z|² + |z|²  =  yᵀ (I + J Jᵀ)⁻¹ y.

J is taken at the data file's arm by finite differences of this very plant; potentiometer curves are among the z.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mock_controller.board.parameters import BoardParameters
from mock_controller.hidden.experiment import Experiment, LoopParts, reading_deviation, readings
from mock_controller.hidden.imitation import imitation
from mock_controller.hidden.tolerances import (
    HARMONICS,
    LinearityHarmonic,
    deviating_board,
    deviating_plant,
    harmonic_deviation,
    tolerances,
)
from mock_controller.modification import Modification, of_kind
from mock_controller.modifications.controller import InputDelay
from mock_controller.plant import STEP_US, PlantParameters
from mock_controller.plant.extension_points import ChangesTransmission

MODELLED = 3
"""Number of joints whose readings are compared; the others are held."""
_COARSE_STEP_US = 2000
"""Step (µs) of the plant where four digits of a difference suffice; it halves the time."""
_TANGENT_STEP_US = _COARSE_STEP_US
_LARGEST_STEP = 0.1
"""Largest fraction by which a constant is changed for a finite difference; wide priors are extrapolated."""
_DELAY_STEP_S = 2e-3
"""Change (s) of the computing delay for a finite difference: a step of the plant."""


MOST_REFITS = 8
"""Most simulations of a refit; each runs the experiment once."""
_FIRST_DAMPING, _LESS_DAMPING, _MORE_DAMPING = 1000.0, 10.0, 4.0
"""Initial damping of the refit (in units of the priors' weight), and its factors after success and failure."""
_NEAR_DAMPING = 1.0
"""Initial damping of a refit that starts from the tangents' solution."""
_CLEAR = 15.0
"""d′ far above the threshold of detectability, where the tangents' estimate (exact to about a third) is enough."""
_MOSTLY_EXPLAINED = 0.2
"""Share of the difference: where the tangents leave less than this, their solution is checked by a simulation."""
_SMALL_MOVE = 0.5
"""Largest move (standard deviations) for which the tangents are trusted without a simulation."""
_SETTLED = 0.95
"""The refit stops after a step that leaves more than this share of the cost."""
_AS_PREDICTED = 0.03
"""Relative deviation of d′ from the tangents' prediction below which they are confirmed and the refit stops."""
_LEAST_FRACTION, _MOST_FRACTION = -0.9, 5.0
"""Bounds of a constant's change, as fractions of its value."""
_WHOLE_S = 5e-5
"""Distance (s) from whole steps within which a computing delay is rounded; the remainder goes along its tangent."""
_EARLIEST_S = 5e-3
"""Largest reduction (s) of the computing delay, so that it stays positive."""


@dataclass(frozen=True)
class Tangents:
    """∂ readings/∂ tolerance parameter, in reading deviations per standard deviation; `matrix` (periods·3, names).

    `deviations` are the standard deviations: fractions, seconds for the delay, counts for the potentiometers' curves.
    """

    names: tuple[str, ...]
    matrix: NDArray[np.float64]
    deviations: NDArray[np.float64]

    def within_reach(self, moved: NDArray[np.float64]) -> NDArray[np.float64]:
        """Returns `moved` (standard deviations), clipped to the bounds of each constant."""
        low, high = zip(*(_reach(name) for name in self.names), strict=True)
        return np.minimum(np.maximum(moved, np.array(low) / self.deviations), np.array(high) / self.deviations)


def _reach(name: str) -> tuple[float, float]:
    """Bounds of a tolerance parameter's change: fractions or seconds; none for counts of a sensor's curve."""
    known = next((tolerance for tolerance in tolerances() if tolerance.name == name), None)
    if known is None:
        return -math.inf, math.inf
    return (-_EARLIEST_S, _EARLIEST_S) if known.is_time else (_LEAST_FRACTION, _MOST_FRACTION)


@dataclass(frozen=True)
class Separation:
    """Detectability of an effect: d′, its value before any refit, and the refit's move of each parameter (in σ)."""

    d_prime: float
    before_refit: float
    moved: dict[str, float]


@dataclass(frozen=True)
class _Direction:
    """One tolerance parameter: its name and standard deviation, the same in steps, and the arm one step away."""

    name: str
    deviation: float
    steps: float
    parts: LoopParts


def tangents(
    plant: PlantParameters,
    board: BoardParameters,
    experiment: Experiment,
    cache: Path | None = None,
) -> Tangents:
    """Returns tangents at the arm of the data files; with `cache`, a folder, read from there if present."""
    kept = None if cache is None else cache / f"tangents-{_key(plant, board, experiment)}.npz"
    if kept is not None and kept.exists():
        with np.load(kept) as stored:
            return Tangents(tuple(str(name) for name in stored["names"]), stored["matrix"], stored["deviations"])
    directions = _directions(plant, board)
    base = LoopParts(plant, replace(board, linearity=0.0), (), 0)
    rows = [_row(experiment, parts) for parts in (base, *(direction.parts for direction in directions))]
    one = reading_deviation(board)
    columns = [direction.steps * (row - rows[0]) / one for direction, row in zip(directions, rows[1:], strict=True)]
    found = Tangents(
        tuple(direction.name for direction in directions),
        np.stack(columns, axis=1),
        np.array([direction.deviation for direction in directions]),
    )
    if kept is not None:
        kept.parent.mkdir(parents=True, exist_ok=True)
        # Written under another name and renamed: another process may read the file at any time.
        aside = kept.with_suffix(f".{os.getpid()}.npz")
        np.savez(aside, names=np.array(found.names), matrix=found.matrix, deviations=found.deviations)
        aside.replace(kept)
    return found


def separation(
    parts: LoopParts,
    experiment: Experiment,
    known: Tangents,
    without: tuple[Modification, ...] = (),
    refits: int = MOST_REFITS,
    present: NDArray[np.float64] | None = None,
) -> Separation:
    """Returns d′ between `parts` and the same arm with only the modifications `without` (by default none).

    `present`: the result of `modelled_readings` for these parts, if it is known.

    The refit takes a step along the tangents and simulates the result. It ends there if the remainder is as they
    predicted, or if d′ is clearly large. Otherwise it continues, up to `refits` times, because a strong effect that
    tolerances can imitate has its optimum far from where the tangents were taken. If deviations are known that imitate
    the effect, exactly or nearly, the refit starts from those.
    """
    one = reading_deviation(parts.board)
    step_us = step_length(parts)
    present = modelled_readings(parts, experiment) if present is None else present
    sound = replace(parts, modifications=without)

    def left_at(moved: NDArray[np.float64]) -> NDArray[np.float64]:
        there, rest = move_parameters(sound, known, moved, step_us)
        absent = readings(there, experiment, step_us=step_us)[:, :MODELLED]
        left: NDArray[np.float64] = ((present - absent) / one).ravel() - known.matrix @ rest
        return left

    nowhere = np.zeros(len(known.names))
    apart = left_at(nowhere)
    found = project(apart, known)
    if refits == 0 or max(map(abs, found.moved.values()), default=0.0) < _SMALL_MOVE:
        return found
    there = known.within_reach(np.array(list(found.moved.values())))
    left_there = left_at(there)
    looked = _separation_of(found.before_refit, left_there, there, known)
    hidden = [effect for effect in parts.modifications if effect not in without]
    imitating = imitation(parts.plant, hidden)
    as_predicted = abs(looked.d_prime - found.d_prime) <= _AS_PREDICTED * found.d_prime
    clear = min(looked.d_prime, found.d_prime) > max(_CLEAR, _MOSTLY_EXPLAINED * found.before_refit)
    if not imitating and (as_predicted or clear):
        return min(looked, found, key=lambda each: each.d_prime)
    if imitating:
        start = known.within_reach(np.array([imitating.get(name, 0.0) for name in known.names]) / known.deviations)
        refitted = _refit(left_at(start), start, left_at, known, refits)
    elif looked.d_prime < found.before_refit:
        refitted = _refit(left_there, there, left_at, known, refits, _NEAR_DAMPING)
    else:
        refitted = _refit(apart, nowhere, left_at, known, refits)
    return replace(min(looked, refitted, key=lambda each: each.d_prime), before_refit=found.before_refit)


def project(difference: NDArray[np.float64], known: Tangents) -> Separation:
    """Returns d′ of a difference of readings (in their standard deviations, periods·3) after one refit along the
    tangents."""
    moved = _step(difference, np.zeros(len(known.names)), known.matrix)
    return _separation_of(float(np.linalg.norm(difference)), difference - known.matrix @ moved, moved, known)


def modelled_readings(parts: LoopParts, experiment: Experiment) -> NDArray[np.float64]:
    """Returns readings (counts, (periods, MODELLED)) of the complete arm."""
    return readings(parts, experiment, step_us=step_length(parts))[:, :MODELLED]


def step_length(parts: LoopParts) -> int:
    """Returns the plant's step (µs): coarse if the drive changes only at coarse steps and every gear is rigid."""
    fine = parts.board.timing.computing_delay % _COARSE_STEP_US or of_kind(parts.modifications, ChangesTransmission)
    return STEP_US if fine else _COARSE_STEP_US


def _refit(
    left: NDArray[np.float64],
    moved: NDArray[np.float64],
    left_at: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    known: Tangents,
    refits: int,
    damping: float = _FIRST_DAMPING,
) -> Separation:
    """Runs Levenberg–Marquardt from `moved`, where `left` is the residual.

    Each step corrects the tangents (Broyden's update). Heavy damping at first makes it begin with the directions that
    explain most; the others follow.
    """
    matrix = known.matrix
    cost = float(left @ left + moved @ moved)
    for _ in range(refits):
        trial = known.within_reach(moved + _step(left, moved, matrix, damping))
        step = trial - moved
        left_there = left_at(trial)
        matrix = matrix + np.outer(left - left_there - matrix @ step, step) / max(float(step @ step), 1e-12)
        cost_there = float(left_there @ left_there + trial @ trial)
        if cost_there < cost:
            settled = damping < 1.0 and cost_there > _SETTLED * cost
            moved, left, cost, damping = trial, left_there, cost_there, damping / _LESS_DAMPING
            if settled:
                break
        else:
            damping *= _MORE_DAMPING
    return _separation_of(0.0, left, moved, known)


def _step(
    left: NDArray[np.float64], moved: NDArray[np.float64], matrix: NDArray[np.float64], damping: float = 0.0
) -> NDArray[np.float64]:
    """Returns the step from `moved`, where `left` is the residual."""
    normal = matrix.T @ matrix + (1.0 + damping) * np.eye(matrix.shape[1])
    return np.asarray(np.linalg.solve(normal, matrix.T @ left - moved), dtype=np.float64)


def _separation_of(before: float, left: NDArray[np.float64], moved: NDArray[np.float64], known: Tangents) -> Separation:
    squared = float(left @ left + moved @ moved)
    by_name = {name: float(value) for name, value in zip(known.names, moved, strict=True)}
    return Separation(float(np.sqrt(squared)), before, by_name)


def move_parameters(
    parts: LoopParts, known: Tangents, moved: NDArray[np.float64], step_us: int
) -> tuple[LoopParts, NDArray[np.float64]]:
    """Returns the arm with its tolerance parameters moved by a number of their standard deviations, and the remainder
    of the moves, which is applied along the tangents."""
    rest = np.zeros(len(known.names))
    deviations = dict(zip(known.names, (moved * known.deviations).tolist(), strict=True))
    if not any(deviations.values()):
        return parts, rest
    late = deviations["computing_delay"]
    whole = round(late * 1e6 / step_us) * step_us * 1e-6
    effects: list[Modification] = []
    if abs(late - whole) < _WHOLE_S:
        delay = known.names.index("computing_delay")
        rest[delay] = (late - whole) / known.deviations[delay]
    else:
        whole = math.floor(late * 1e6 / step_us) * step_us * 1e-6
        effects += [InputDelay(joint, late - whole) for joint in range(1, MODELLED + 1)]
    deviations["computing_delay"] = whole
    plant, board = deviating_plant(parts.plant, deviations), deviating_board(parts.board, deviations)
    for joint in range(1, MODELLED + 1):
        for harmonic in HARMONICS:
            sine, cosine = (deviations[_harmonic_name(joint, share, harmonic)] for share in ("sine", "cosine"))
            effects.append(LinearityHarmonic(joint, harmonic, sine, cosine))
    return LoopParts(plant, board, (*parts.modifications, *effects), parts.arm_seed), rest


def _harmonic_name(joint: int, share: str, harmonic: int) -> str:
    return f"linearity_{joint}_{share}_{harmonic}"


def _row(experiment: Experiment, parts: LoopParts) -> NDArray[np.float64]:
    return readings(parts, experiment, step_us=_TANGENT_STEP_US)[:, :MODELLED].ravel()


def _directions(plant: PlantParameters, board: BoardParameters) -> list[_Direction]:
    flat = replace(board, linearity=0.0)
    found = []
    for tolerance in tolerances():
        deviation = tolerance.stated
        step = _DELAY_STEP_S if tolerance.is_time else min(deviation, _LARGEST_STEP)
        moved = {tolerance.name: step}
        parts = LoopParts(deviating_plant(plant, moved), deviating_board(flat, moved), (), 0)
        found.append(_Direction(tolerance.name, deviation, deviation / step, parts))
    for joint in range(1, MODELLED + 1):
        for harmonic in HARMONICS:
            counts = harmonic_deviation(board.linearity, harmonic)
            for name, sine, cosine in (("sine", counts, 0.0), ("cosine", 0.0, counts)):
                bend = LinearityHarmonic(joint, harmonic, sine, cosine)
                parts = LoopParts(plant, flat, (bend,), 0)
                found.append(_Direction(_harmonic_name(joint, name, harmonic), counts, 1.0, parts))
    return found


def _key(plant: PlantParameters, board: BoardParameters, experiment: Experiment) -> str:
    told = repr((plant, board, experiment, tolerances()))
    return sha256(told.encode()).hexdigest()[:16]
