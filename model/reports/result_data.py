"""Results of studies for clients: the data of the commands' `--json`, and signals for plots.

The functions `of_…` return the result of a fit, a validation or a comparison in one line, for lists. Pure.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from daq.contracts.frozen import FrozenRecord
from daq.contracts.service.jobs import ParameterWords
from daq.contracts.thinning import extremes, moments, stretches
from model.comparison.agreement import ModelAgreement, ParameterDifference
from model.discrepancy.diagnosis import Candidate, Diagnosis, Step, Where
from model.fitting.result import FitResult
from model.validation.criterion import Fidelity
from model.validation.variation import TimeDomain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daq.contracts.trace import Floats
    from model.comparison.agreement import JointAgreement
    from model.comparison.compare import Comparison, TraceSignals
    from model.validation.variation import TimeDomain


def of_fit(found: FitResult, comparison: Comparison) -> str:
    """Returns how many parameters are known, and how the fit changes the error."""
    known = sum(p.verdict == "known" for p in found.parameters)
    before, after = comparison.models
    held = before.held_out is not None and after.held_out is not None
    errors = (before.held_out, after.held_out) if held else (before.in_sample, after.in_sample)
    change = " → ".join("?" if joints is None else _error(joints) for joints in errors)
    told = f"{known} of {len(found.parameters)} parameters known; error {change}{', held out' if held else ''}"
    return told if found.verdict is None else f"{found.verdict.headline}; {told}"


def of_validation(found: Fidelity) -> str:
    """Returns whether the model explains the records."""
    total = f"Σλ² = {found.sum_of_contributions:.3g}"
    return total if found.verdict is None else f"{found.verdict.headline}; {total}"


def of_comparison(found: Comparison) -> str:
    """Returns the error of each model over all traces."""
    errors = [f"{m.label} {_error(m.held_out or m.in_sample or ())}" for m in found.models]
    return f"error {'; '.join(errors)}"


def _error(joints: Sequence[JointAgreement]) -> str:
    """Returns the root mean square over the revolute joints in degrees, and over the prismatic joints in mm."""
    turning = [j.rmse for j in joints if j.unit == "rad"]
    sliding = [j.rmse for j in joints if j.unit == "m"]
    told = []
    if turning:
        told.append(f"{math.degrees(_rms(turning)):.3g}°")
    if sliding:
        told.append(f"{1e3 * _rms(sliding):.3g} mm")
    return " and ".join(told) or "?"


def _rms(values: Sequence[float]) -> float:
    return math.sqrt(sum(v**2 for v in values) / len(values))


Words = dict[str, ParameterWords]
"""Names for people of the parameters in a result, by the parameter's name."""
Row = tuple[float | None, ...]
"""One signal of one joint; None for samples at which a simulation was not finite."""


class Overlay(FrozenRecord):
    """One trace with its simulations, thinned to the extremes of short intervals, so that no peak is lost.

    `time` is in s; signals have one row per joint, in the order of `joints`, in `units`. `simulated` and `residual`
    (measured − simulated, thinned separately) have such rows for every model, in the order of the result's `models`.
    """

    trace: str
    held_out: bool | None
    joints: tuple[int, ...]
    units: tuple[str, ...]
    samples: int
    """Number of samples before thinning."""
    time: tuple[float, ...]
    measured: tuple[Row, ...]
    set_point: tuple[Row, ...] | None
    simulated: tuple[tuple[Row, ...], ...]
    residual: tuple[tuple[Row, ...], ...]


class FitData(FitResult):
    """A fit, and the traces with simulations of the models before and after it. `undetermined`: what the traces cannot
    determine, one sentence each, with names of parameters for people."""

    models: tuple[ModelAgreement, ...]
    signals: tuple[Overlay, ...]
    undetermined: tuple[str, ...] = ()


class ValidationData(FrozenRecord):
    """A validation by distortion: `fidelity` in the source's convention of τ′, `three_sigma` in the other one (with the
    same curves). For each trace: how parameters would have to vary with time, thinned."""

    fidelity: Fidelity
    three_sigma: Fidelity
    time_domain: tuple[TimeDomain, ...]
    words: Words = Field(default_factory=dict)


