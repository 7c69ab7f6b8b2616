"""What candidates would show on an experiment that has not been made, and what could hide the difference.

The tolerance parameters are known as well as the traces and their priors say; on the new experiment they may move as
far as that allows, and its posture at the start is unknown anew.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import DaqError
from daq.contracts.experiment import ExperimentSpec
from model.design.information import imagined_trace
from model.discrepancy.output_error.observation import Observation, Signals, observed
from model.discrepancy.output_error.search import Point
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model

Floats = NDArray[np.float64]
Planner = Callable[[ExperimentSpec], Floats]
"""Set points (k, joints of the machine) in rad, one row a control period. It raises a DaqError (one line) for an
experiment that may not be carried out. Given from above: planning belongs to `daq`."""

NOISE_SEED = 2
"""Of the readings' noise in an imagined run: without noise friction would hold where the real arm creeps."""
LOOSE = 1e-9
"""Relative precision that stands for none, so that matrices can be inverted."""


@dataclass(frozen=True)
class Imagined:
    """An experiment as a diagnosis would see it, with the record that it is `recorded` to leave.

    starts: its postures at the start, unknown within a reading or so. noise: of the readings, counts.
    """

    observation: Observation
    starts: tuple[Unknown, ...]
    noise: Signals

    @property
    def duration(self) -> float:
        """s"""
        inputs = self.observation.records[0].inputs
        return len(inputs) * inputs.period


def imagined(model: Model, spec: ExperimentSpec, plan: Planner) -> Imagined | None:
    """The experiment on the grid of control periods; None where the planner refuses it, or nothing would move."""
    try:
        observation, _, unknowns = observed(model, [imagined_trace(model, spec, plan)])
    except DaqError:
        return None
    counts = observation.deviations / observation.unit
    drawn = np.random.default_rng(NOISE_SEED).standard_normal(observation.prepared[0].noise.shape)
    return Imagined(observation, tuple(u for u in unknowns if u.trace is not None), (drawn * counts,))


def recorded(there: Imagined, point: Point) -> Imagined:
    """The experiment with the record that an arm like the point's model would leave. Not finite where its simulation
    is not."""
    unknowns, values = _unknowns(there, point)
    readings = there.observation.with_noise(there.noise).shown(point.model, unknowns, values)
    return replace(there, observation=there.observation.made_of(readings))


def values_of(there: Imagined, point: Point) -> Floats:
    """(p,) of a point's shared unknowns and of the starts, in the order of all derivatives here."""
    return _unknowns(there, point)[1]


def bounded(there: Imagined, point: Point, values: Floats) -> Floats:
    """The values within their unknowns' bounds."""
    unknowns, _ = _unknowns(there, point)
    return np.clip(values, [u.low for u in unknowns], [u.high for u in unknowns])


def shown(there: Imagined, point: Point, values: Floats | None = None) -> Floats:
    """What a point's model shows where it follows the record, (N,) in deviations of a reading; with other values (p,)
    than the point's, if given. Not finite where its simulation is not."""
    unknowns, own = _unknowns(there, point)
    readings = there.observation.shown(point.model, unknowns, own if values is None else values)
    return there.observation.weighted(readings)


def tangents(there: Imagined, point: Point, known: Mapping[str, Floats], values: Floats | None = None) -> Floats:
    """Derivatives (p, N) of what a point's model would show by its shared unknowns and the starts, at other values than
    the point's, if given. `known`: rows that are taken over by name: those by the tolerance parameters change little.

    Raises SpecError when the simulation does not stay finite.
    """
    unknowns, own = _unknowns(there, point)
    at = own if values is None else values
    rows = dict(known)
    missing = [k for k, u in enumerate(unknowns) if u.name not in rows]
    if missing:
        new = there.observation.tangents(point.model, unknowns, at, missing)
        rows |= {unknowns[k].name: row for k, row in zip(missing, new, strict=True)}
    return np.stack([rows[u.name] for u in unknowns])


def names_of(there: Imagined, point: Point) -> tuple[str, ...]:
    """Names of the rows of those derivatives."""
    return tuple(u.name for u in _unknowns(there, point)[0])


def shared(point: Point) -> tuple[Unknown, ...]:
    """Unknowns that belong to no trace: they stay what they are on the next one."""
    return tuple(u for u in point.unknowns if u.trace is None)


def known_so_far(there: Imagined, point: Point) -> Floats:
    """Information (p, p) about the shared unknowns from traces and priors, those of single traces marginalised; about
    the new starts, their priors."""
    mine = np.array([u.trace is None for u in point.unknowns])
    information = point.information
    information[np.diag_indices_from(information)] *= 1 + LOOSE
    inner, cross = information[np.ix_(~mine, ~mine)], information[np.ix_(~mine, mine)]
    left = information[np.ix_(mine, mine)]
    if len(inner):
        left = left - cross.T @ np.linalg.solve(inner, cross)
    starts = np.array([0.0 if u.deviation is None else u.deviation**-2 for u in there.starts])
    size = len(left) + len(starts)
    whole = np.zeros((size, size))
    whole[: len(left), : len(left)] = 0.5 * (left + left.T)
    whole[np.arange(len(left), size), np.arange(len(left), size)] = starts
    diagonal = np.diag(whole)
    whole[np.diag_indices(size)] += LOOSE * np.where(diagonal > 0, diagonal, 1.0)
    return whole


def _unknowns(there: Imagined, point: Point) -> tuple[tuple[Unknown, ...], Floats]:
    kept = np.array([u.trace is None for u in point.unknowns])
    starts = np.array([u.start for u in there.starts])
    return (*shared(point), *there.starts), np.concatenate([point.values[kept], starts])
