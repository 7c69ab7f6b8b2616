"""A candidate beside the fit that it is held against, on records fitted to and on others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from model.arrays import Floats
from model.discrepancy.inverse_dynamics import holdout
from model.discrepancy.inverse_dynamics.fitting import BalanceFit, fit
from model.discrepancy.inverse_dynamics.search import Fitted
from model.discrepancy.inverse_dynamics.standing import Standing
from model.effects.library import find_named_effect
from model.inverse_dynamics.torque_balance import TorqueBalance


@dataclass(frozen=True)
class Comparison:
    """What a candidate takes off the residual.

    reference: the fit that it is held against. fitted_before, fitted_after: mean squares (n,), (N·m)² or N², that the
    reference and the candidate leave on the records fitted to. before, after: those (n,) on records not fitted to.
    """

    chosen: Fitted
    reference: BalanceFit
    fitted_before: Floats
    fitted_after: Floats
    before: Floats
    after: Floats

    @property
    def removed(self) -> float:
        """Share of the mean square that is gone on records not fitted to."""
        return holdout.share_removed(self.fitted_before, self.fitted_after, self.before, self.after)


def compare(standing: Standing, chosen: Fitted) -> Comparison | None:
    """The candidate beside its reference; None where there was no more than noise to explain."""
    reference = _reference(standing, chosen)
    fell, left = (holdout.mean_squares(standing.case.stretches, f.residual) for f in (reference, chosen.fit))
    if not _is_beyond_noise(standing, chosen, fell, left):
        return None
    before, after = _predicted(standing, reference, chosen.fit)
    return Comparison(chosen, reference, fell, left, before, after)


def _reference(standing: Standing, chosen: Fitted) -> BalanceFit:
    """The fit that a candidate is held against: the last one, or that with a number as the file states it. With its
    prior, a number far off may be fitted as well as without."""
    case, now = standing.case, standing.now
    if not chosen.stated:
        return now
    held = {p.name: p.value for p in chosen.stated}
    unknowns = [u for u in now.unknowns if u.name not in held]
    balance = TorqueBalance(standing.model.with_values({**now.model_values, **held}), case.records)
    return fit(balance, unknowns, now.values, case.data, now.noise.memory)


def _is_beyond_noise(standing: Standing, chosen: Fitted, fell: Floats, left: Floats) -> bool:
    """Whether there was more than noise to explain: of a torque on a joint, on that joint.

    Args:
        fell, left: mean squares (n,) on the fitted records without and with the candidate.
    """
    if chosen.joints and find_named_effect(chosen.effect).shared_name.acts_on == "joint torque":
        elsewhere = np.array([j not in chosen.joints for j in standing.model.machine.modelled_joints])
        fell = np.where(elsewhere, np.nan, fell)
    return holdout.is_beyond_noise(fell, left, standing.case.noise)


def _predicted(standing: Standing, before: BalanceFit, after: BalanceFit) -> tuple[Floats, Floats]:
    """Mean squares (n,) of both on records not fitted to: held-out ones, else blocks of the fitted ones."""
    held = standing.case.held_out
    if held:
        squares = [holdout.held_out_squares(f.balance.model, f.values, held) for f in (before, after)]
    else:
        squares = [holdout.block_squares(f) for f in (before, after)]
    return squares[0], squares[1]