class ComparisonData(FrozenRecord):
    """Models compared on the same traces."""

    models: tuple[ModelAgreement, ...]
    signals: tuple[Overlay, ...]
    differences: tuple[ParameterDifference, ...]
    words: Words = Field(default_factory=dict)


class TriedEffect(Candidate):
    """An effect that the diagnosis tried. `called`: names of the effect and its joints for people."""

    called: str


class DiagnosisStep(Step):
    """One step of the workflow. `called`: name of the added effect for people."""

    called: str
    candidates: tuple[TriedEffect, ...]
    group: tuple[TriedEffect, ...] = ()
    chance: float
    """Significance that noise alone exceeds in some cell of `where` in one record out of a hundred."""
    not_a_finding: str
    """Why the dependences in `where` are no finding; empty if the diagnosis reports one."""


class GivenWhere(FrozenRecord):
    """Where the given model disagrees with the traces; `chance` and `not_a_finding` as in a step."""

    where: Where
    chance: float
    not_a_finding: str


class DiagnosisData(Diagnosis):
    """A diagnosis (docs/diagnosis-json.md), and the traces with simulations of the models before and after it, if these
    can be simulated.

    `differences`: parameters that changed, including those of added effects. `given`: where the given model disagreed
    with the traces before any fit. `efforts`: for a diagnosis by inverse dynamics, the traces' torques (forces) and
    those that both models predict from the motion.
    """

    steps: tuple[DiagnosisStep, ...]
    candidates: tuple[TriedEffect, ...] = ()
    models: tuple[ModelAgreement, ...] = ()
    signals: tuple[Overlay, ...] = ()
    efforts: tuple[Overlay, ...] = ()
    differences: tuple[ParameterDifference, ...] = ()
    given: GivenWhere | None = None
    words: Words = Field(default_factory=dict)


# --- Thins the signals of a comparison to a number of points that a page draws at once, without losing peaks


MOST_POINTS, LEAST_POINTS = 1600, 200
"""Most points of one trace, and the number per trace if there are many."""
ALL_POINTS = 16_000
"""Most points of all traces of one result together."""
DIGITS = 7
"""Decimal places of rad, m and s in responses: a count of the sensor is a thousand times larger."""
VARIATION_POINTS = 800
"""Most points of a parameter's variation with time, which is smooth."""


def overlays(signals: Sequence[TraceSignals]) -> tuple[Overlay, ...]:
    """Returns every trace with its simulations."""
    points = int(np.clip(ALL_POINTS // max(1, len(signals)), LEAST_POINTS, MOST_POINTS))
    return tuple(overlay(one, points) for one in signals)


def overlay(one: TraceSignals, points: int) -> Overlay:
    """Returns one trace with its simulations in about `points` points."""
    first = stretches(len(one.time), points)

    def rows(signal: Floats) -> tuple[Row, ...]:
        kept = signal if first is None else extremes(signal, first)
        return tuple(_row(column) for column in kept.T)

    time = one.time if first is None else moments(one.time, first)
    return Overlay(
        trace=one.trace,
        held_out=one.held_out,
        joints=one.joints,
        units=one.units,
        samples=len(one.time),
        time=tuple(np.round(time, DIGITS).tolist()),
        measured=rows(one.measured),
        set_point=None if one.set_point is None else rows(one.set_point),
        simulated=tuple(rows(simulated) for simulated in one.simulated),
        residual=tuple(rows(one.measured - simulated) for simulated in one.simulated),
    )


def thinned_variation(one: TimeDomain) -> TimeDomain:
    """Returns a variation with time at up to VARIATION_POINTS evenly spaced times. Accelerations were smoothed over
    longer times than this spacing."""
    stride = max(1, -(-len(one.time) // VARIATION_POINTS))
    joints = tuple(j.model_copy(update={"values": j.values[::stride]}) for j in one.joints)
    parameters = tuple(
        p.model_copy(update={"values": p.values[::stride], "noise": p.noise[::stride]}) for p in one.parameters
    )
    return one.model_copy(update={"time": one.time[::stride], "joints": joints, "parameters": parameters})


def _row(values: Sequence[float] | Floats) -> Row:
    """Converts values for JSON, which has no NaN and no infinity: these become None."""
    return tuple(v if np.isfinite(v) else None for v in np.round(values, DIGITS).tolist())
