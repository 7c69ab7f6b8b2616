"""Σλ² recomputed from the published tables, in both conventions of τ′."""

from __future__ import annotations

import math

from daq.contracts.frozen import FrozenRecord
from extras.thesis.tables import LADDER, PublishedModel
from model.validation.criterion import contribution
from model.validation.expected_deviation import Basis, Convention, deviation_share


class RecomputedFidelity(FrozenRecord):
    """Σλ² of one published model from its values and standard deviations, beside the published sum.

    `contributions` are λ² by symbol; zero where the printed deviation is very large.
    """

    name: str
    table: str
    deviation_table: str
    convention: Convention
    published: float
    ours: float
    contributions: dict[str, float]

    @property
    def relative_difference(self) -> float:
        """(ours − published) / published."""
        return self.ours / self.published - 1.0


def recomputed_fidelities(convention: Convention = "source") -> tuple[RecomputedFidelity, ...]:
    """Σλ² of the four fitted models of chapter 7."""
    return tuple(_recomputed(model, convention) for model in LADDER)


def basis_of_symbol(symbol: str) -> Basis:
    """Which rule gives the expected deviation of a parameter of chapter 7 (section 7.2.2)."""
    if symbol[0] == "m" or symbol == "MLOAD":
        return "mass"
    return "length" if symbol[0] in "AR" else "gaussian"


def _recomputed(model: PublishedModel, convention: Convention) -> RecomputedFidelity:
    if model.sum_lambda is None or model.deviation_table is None:
        raise ValueError(f"table {model.table} has no sum of contributions")
    contributions = {
        symbol: contribution(model.deviations[symbol], value * deviation_share(basis_of_symbol(symbol), convention))
        for symbol, value in model.values.items()
    }
    return RecomputedFidelity(
        name=model.name,
        table=model.table,
        deviation_table=model.deviation_table,
        convention=convention,
        published=model.sum_lambda,
        ours=math.fsum(contributions.values()),
        contributions=contributions,
    )
