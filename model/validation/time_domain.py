"""Validates by distortion in its time-domain form (section 4.3): which parameters must vary, when, and with what?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import DaqError, SpecError
from daq.contracts.machine import NoController
from daq.contracts.trace import Trace
from model.arrays import Floats, Mask
from model.machine_model.model import Model
from model.record_check.check import as_used
from model.simulation.chain_of_model import gravity_loads
from model.simulation.inputs import inputs_of
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from model.validation.acceleration_model import expected_accelerations
from model.validation.expected_deviation import expected_deviation
from model.validation.measured_motion import SmoothedTrace, smooth, smooth_motion
from model.validation.variation import Correlation, JointResidual, TimeDomain, Variation

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


# --- Noise floor of the time-domain form: the residual (rad/s²) of records that the model itself makes
#
# It has three causes, and only the first follows from a formula.
#
# 1. Differentiation and the model's dependence on speed amplify noise and rounding of the readings
#   (`measured_motion.smooth`).
# 2. Between two samples the drive steps and the speed differs from that of the samples.
# 3. At a reversal friction changes sign, and one count of noise changes the time.
#
# The model therefore simulates the record's set points with drawn noise and rounded readings. The same differentiation
# is applied to the result.


FEWEST, MOST = 12, 40
"""Least and largest number of replicas of a record."""
SECONDS = 400.0
"""Total length of motion (s) of a record's replicas: in a short record friction changes sign only a few times."""
SEED = 1991


def noise_floor(model: Model, trace: Trace, smoothed: SmoothedTrace) -> tuple[Floats, bool]:
    """Returns the root mean square (n,) of each joint's acceleration residual for a right model, rad/s² (m/s²).

    It is the median over simulated records. The second value is whether they could be simulated. If not, and for joints
    that do not move in them, the floor is only the noise of the readings, as in `smoothed`.
    """
    smoothing = smoothed.motion.width * smoothed.motion.period
    rng = np.random.default_rng(SEED)
    replicas = int(np.clip(SECONDS / (trace.time[-1] - trace.time[0]), FEWEST, MOST))
    sizes = np.zeros((replicas, model.joint_count))
    try:
        for replica in sizes:
            own = smooth_motion(model, _made_by(model, trace, rng), smoothing)
            left = np.where(own.usable, own.acceleration - expected_accelerations(model, own.motion, ())[0], 0.0)
            replica[:] = np.sqrt((left**2).sum(axis=0) / np.maximum(own.usable.sum(axis=0), 1))
    except DaqError:
        return smoothed.noise, False
    median = np.median(sizes, axis=0)
    return np.where(median > 0, median, smoothed.noise), True


def _made_by(model: Model, trace: Trace, rng: np.random.Generator) -> Trace:
    """Simulates a record of the model with noise and rounding: in closed loop if there are set points, else from the
    drive."""
    machine = model.machine
    closed = trace.set_point is not None and not isinstance(machine.controller, NoController)
    sensors = [machine.joint(j).sensor for j in machine.modelled_joints]
    deviation = np.array([0.0 if s is None or s.noise is None else s.noise.value for s in sensors])
    noise = deviation * rng.standard_normal((len(inputs_of(trace, machine)), len(sensors)))
    run = simulate(model, trace, Options(loop="closed" if closed else "open", noise=noise))
    columns = [trace.column(j) for j in machine.modelled_joints]
    position = trace.position.copy()
    position[:, columns] = run.at_samples(run.reading)
    if trace.drive is None:
        return replace(trace, position=position)
    drive = trace.drive.copy()
    drive[:, columns] = run.at_samples(run.drive)
    return replace(trace, position=position, drive=drive)


# --- Quantities on which a variation may depend (a joint's position, speed, load and so on), and their correlations


FEWEST_INDEPENDENT = 6
"""Least number of independent samples for a correlation."""


def regressors(model: Model, smoothed: SmoothedTrace) -> dict[str, Floats]:
    """Returns every regressor (samples, joints) of the modelled joints along a motion."""
    motion = smoothed.motion
    return {
        "position": motion.position,
        "speed": motion.speed,
        "magnitude of speed": np.abs(motion.speed),
        "direction": np.sign(motion.speed),
        "load": gravity_loads(model, motion.position),
        "acceleration": smoothed.acceleration,
        "drive": motion.drive,
        "time": np.repeat(motion.time[:, None], motion.position.shape[1], axis=1),
    }


def correlations(
    signal: Floats, present: NDArray[np.bool_], known: dict[str, Floats], joints: list[int], width: float
) -> tuple[Correlation, ...]:
    """Returns correlations of a signal (samples,) with the regressors of some joints, strongest first.

    Args:
        present: (samples,) where the signal is defined.
        known: regressors by name, (samples, joints).
        joints: indices from 0.
        width: the signal was smoothed by a Gaussian of this standard deviation in samples; one sample in 2√π·width
            counts as independent.
    """
    count = present.sum() / max(1.0, 2 * np.sqrt(np.pi) * width)
    if count < FEWEST_INDEPENDENT:
        return ()
    found = []
    for name, values in known.items():
        for j in joints:
            value = _pearson(signal[present], values[present, j])
            if value is not None:
                found.append(Correlation(regressor=name, joint=j + 1, value=value, noise=float(1 / np.sqrt(count))))
    return tuple(sorted(found, key=lambda c: -abs(c.value)))


def _pearson(x: Floats, y: Floats) -> float | None:
    x, y = x - x.mean(), y - y.mean()
    size = float(np.sqrt((x**2).sum() * (y**2).sum()))
    # a constant regressor (one direction only, one posture) has no correlation
    if size <= 1e-9 * len(x) * max(1e-300, float(np.abs(x).max() * np.abs(y).max())):
        return None
    return float((x * y).sum() / size)
