"""Validates by distortion in its time-domain form (section 4.3): which parameters must vary, when, and with what?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.trace import Trace
from model.arrays import Floats, Mask
from model.machine_model.model import Model
from model.record_check.check import as_used
from model.validation.acceleration_model import expected_accelerations
from model.validation.expected_deviation import expected_deviation
from model.validation.measured_motion import SmoothedTrace, smooth
from model.validation.noise_floor import noise_floor
from model.validation.regressors import correlations, regressors
from model.validation.variation import JointResidual, TimeDomain, Variation

SIGNIFICANT = 2.0
"""A variation counts as significant above this many standard deviations of its noise."""
READINGS_ALONE = "the noise floor is that of the readings alone: the model cannot be simulated along this record"


@dataclass(frozen=True)
class _Equations:
    """J_a α = r at every sample of a motion.

    residual (k, n) and jacobian (k, n, p) are zero where a joint rests; deviations (p,) are τ′.
    """

    model: Model
    smoothed: SmoothedTrace
    names: tuple[str, ...]
    residual: Floats
    jacobian: Floats
    deviations: Floats


@dataclass(frozen=True)
class _Solution:
    """alpha, noise (k, p); active (k, p): where a joint that the parameter acts on moves."""

    alpha: Floats
    noise: Floats
    active: Mask


def vary_in_time(model: Model, trace: Trace, names: Sequence[str]) -> TimeDomain:
    """Computes how the named parameters would have to vary with time for the model to explain a trace.

    At each sample J_a α = q̈ − f is solved for the least α in units of expected deviations, regularised by noise (a
    Bayes estimate: α ~ N(0, τ′²), and the noise floor of `noise_floor`). The estimate accounts for rounding of the
    drive, motion between samples and the delay. It does not vary a rotor's current, heat or sensor errors.

    Raises:
        TraceError: for a trace without drive, or too short.
        SpecError: for an unknown parameter, no motion, or a flexible transmission.
    """
    if not names:
        raise SpecError("no parameters: name at least one")
    (trace,) = as_used([trace], model.machine)  # along the measured motion no controller is simulated
    smoothed = smooth(model, trace)
    floor, simulated = noise_floor(model, trace, smoothed)
    smoothed = replace(smoothed, noise=floor)
    equations = _equations(model, smoothed, tuple(names))
    solution = _solve(equations)
    known = regressors(model, smoothed)
    motion = smoothed.motion
    return TimeDomain(
        model=model.identity,
        trace=trace.record.trace_id,
        convention="source",
        smoothing=motion.width * motion.period,
        time=tuple(map(float, motion.time)),
        joints=tuple(_joint(equations, j, known) for j in range(model.joint_count)),
        parameters=tuple(_variation(equations, solution, k, known) for k in range(len(names))),
        notes=tuple(_notes(equations, solution, simulated=simulated)),
    )


def _equations(model: Model, smoothed: SmoothedTrace, names: tuple[str, ...]) -> _Equations:
    expected, jacobian = expected_accelerations(model, smoothed.motion, names)
    residual = np.where(smoothed.usable, smoothed.acceleration - expected, 0.0)
    jacobian = np.moveaxis(jacobian, 0, 2) * smoothed.usable[:, :, None]
    deviations = np.array([expected_deviation(model.parameter(n), "source")[0] for n in names])
    return _Equations(model, smoothed, names, residual, jacobian, deviations)


def _solve(given: _Equations) -> _Solution:
    """Returns α = S Jᵀ (J S Jᵀ + R)⁻¹ r at every sample, with S = τ′² and R the noise, and the noise of α."""
    smoothed, deviations = given.smoothed, given.deviations
    scaled = given.jacobian * deviations
    noise = np.diag(smoothed.noise**2)
    spread = scaled @ np.swapaxes(scaled, 1, 2) + noise
    gain = np.swapaxes(np.linalg.solve(spread, scaled), 1, 2)
    alpha = deviations * np.einsum("kpj,kj->kp", gain, given.residual)
    band = deviations * np.sqrt(np.einsum("kpj,j,kpj->kp", gain, smoothed.noise**2, gain))
    seen = (np.abs(scaled) > 1e-9 * np.abs(scaled).max(initial=1e-300)) & smoothed.usable[:, :, None]
    return _Solution(alpha, band, seen.any(axis=1))


def _variation(given: _Equations, solution: _Solution, k: int, known: dict[str, Floats]) -> Variation:
    parameter = given.model.parameter(given.names[k])
    active, alpha, band = solution.active[:, k], solution.alpha[:, k], solution.noise[:, k]
    some = bool(active.any())
    square = float((alpha[active] ** 2 - band[active] ** 2).mean()) if some else 0.0
    own = [j - 1 for j in parameter.joints] or list(range(given.model.joint_count))
    constant, varying = _alone(given, k)
    return Variation(
        name=parameter.name,
        unit=parameter.unit,
        value=parameter.value,
        values=_optional(alpha, active),
        noise=_optional(band, active),
        deviation=float(np.sqrt(max(square, 0.0))),
        expected=given.deviations[k],
        mean=float(alpha[active].mean()) if some else 0.0,
        significant=float((np.abs(alpha[active]) > SIGNIFICANT * band[active]).mean()) if some else 0.0,
        alone_constant=constant,
        alone_varying=varying,
        against=correlations(alpha, active, known, own, given.smoothed.motion.width),
    )


def _alone(given: _Equations, k: int) -> tuple[float, float]:
    """Returns the shares of the residual's energy, without noise, that one parameter explains: if constant, and if
    varying."""
    noise = given.smoothed.noise
    r, j = given.residual / noise, given.jacobian[:, :, k] / noise
    energy = float((r**2).sum()) - float(given.smoothed.usable.sum())
    squares = (j**2).sum(axis=1)
    if energy <= 0 or squares.max(initial=0.0) == 0.0:
        return 0.0, 0.0
    cross = (r * j).sum(axis=1)
    constant = float(cross.sum() ** 2 / squares.sum()) - 1.0
    seen = squares > 1e-12 * squares.max()
    varying = float((cross[seen] ** 2 / squares[seen]).sum()) - float(seen.sum())
    return min(1.0, max(0.0, constant / energy)), min(1.0, max(0.0, varying / energy))


def _joint(given: _Equations, j: int, known: dict[str, Floats]) -> JointResidual:
    smoothed, values = given.smoothed, given.residual[:, j]
    usable = smoothed.usable[:, j]
    return JointResidual(
        joint=given.model.machine.modelled_joints[j],
        values=_optional(values, usable),
        noise=float(smoothed.noise[j]),
        rms=float(np.sqrt((values[usable] ** 2).mean())) if usable.any() else 0.0,
        against=correlations(values, usable, known, [j], smoothed.motion.width),
    )


def _optional(values: Floats, present: Mask) -> tuple[float | None, ...]:
    return tuple(float(v) if p else None for v, p in zip(values, present, strict=True))


def _notes(given: _Equations, solution: _Solution, *, simulated: bool) -> list[str]:
    notes = [] if simulated else [READINGS_ALONE]
    absent = [name for k, name in enumerate(given.names) if not solution.active[:, k].any()]
    notes += [f"{name}: does not influence the accelerations of this record" for name in absent]
    parameters, joints = len(given.names), given.residual.shape[1]
    if parameters > joints:
        notes.append(f"{parameters} parameters for {joints} accelerations per sample: α is the least in units of τ′")
    return notes
