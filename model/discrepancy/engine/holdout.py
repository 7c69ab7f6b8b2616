"""Residuals on records that were not fitted to, and whether an effect holds there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from model.arrays import Floats
from model.discrepancy.engine.case import Case
from model.discrepancy.engine.fitting import Fit
from model.discrepancy.verdict import LEAST_EXCESS

AFFECTED = 0.01
"""Share by which a joint's mean square must have fallen in the fit to count as one on which the effect acts."""


@dataclass(frozen=True)
class Told:
    """What held-out records say for a fit, as evidence.

    alone: with independent samples counted in its own residual. compared: counted in one way for several fits, so that
    they can be compared: a fit whose residual is whiter has more samples, and is no better for that.
    """

    alone: float
    compared: float


def evidence(case: Case, before: Fit, after: Sequence[Fit]) -> list[Told]:
    """Fall of −2 log likelihood of records that no fit has seen, by each of several later fits; above 0 where one
    predicts them better than the fit before.

    No parameter of the model was fitted to these records, so none costs anything here. It adds to the evidence of the
    fitted records as by the chain rule of probability, at the fitted values in place of their whole posterior. What
    belongs to a record (its start, the phase of a disturbance) is its own on either side.
    """
    if not after or case.held_out is None:
        return [Told(0.0, 0.0) for _ in after]
    first, *last = (case.held_out.samples.flat(case.held(f)) for f in (before, *after))
    (shared_first, *shared), _ = case.held_out.descriptions([first, *last])
    found = []
    for row, compared in zip(last, shared, strict=True):
        (old, new), _ = case.held_out.descriptions([first, row])
        told = (float((old - new).sum()), float((shared_first - compared).sum()))
        found.append(Told(*(value if np.isfinite(value) else -np.inf for value in told)))
    return found


def squares_unseen(case: Case, now: Fit) -> Floats:
    """(n,) mean squares of records not fitted to: those held out, else quarters of the fitted ones, each predicted from
    the others."""
    return case.held_squares(now) if case.held_out is not None else now.squares_of_blocks


def squares_between(case: Case, one: Fit, other: Fit) -> Floats:
    """(n,) mean squares of that by which two fits differ on held-out records."""
    assert case.held_out is not None
    between = [a - b for a, b in zip(case.held(one), case.held(other), strict=True)]
    return case.held_out.samples.mean_squares(between)


def share_removed(fitted_before: Floats, fitted_after: Floats, before: Floats, after: Floats) -> float:
    """Share of the mean square that is gone on records not fitted to, over the joints whose mean square fell in the
    fit; 0 where nothing is known of these joints there, as where their drives are at limits all the time."""
    with np.errstate(invalid="ignore"):
        affected = (fitted_after < (1 - AFFECTED) * fitted_before) & (before > 0.0) & np.isfinite(after)
    if not affected.any():
        return 0.0
    return float(1 - np.mean(after[affected] / before[affected]))


def is_beyond_noise(before: Floats, after: Floats, noise: Floats) -> bool:
    """Whether any joint whose mean square fell in the fit had more to explain than noise, (n,) at most."""
    with np.errstate(invalid="ignore"):
        return bool(((after < (1 - AFFECTED) * before) & (before > noise**2)).any())


def excess_removed(noise: Floats, fitted: tuple[Floats, Floats], before: Floats, after: Floats) -> float | None:
    """Share of the held-out variance above noise that is gone on the joints that the step improved on the fitted
    records, weighted by their fitted mean square. Whether others grew is for `rmse_holdout` to tell.

    Args:
        noise: (n,) standard deviation of a residual of which only noise is left. fitted: (n,) mean squares on the
            fitted records, before and after. before, after: (n,) on held-out ones.
    """
    variance = noise**2
    excess = np.maximum(before - variance, 1e-300)
    fell = fitted[1] < (1 - AFFECTED) * fitted[0]
    usable = np.isfinite(before) & np.isfinite(after) & (before > (1 + LEAST_EXCESS) * variance) & fell
    if not usable.any():
        return None
    weight = np.where(usable, 1 / np.maximum(fitted[0], 1e-300), 0.0)
    return float((weight * (before - after))[usable].sum() / (weight * excess)[usable].sum())
