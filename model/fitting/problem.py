"""Interface between a fit's numerics and its model: residuals and derivatives for values of the unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from model.arrays import Floats
from model.fitting.unknowns import Unknown
from model.fitting.whitening import Whitener


@dataclass(frozen=True)
class Evaluation:
    """Residuals of one trace: `residual` (m, n) simulated − measured, `jacobian` (p, m, n) or None."""

    residual: Floats
    jacobian: Floats | None


class Problem(Protocol):
    """Residuals of several traces with the same n signals as functions of the same p unknowns."""

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """The p unknowns, in the order of values and Jacobians."""
        ...

    @property
    def runs(self) -> Sequence[Sequence[slice]]:
        """Per trace, the stretches of samples without a gap."""
        ...

    @property
    def floor(self) -> Floats:
        """(n,) standard deviation of the measurement itself, by signal."""
        ...

    def evaluate(self, values: Floats, derivatives: bool) -> list[Evaluation]:
        """Returns residuals, with exact derivatives on request. Raises SpecError if the model has no finite answer."""
        ...


@dataclass(frozen=True)
class Whitened:
    """Residual and Jacobian of all samples after whitening, sample by sample.

    residual: (m, n); jacobian: (m, n, p); starts: first row of each stretch without a gap, and m at the end.
    """

    residual: Floats
    jacobian: Floats
    starts: tuple[int, ...]

    @property
    def information(self) -> Floats:
        """Returns JᵀJ, (p, p)."""
        flat = self.jacobian.reshape(-1, self.jacobian.shape[-1])
        return np.asarray(flat.T @ flat)

    def scores(self, influence: Floats | None = None) -> list[Floats]:
        """Returns per stretch (k, p): Σ over signals of J ψ(r) at each sample; by default ψ is the identity."""
        r = self.residual if influence is None else influence
        every = np.einsum("mnp,mn->mp", self.jacobian, r)
        return [every[a:b] for a, b in zip(self.starts, self.starts[1:], strict=False)]


def whitened(problem: Problem, evaluations: Sequence[Evaluation], whiteners: Sequence[Whitener]) -> Whitened:
    """Whitens all traces, run by run and signal by signal."""
    residuals, jacobians, starts, done = [], [], [0], 0
    for evaluation, runs in zip(evaluations, problem.runs, strict=True):
        for run in runs:
            residuals.append(whitened_residual(evaluation.residual[run], whiteners))
            if evaluation.jacobian is not None:
                jacobian = np.moveaxis(evaluation.jacobian[:, run], 0, -1)
                columns = [w.whitened(jacobian[:, k]) for k, w in enumerate(whiteners)]
                jacobians.append(np.stack(columns, axis=1))
            done += run.stop - run.start
            starts.append(done)
    empty = np.zeros((done, len(whiteners), 0))
    return Whitened(np.concatenate(residuals), np.concatenate(jacobians) if jacobians else empty, tuple(starts))


def whitened_residual(residual: Floats, whiteners: Sequence[Whitener]) -> Floats:
    """Whitens one run (k, n), each signal by its own filter."""
    return np.stack([w.whitened(residual[:, k]) for k, w in enumerate(whiteners)], axis=1)
