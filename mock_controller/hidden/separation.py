"""d′: how far the readings of an arm with a hidden effect are from those that a sound arm could give.

Run the arm with and without its effects, with the same noise. Their difference y, in standard deviations of a reading,
is what an observer sees who knows the arm without them. One who does not may move the tolerance parameters z, each in
its own standard deviation, at the price of its prior. With J = ∂y/∂z what is left is

    d′² = min_z |y − J z|² + |z|²  =  yᵀ (I + J Jᵀ)⁻¹ y.

J is taken at the data file's arm by finite differences of this very plant; potentiometer curves are among the z.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from multiprocessing import get_context
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mock_controller.board.parameters import BoardParameters
from mock_controller.hidden.closed_loop import LoopParts, reading_deviation, readings
from mock_controller.hidden.experiment import Experiment
from mock_controller.hidden.tolerances import (
    HARMONICS,
    LinearityHarmonic,
    deviating_board,
    deviating_plant,
    harmonic_deviation,
    tolerances,
)
from mock_controller.modifications.interface import Modification
from mock_controller.plant import PlantParameters

Priors = Literal["stated", "drawn"]
MODELLED = 3
"""Joints 1 to 3 are looked at; the others are held."""
_TANGENT_STEP_US = 2000
"""Steps of the plant for the tangents: four digits of a derivative are enough, and it takes half the time."""
_LARGEST_STEP = 0.1
"""Fraction by which a constant is moved at most: wide priors are followed along the tangent."""
_DELAY_STEP_S = 2e-3
"""Change of the computing delay: a step of the plant."""


@dataclass(frozen=True)
class Tangents:
    """∂ readings/∂ tolerance parameter, in reading deviations per standard deviation; `matrix` (periods·3, names)."""

    names: tuple[str, ...]
    matrix: NDArray[np.float64]


@dataclass(frozen=True)
class Separation:
    """How well an effect can be seen: d′, the same before any refit, and how far the refit moves what (in σ)."""

    d_prime: float
    before_refit: float
    moved: dict[str, float]


@dataclass(frozen=True)
class _Direction:
    """One tolerance parameter: its name, the arm with it moved a step, and how many steps its deviation is."""

    name: str
    steps: float
    parts: LoopParts


def tangents(
    plant: PlantParameters,
    board: BoardParameters,
    experiment: Experiment,
    priors: Priors = "stated",
    processes: int = 1,
    cache: Path | None = None,
) -> Tangents:
    """Tangents at the arm of the data files; with `cache`, a folder, read from there if they are there."""
    kept = None if cache is None else cache / f"tangents-{_key(plant, board, experiment, priors)}.npz"
    if kept is not None and kept.exists():
        with np.load(kept) as stored:
            return Tangents(tuple(str(name) for name in stored["names"]), stored["matrix"])
    directions = _directions(plant, board, priors)
    base = LoopParts(plant, replace(board, linearity=0.0), (), 0)
    run = partial(_row, experiment)
    every = [base, *(direction.parts for direction in directions)]
    if processes > 1:
        with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
            rows = list(pool.map(run, every, chunksize=2))
    else:
        rows = [run(parts) for parts in every]
    one = reading_deviation(board)
    columns = [direction.steps * (row - rows[0]) / one for direction, row in zip(directions, rows[1:], strict=True)]
    found = Tangents(tuple(direction.name for direction in directions), np.stack(columns, axis=1))
    if kept is not None:
        kept.parent.mkdir(parents=True, exist_ok=True)
        np.savez(kept, names=np.array(found.names), matrix=found.matrix)
    return found


def separation(
    parts: LoopParts, experiment: Experiment, known: Tangents, without: tuple[Modification, ...] = ()
) -> Separation:
    """d′ between `parts` and the same arm with the modifications `without` only (by default none)."""
    present = readings(parts, experiment)[:, :MODELLED]
    absent = readings(replace(parts, modifications=without), experiment)[:, :MODELLED]
    return project(((present - absent) / reading_deviation(parts.board)).ravel(), known)


def project(difference: NDArray[np.float64], known: Tangents) -> Separation:
    """d′ of a difference of readings (in their standard deviations, periods·3) after the refit."""
    matrix = known.matrix
    normal = matrix.T @ matrix + np.eye(matrix.shape[1])
    moved = np.linalg.solve(normal, matrix.T @ difference)
    left = difference - matrix @ moved
    squared = float(left @ left + moved @ moved)
    by_name = {name: float(value) for name, value in zip(known.names, moved, strict=True)}
    return Separation(float(np.sqrt(squared)), float(np.linalg.norm(difference)), by_name)


def _row(experiment: Experiment, parts: LoopParts) -> NDArray[np.float64]:
    return readings(parts, experiment, step_us=_TANGENT_STEP_US)[:, :MODELLED].ravel()


def _directions(plant: PlantParameters, board: BoardParameters, priors: Priors) -> list[_Direction]:
    flat = replace(board, linearity=0.0)
    found = []
    for tolerance in tolerances():
        deviation = tolerance.stated if priors == "stated" else tolerance.drawn
        late = tolerance.name == "computing_delay"
        step = _DELAY_STEP_S if late else min(deviation, _LARGEST_STEP)
        moved = {tolerance.name: step}
        parts = LoopParts(deviating_plant(plant, moved), deviating_board(flat, moved), (), 0)
        found.append(_Direction(tolerance.name, deviation / step, parts))
    for joint in range(1, MODELLED + 1):
        for harmonic in HARMONICS:
            counts = harmonic_deviation(board.linearity, harmonic)
            for name, sine, cosine in (("sine", counts, 0.0), ("cosine", 0.0, counts)):
                bend = LinearityHarmonic(joint, harmonic, sine, cosine)
                parts = LoopParts(plant, flat, (bend,), 0)
                found.append(_Direction(f"linearity_{joint}_{name}_{harmonic}", 1.0, parts))
    return found


def _key(plant: PlantParameters, board: BoardParameters, experiment: Experiment, priors: Priors) -> str:
    told = repr((plant, board, experiment, priors, tolerances()))
    return sha256(told.encode()).hexdigest()[:16]
