"""How much of the residual a trial could explain, at finite sizes and with the tolerance parameters free to follow."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from model.arrays import Floats
from model.discrepancy.candidates.probing import LARGEST_STRETCH
from model.discrepancy.inverse_dynamics.fitting import BalanceFit, Slopes, stacked
from model.discrepancy.inverse_dynamics.starts import Start, Trial
from model.discrepancy.inverse_dynamics.tolerances import prior_distance, prior_rows
from model.inverse_dynamics.torque_balance import DIFFERENCE, TorqueBalance

NONLINEAR = frozenset(
    {
        "dead_zone",
        "amplifier_threshold",
        "supply_limit",
        "input_delay",
        "motor_inductance",
        "resistance_drift",
        "resistance_rise",
        "backlash",
        "joint_compliance",
    }
)
"""Effects whose torque is far from linear in their size."""
ONE_SIDED = "one_sided_spring"
"""The effect whose size changes its law with its sign."""


@dataclass(frozen=True)
class Probe:
    """A trial at its best start: the fall of the weighted squares, and the start, scaled to fit."""

    trial: Trial
    gain: float
    start: Start


@dataclass(frozen=True)
class Prober:
    """A fit, prepared for probing: `basis` (N, p) spans what its unknowns can explain.

    left: (N,) what they leave of the residual and of what the priors ask for: an effect also gains what the tolerances
    no longer have to be moved for.
    """

    now: BalanceFit
    basis: Floats
    left: Floats

    def probe(self, trial: Trial) -> Probe:
        """The best of a trial's starts."""
        balance = self.now.balance.of_model(trial.model)
        null = {p.name: float(p.null) for p in trial.parameters if p.null is not None} | dict(trial.origin)
        best = Probe(trial, 0.0, trial.starts[0])
        if trial.stated:
            best = Probe(trial, self._lift_priors(trial), dict(trial.origin))
        # Also at the step of the fit's own derivatives: what the tolerances took over of an effect would be there twice
        # at its full size, and friction would hold a different part of it where a joint turns.
        shares_of_start = (1.0,) if trial.effect in NONLINEAR else (1.0, DIFFERENCE)
        for start, share in itertools.product(trial.starts, shares_of_start):
            part = {n: null[n] + share * (start[n] - null[n]) for n in trial.amplitudes}
            columns = [self._column(balance, {**start, **null, name: part[name]}) / share for name in trial.amplitudes]
            gain, sizes = self._explained(np.stack(columns, axis=1), self.left, trial, start, null)
            if gain > best.gain:
                scaled = {
                    n: null[n] + float(a) * (start[n] - null[n]) for n, a in zip(trial.amplitudes, sizes, strict=True)
                }
                best = Probe(trial, gain, {**start, **scaled})
        return best

    def _lift_priors(self, trial: Trial) -> float:
        """What the trial gains by its priors alone, with its numbers where they are."""
        own = (u for u in self.now.unknowns if u.name in trial.origin)
        return sum(prior_distance(u, self.now.values[u.name])[0] ** 2 for u in own)

    def _column(self, balance: TorqueBalance, values: Start) -> Floats:
        moved = balance.residual({**self.now.values, **values})
        change = [after - before for after, before in zip(moved, self.now.residual, strict=True)]
        return self._prepared(np.concatenate(self.now.noise.weighted(self.now.data.stretches, change)))

    def _prepared(self, signal: Floats) -> Floats:
        """A signal (N,) less what the unknowns explain of it, priors included."""
        padded = np.concatenate([signal, np.zeros(self.basis.shape[0] - len(signal))])
        return padded - self.basis @ (self.basis.T @ padded)

    def _explained(
        self, columns: Floats, left: Floats, trial: Trial, start: Start, null: Start
    ) -> tuple[float, Floats]:
        """Fall of the squares of what is left (N,), and the amplitudes (as shares of the start's) that cause it, none
        of a wrong sign."""
        kept = np.linalg.norm(columns, axis=0) > 1e-9
        shares = np.zeros(columns.shape[1])
        while kept.any():
            found = np.linalg.lstsq(columns[:, kept], -left, rcond=1e-8)[0]
            shares[:] = 0.0
            shares[kept] = np.clip(found, 0.0, LARGEST_STRETCH) if trial.effect in NONLINEAR else found
            wrong = kept & np.array(
                [self._outside(trial, n, a, start, null) for n, a in zip(trial.amplitudes, shares, strict=True)]
            )
            if not wrong.any():
                break
            kept &= ~wrong
            shares[:] = 0.0
        change = columns @ shares
        return float(-2 * change @ left - change @ change), shares

    def _outside(self, trial: Trial, name: str, share: float, start: Start, null: Start) -> bool:
        if trial.effect == ONE_SIDED and share < 0.0:
            return True  # a cable on the other side begins to pull elsewhere: another start
        p = next(p for p in trial.parameters if p.name == name)
        value = null[name] + share * (start[name] - null[name])
        room = 1e-9 * max(1.0, abs(value))
        return not p.low - room <= value <= p.high + room


def prepare_probes(now: BalanceFit, slopes: Slopes) -> Prober:
    """A prober around a fit whose derivatives are `slopes`."""
    A = np.concatenate(now.noise.weighted(now.data.stretches, stacked(slopes, now)))
    rows, aims = prior_rows(now.unknowns, np.array([now.values[u.name] for u in now.unknowns]))
    scale = np.array([u.scale for u in now.unknowns])
    whole = np.concatenate([A, rows]) * scale
    u, s, _ = np.linalg.svd(whole, full_matrices=False)
    basis = u[:, s > 1e-10 * s[0]] if s.size else np.zeros((whole.shape[0], 0))
    weighted = now.noise.weighted(now.data.stretches, now.residual)
    left = np.concatenate([*weighted, -aims])
    return Prober(now, basis, left - basis @ (basis.T @ left))
