"""Validation by distortion in its time-domain form (section 4.3): what must move, when, and against what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from daq.contracts.progress import Cancel, Never, Progress, silent, stop_if
from daq.contracts.trace import Trace
from model.machine_model.model import Model
from model.validation.acceleration_model import expected_accelerations
from model.validation.expected_deviation import Convention, expected_deviation
from model.validation.measured_motion import Observation, observe
from model.validation.noise_floor import noise_floor
from model.validation.regressors import correlations, regressors
from model.validation.variation import JointResidual, TimeDomain, Variation

Floats = NDArray[np.float64]

SIGNIFICANT = 2.0
"""Standard deviations of noise beyond which a variation counts as real."""


READINGS_ALONE = "the noise floor is that of the readings alone: the model cannot be simulated along this record"


@dataclass(frozen=True)
class _Solution:
    """alpha, noise (k, p); active (k, p) where a moving joint shows the parameter."""

    alpha: Floats
    noise: Floats
    active: NDArray[np.bool_]


def vary_in_time(
    model: Model, trace: Trace, names: Sequence[str], *, convention: Convention = "source",
    smoothing: float | None = None, progress: Progress = silent, cancel: Cancel | None = None,
) -> TimeDomain:  # fmt: skip
    """How the named parameters would have to vary with time for the model to explain a trace.

    At each sample J_a α = q̈ − f is solved for the least α in units of expected deviations, as far as noise allows
    (a Bayes estimate: α ~ N(0, τ′²), and the noise floor of `noise_floor`). Rounding of the drive, motion
    between samples and the delay are accounted for; a rotor's current, heat and sensors' errors are not varied.

    Raises:
        TraceError: for a trace without drive, or too short. SpecError: for an unknown parameter, no motion, or a
            flexible transmission. CancelledError: when cancelled.
    """
    cancel = cancel or Never()
    if not names:
        raise SpecError("no parameters: name at least one")
    observation = observe(model, trace, smoothing)
    progress(0.1, "noise floor")
    floor, simulated = noise_floor(model, trace, observation)
    observation = replace(observation, noise=floor)
    stop_if(cancel)
    progress(0.3, "exact Jacobians along the motion")
    expected, jacobian = expected_accelerations(model, observation.motion, names)
    stop_if(cancel)
    progress(0.7, "solving for the variations")
    residual = np.where(observation.usable, observation.acceleration - expected, 0.0)
    jacobian = np.moveaxis(jacobian, 0, 2) * observation.usable[:, :, None]
    deviations = np.array([expected_deviation(model.parameter(n), convention)[0] for n in names])
    solution = _solve(residual, jacobian, observation, deviations)
    known = regressors(model, observation)
    result = TimeDomain(
        model=model.identity, trace=trace.record.trace_id, convention=convention,
        smoothing=observation.motion.width * observation.motion.period, time=tuple(map(float, observation.motion.time)),
        joints=tuple(_joint(model, j, residual, observation, known) for j in range(model.joint_count)),
        parameters=tuple(
            _variation(model, name, k, solution, residual, jacobian, observation, deviations[k], known)
            for k, name in enumerate(names)
        ),
        notes=tuple(_notes(names, solution, observation, simulated=simulated)),
    )  # fmt: skip
    progress(1.0, "time-domain form: done")
    return result


def _solve(residual: Floats, jacobian: Floats, observation: Observation, deviations: Floats) -> _Solution:
    """α = S Jᵀ (J S Jᵀ + R)⁻¹ r at every sample, with S = τ′² and R the noise; its noise through the same gain."""
    scaled = jacobian * deviations
    noise = np.diag(observation.noise**2)
    spread = scaled @ np.swapaxes(scaled, 1, 2) + noise
    gain = np.swapaxes(np.linalg.solve(spread, scaled), 1, 2)
    alpha = deviations * np.einsum("kpj,kj->kp", gain, residual)
    band = deviations * np.sqrt(np.einsum("kpj,j,kpj->kp", gain, observation.noise**2, gain))
    seen = (np.abs(scaled) > 1e-9 * np.abs(scaled).max(initial=1e-300)) & observation.usable[:, :, None]
    return _Solution(alpha, band, seen.any(axis=1))


def _variation(
    model: Model, name: str, k: int, solution: _Solution, residual: Floats, jacobian: Floats, observation: Observation,
    expected: float, known: dict[str, Floats],
) -> Variation:  # fmt: skip
    parameter = model.parameter(name)
    active, alpha, band = solution.active[:, k], solution.alpha[:, k], solution.noise[:, k]
    some = bool(active.any())
    square = float((alpha[active] ** 2 - band[active] ** 2).mean()) if some else 0.0
    own = [j - 1 for j in parameter.joints] or list(range(model.joint_count))
    constant, varying = _alone(residual, jacobian[:, :, k], observation)
    return Variation(
        name=name, unit=parameter.unit, value=parameter.value, values=_optional(alpha, active),
        noise=_optional(band, active), deviation=float(np.sqrt(max(square, 0.0))), expected=expected,
        mean=float(alpha[active].mean()) if some else 0.0,
        significant=float((np.abs(alpha[active]) > SIGNIFICANT * band[active]).mean()) if some else 0.0,
        alone_constant=constant, alone_varying=varying,
        against=correlations(alpha, active, known, own, observation.motion.width),
    )  # fmt: skip


def _alone(residual: Floats, column: Floats, observation: Observation) -> tuple[float, float]:
    """Shares of the residual's energy, less noise, that one parameter explains: as a constant, and varying."""
    r, j = residual / observation.noise, column / observation.noise
    energy = float((r**2).sum()) - float(observation.usable.sum())
    squares = (j**2).sum(axis=1)
    if energy <= 0 or squares.max(initial=0.0) == 0.0:
        return 0.0, 0.0
    cross = (r * j).sum(axis=1)
    constant = float(cross.sum() ** 2 / squares.sum()) - 1.0
    seen = squares > 1e-12 * squares.max()
    varying = float((cross[seen] ** 2 / squares[seen]).sum()) - float(seen.sum())
    return min(1.0, max(0.0, constant / energy)), min(1.0, max(0.0, varying / energy))


def _joint(model: Model, j: int, residual: Floats, observation: Observation, known: dict[str, Floats]) -> JointResidual:
    usable = observation.usable[:, j]
    values = residual[:, j]
    return JointResidual(
        joint=model.machine.modelled_joints[j], values=_optional(values, usable), noise=float(observation.noise[j]),
        rms=float(np.sqrt((values[usable] ** 2).mean())) if usable.any() else 0.0,
        against=correlations(values, usable, known, [j], observation.motion.width),
    )  # fmt: skip


def _optional(values: Floats, present: NDArray[np.bool_]) -> tuple[float | None, ...]:
    return tuple(float(v) if p else None for v, p in zip(values, present, strict=True))


def _notes(names: Sequence[str], solution: _Solution, observation: Observation, *, simulated: bool) -> list[str]:
    notes = [] if simulated else [READINGS_ALONE]
    notes += [f"{name}: does not act on the accelerations of this record" for k, name in enumerate(names)
             if not solution.active[:, k].any()]  # fmt: skip
    if len(names) > solution.alpha.shape[1] or len(names) > observation.acceleration.shape[1]:
        joints = observation.acceleration.shape[1]
        notes.append(f"{len(names)} parameters for {joints} accelerations a sample: α is the least in units of τ′")
    return notes
