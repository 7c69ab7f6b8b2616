"""One turn of the search: probe every trial, fit the promising ones with everything else free, weigh the evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.contracts.progress import Cancel, Progress, stop_if
from model.discrepancy.inverse_dynamics.balance import TorqueBalance
from model.discrepancy.inverse_dynamics.candidates import Start, Trial, trials
from model.discrepancy.inverse_dynamics.fitting import Data, Slopes, TorqueFit, fit, slopes_of
from model.discrepancy.inverse_dynamics.likelihood import noise_model
from model.discrepancy.inverse_dynamics.options import TorqueOptions
from model.discrepancy.inverse_dynamics.probing import Probe, prober
from model.discrepancy.inverse_dynamics.tolerances import Adjustable
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

Floats = NDArray[np.float64]

SHORTLIST = 7
"""Effects that are fitted."""
ALIKE = 0.97
"""Correlation of the torques of two effects from which they count as the same."""
JOINT_GAIN = 12.0
"""Fall of the squares for which a joint is taken into an effect that acts on several."""


@dataclass(frozen=True)
class Fitted:
    """An effect on joints with everything fitted again: evidence, and the weighted residual per sample it leaves."""

    effect: str
    joints: tuple[int, ...]
    model: Model
    parameters: tuple[Parameter, ...]
    fit: TorqueFit
    evidence: float

    def rivals(self, other: Fitted) -> bool:
        """Whether both explain torques of the same joints by different effects."""
        alike = not self.joints or not other.joints or bool(set(self.joints) & set(other.joints))
        return self.effect != other.effect and alike

    def imitates(self, other: Fitted, before: TorqueFit) -> bool:
        """Whether this is the other one's torque over again, with more parameters."""
        if len(self.parameters) <= len(other.parameters):
            return False
        own, theirs = (
            np.concatenate([(a - b).ravel() for a, b in zip(f.fit.residual, before.residual, strict=True)])
            for f in (self, other)
        )
        return bool(own @ theirs > ALIKE * np.linalg.norm(own) * np.linalg.norm(theirs))


@dataclass(frozen=True)
class Turn:
    """What one turn found: fitted candidates, best first, and the others as they were probed."""

    fitted: tuple[Fitted, ...]
    probed: tuple[Probe, ...]
    memory: Floats
    trials: int


def look(model: Model, now: TorqueFit, data: Data, options: TorqueOptions, progress: Progress, cancel: Cancel) -> Turn:
    """Every effect that the model lacks, against the residuals of a fit.

    Raises CancelledError when asked to end.
    """
    slopes = slopes_of(now)
    probing = prober(now, slopes, data)
    fitted_model = model.with_values(now.values)
    probes: list[Probe] = []
    for trial in trials(fitted_model, now.balance.records, now.residual, options):
        stop_if(cancel)
        progress(0.3, f"trying {trial.effect.replace('_', ' ')}{_on(trial.joints)}")
        probes.append(probing.probe(trial))
    probes.sort(key=lambda p: -p.gain)
    found = []
    for probe_set in _shortlist(probes):
        stop_if(cancel)
        progress(0.6, f"fitting {probe_set[0].trial.effect.replace('_', ' ')}{_on(_joints(probe_set))}")
        found.append(_fitted(fitted_model, now, slopes, data, probe_set))
    weighed, memory = _weighed(found, now, data, sum(len(p.trial.starts) for p in probes))
    return Turn(tuple(weighed), tuple(probes), memory, len(probes))


def _on(joints: tuple[int, ...]) -> str:
    return f" on joint {', '.join(map(str, joints))}" if joints else ""


def _joints(probes: Sequence[Probe]) -> tuple[int, ...]:
    return tuple(sorted({j for p in probes for j in p.trial.joints}))


def _shortlist(probes: Sequence[Probe]) -> list[list[Probe]]:
    """For the most promising effects, the best joint alone, and all joints on which there is something to explain."""
    by_effect: dict[str, list[Probe]] = {}
    for probe in probes:
        if probe.gain > 0:
            by_effect.setdefault(probe.trial.effect, []).append(probe)
    sets = []
    for own in by_effect.values():
        several = [p for p in own if p.gain > JOINT_GAIN]
        best = sum(p.gain for p in several) if several else own[0].gain
        sets.append((best, own[0], several))
    chosen = []
    for _, first, several in sorted(sets, key=lambda s: -s[0])[:SHORTLIST]:
        chosen.append([first])
        if len(several) > 1:
            chosen.append(sorted(several, key=lambda p: p.trial.joints))
    return chosen


def _fitted(model: Model, now: TorqueFit, slopes: Slopes, data: Data, probes: Sequence[Probe]) -> Fitted:
    trial: Trial = probes[0].trial
    joints = _joints(probes)
    wider = model.with_effect(trial.effect, joints)
    own = tuple(p for probe in probes for p in probe.trial.parameters)
    start: Start = {name: value for p in probes for name, value in p.start.items()}
    parameters = (*now.adjustables, *(found_parameter(p) for p in own))
    balance = TorqueBalance(wider, now.balance.records)
    fitted = fit(balance, parameters, {**now.values, **start}, data, now.noise.memory, slopes)
    return Fitted(trial.effect, joints, wider, own, fitted, 0.0)


def found_parameter(p: Parameter) -> Adjustable:
    """A parameter of an effect that is being looked for: bounds and no prior."""
    scale = p.deviation or abs(p.value) or 1.0
    low = p.low if np.isfinite(p.low) else -1e6 * scale
    high = p.high if np.isfinite(p.high) else 1e6 * scale
    return Adjustable(p.name, p.unit, low, high, p.value, None, scale)


def _weighed(found: Sequence[Fitted], now: TorqueFit, data: Data, places: int) -> tuple[list[Fitted], Floats]:
    """Evidence of every candidate, counted in the independent samples that the best one leaves."""
    if not found:
        return [], now.noise.memory
    best = min(found, key=lambda f: f.fit.criterion)
    memory = noise_model(data.stretches, best.fit.residual, data.floor).memory
    weighed = [
        Fitted(
            f.effect,
            f.joints,
            f.model,
            f.parameters,
            f.fit,
            evidence(now, f.fit, data, memory, len(f.parameters), places),
        )
        for f in found
    ]
    return sorted(weighed, key=lambda f: -f.evidence), memory


def evidence(before: TorqueFit, after: TorqueFit, data: Data, memory: Floats, parameters: int, places: int) -> float:
    """What `after` takes off −2 log posterior: its parameters and the places looked at paid for."""
    counts = np.array([sum(rows.stop - rows.start for _, rows in s) for s in data.stretches.by_joint])
    independent = max(float((counts / memory).sum()), 2.0)
    fell = float(((before.by_joint * before.noise.memory - after.by_joint * after.noise.memory) / memory).sum())
    return (
        fell + before.prior - after.prior - parameters * float(np.log(independent)) - 2 * float(np.log(max(places, 1)))
    )
