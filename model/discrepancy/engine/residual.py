"""What a model leaves of records: the one thing of which there are two kinds, torques and readings.

Everything else of a diagnosis (fits, probes, the search, held-out records, the decision) is written once, against these
protocols. `flat` puts the compared samples of a residual in a row, joint after joint.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol, Self

import numpy as np

from model.arrays import Floats
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model

Values = Mapping[str, float]
"""Of parameters of a model, and of the records' own unknowns, by full name."""
Signals = Sequence[Floats]
"""One array (m, n) a record: sample by joint."""


@dataclass(frozen=True)
class Samples:
    """The compared samples. runs: by joint, the record (index) and rows of every stretch without a gap.

    told: (n,) samples of each joint that tell something: all of them, less dimensions that were projected away.
    """

    runs: tuple[tuple[tuple[int, slice], ...], ...]
    told: Floats

    @property
    def sizes(self) -> list[int]:
        """Samples of every joint."""
        return [sum(rows.stop - rows.start for _, rows in own) for own in self.runs]

    @property
    def columns(self) -> list[slice]:
        """Where each joint's samples are in a row of all of them."""
        edges = np.cumsum([0, *self.sizes])
        return [slice(int(a), int(b)) for a, b in pairwise(edges)]

    def pieces(self, signals: Signals, joint: int) -> list[Floats]:
        """Samples of a joint (index), run by run."""
        return [signals[i][rows, joint] for i, rows in self.runs[joint]]

    def flat(self, signals: Signals) -> Floats:
        """(…, N) of signals (…, m, n)."""
        none = np.zeros((*signals[0].shape[:-2], 0))
        parts = [signals[i][..., rows, j] for j, own in enumerate(self.runs) for i, rows in own]
        return np.concatenate([none, *parts], axis=-1)

    def split(self, row: Floats, joint: int) -> list[Floats]:
        """Runs (…, m) of a joint (index) from a row (…, N)."""
        found, begin = [], self.columns[joint].start
        for _, rows in self.runs[joint]:
            end = begin + rows.stop - rows.start
            found.append(row[..., begin:end])
            begin = end
        return found

    def mean_squares(self, signals: Signals) -> Floats:
        """(n,) mean square of each joint over what tells something; NaN where nothing does."""
        sums = np.array([sum(float(np.sum(p**2)) for p in self.pieces(signals, j)) for j in range(len(self.runs))])
        return np.asarray(np.where(self.told > 0.0, sums / np.maximum(self.told, 1.0), np.nan))


class Residual(Protocol):
    """One kind of comparison of one model with one set of records.

    floor: (n,) least standard deviation of a residual.
    """

    @property
    def model(self) -> Model:
        """The model that is compared."""
        ...

    @property
    def samples(self) -> Samples:
        """The samples that are compared."""
        ...

    @property
    def floor(self) -> Floats:
        """(n,) the least that the standard deviation of a residual can be."""
        ...

    def of_model(self, model: Model) -> Self:
        """The same records with another model."""
        ...

    def within(self, fold: int, folds: int) -> tuple[Self, Self]:
        """The same, with samples outside and inside a share of every record: to fit to, and to predict."""
        ...

    def at(self, values: Values) -> Signals:
        """What the model leaves with these values. Not finite where a simulation is not."""
        ...

    def changes(self, base: Values, moved: Sequence[Values]) -> Floats:
        """(k, N) by which the residual differs at other values, for differences and probes: quick, if less exact."""
        ...

    def slopes(self, values: Values, unknowns: Sequence[Unknown]) -> Floats:
        """(k, N) derivatives of the residual, for steps of a fit."""
        ...

    def told_slopes(self, values: Values, unknowns: Sequence[Unknown]) -> Floats:
        """(k, N) those of what records tell: without what friction at rest takes up."""
        ...

    def deviations(self, row: Floats) -> Floats:
        """(n,) standard deviations with which samples of this residual (N,) are weighed."""
        ...

    def memory(self, row: Floats) -> Floats:
        """(n,) samples of a residual (N,) that count as one."""
        ...

    def weighted(self, rows: Floats, deviations: Floats, memory: Floats, joint: int | None = None) -> Floats:
        """Rows (…, N), so that the sum of their squares counts what they tell; of one joint alone, if given."""
        ...

    def costs(self, row: Floats, memory: Floats) -> Floats:
        """(n,) −2 ln likelihood of a residual (N,) by joint, as fits minimise it."""
        ...

    def descriptions(self, rows: Sequence[Floats]) -> tuple[list[Floats], Floats]:
        """−2 ln likelihoods (n,) of several residuals that may be compared with one another, the first being of the
        model without any of the others' effects; and the memory (n,) that they were counted by."""
        ...
