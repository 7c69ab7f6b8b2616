"""Spectra of the residual as a torque: which angle or time frequency a ripple or a disturbance would have.

The response of a joint's reading to a torque on it is taken as a finite impulse response, fitted to what a
few small simulated tones change. It is only right on average, friction being what it is, but a proposal is all that is
needed: the fit that follows uses the model itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.fft import fft, ifft, next_fast_len

from model.discrepancy.candidates import TONES, tone
from model.discrepancy.observation import DIFFERENCE, Observation
from model.discrepancy.probing import Probed, Projection, projection
from model.discrepancy.search import Point

Floats = NDArray[np.float64]

RESPONSE_SAMPLES = 30
"""Length of the impulse response: 0.6 s at 20 ms."""
TRIAL_FREQUENCIES = (0.7, 2.1, 4.3)
"""Hz"""
TRIAL_CYCLES = (23.0, 47.0)
"""Per unit of the joint's travel, times 2π."""
MOST_TONES = 500
HIGHEST = 8.0
"""Hz; the arm follows no faster."""
SHORTEST_WAVES = 12.0
"""Counts of the sensor that a wave must be long to be seen."""


def proposed_tones(observation: Observation, point: Point, joints: Sequence[int]) -> list[Probed]:
    """The best ripple and the best disturbance of every joint, the most promising first."""
    clear, found = projection(point), []
    places = point.model.machine.modelled_joints
    for joint in joints:
        column = places.index(joint)
        response = torque_response(observation, point, joint)
        for name in TONES:
            best = _best_tone(observation, point, clear, name, joint, column, response)
            if best is not None:
                found.append(best)
    return sorted(found, key=lambda p: -p.gain)


def torque_response(observation: Observation, point: Point, joint: int) -> Floats:
    """Impulse response (RESPONSE_SAMPLES,) of a joint's reading to a torque on it, rad/(N·m)."""
    places = point.model.machine.modelled_joints
    column, model = places.index(joint), point.model
    for name in TONES:
        if not any(u.name == name and joint in u.joints for u in model.effects):
            model = model.with_effect(name, (joint,))
    vector, initials = observation.state(model, point.unknowns, point.values)
    vectors, sizes, waves = [vector], [], []
    for name, shape, values in zip(TONES, ("cycles", "frequency"), (TRIAL_CYCLES, TRIAL_FREQUENCIES), strict=True):
        for value in values:
            row = vector.copy()
            row[list(model.parameter(f"joint{joint}.{name}.{shape}").slots)] = value
            sine = model.parameter(f"joint{joint}.{name}.sine")
            size = DIFFERENCE * (sine.deviation or 1.0)
            row[list(sine.slots)] += size
            vectors.append(row)
            sizes.append(size)
            waves.append(np.sin(_phase(observation, point, name, column, np.array([value]))[0]))
    starts = [np.tile(i, (len(vectors), 1, 1)) for i in initials]
    shown = observation.readings(model, np.array(vectors), starts, point.noise)[0][..., column]
    shown = (shown[1:] - shown[:1]) / np.array(sizes)[:, None]
    rows = [_lagged(wave) for wave in waves]
    regressor = np.concatenate([r[RESPONSE_SAMPLES:] for r in rows])
    target = np.concatenate([s[RESPONSE_SAMPLES:] for s in shown])
    gram = regressor.T @ regressor
    gram[np.diag_indices_from(gram)] += 1e-6 * np.trace(gram) / RESPONSE_SAMPLES
    return np.asarray(np.linalg.solve(gram, regressor.T @ target))


def _lagged(wave: Floats) -> Floats:
    padded = np.concatenate([np.zeros(RESPONSE_SAMPLES - 1), wave])
    return np.ascontiguousarray(np.lib.stride_tricks.sliding_window_view(padded, RESPONSE_SAMPLES)[:, ::-1])


def _phase(observation: Observation, point: Point, name: str, column: int, values: Floats, record: int = 0) -> Floats:
    """Phase (k, m) of tones of the given cycles or frequencies along a record."""
    source = observation.records[record]
    if name == "torque_ripple":
        angle = source.measured[:, column] - point.residuals[record][:, column]
        return values[:, None] * angle[None]
    time = (source.inputs.rows + 0.0) * source.inputs.period
    return 2 * np.pi * values[:, None] * time[None]


def _grid(observation: Observation, point: Point, name: str, column: int) -> Floats:
    if name == "torque_ripple":
        travel = max(float(np.ptp(r.measured[:, column])) for r in observation.records)
        shortest = SHORTEST_WAVES * observation.unit[column]
        low, high, step = np.pi / travel, 2 * np.pi / shortest, np.pi / (4 * travel)
        high = min(high, 100.0) if point.model.machine.modelled_joints and travel > shortest else high
    else:
        longest = max(len(r.inputs) * r.inputs.period for r in observation.records)
        low, high, step = 2.0 / longest, min(HIGHEST, 0.4 / observation.records[0].inputs.period), 0.5 / longest
    if not low < high:
        return np.zeros(0)
    return np.linspace(low, high, int(min(MOST_TONES, max(2.0, (high - low) / step))))


def _passed(
    observation: Observation, point: Point, name: str, column: int, values: Floats, response: Floats, record: int
) -> NDArray[np.complex128]:
    """Readings (k, m) that tones of unit torque make, the cosine as real part and the sine as imaginary part."""
    source = observation.records[record]
    waves = np.exp(1j * _phase(observation, point, name, column, values, record))
    if name == "torque_ripple":
        samples = waves.shape[1]
        room = next_fast_len(samples + RESPONSE_SAMPLES - 1)
        waves = ifft(fft(waves, room, axis=1) * fft(response, room), axis=1)[:, :samples]
    else:  # a frequency passes a linear response as it is, but for its size and phase
        lags = np.arange(RESPONSE_SAMPLES) * source.inputs.period
        waves *= np.exp(-2j * np.pi * values[:, None] * lags) @ response[:, None]
    return np.concatenate([waves[:, run] for run in source.runs], axis=1)


def _best_tone(
    observation: Observation, point: Point, clear: Projection, name: str, joint: int, column: int, response: Floats
) -> Probed | None:
    values = _grid(observation, point, name, column)
    if not len(values):
        return None
    columns = np.arange(column, len(point.weighted), len(observation.deviations))
    waves = [_passed(observation, point, name, column, values, response, t) for t in range(len(observation.records))]
    both = np.concatenate(waves, axis=1) / observation.deviations[column]
    sine, cosine = np.ascontiguousarray(both.imag), np.ascontiguousarray(both.real)
    by_sine, sines = clear.gains(sine, columns)
    by_cosine, cosines = clear.gains(cosine, columns)
    mixed = clear.cross(sine, cosine, columns)
    determinant = np.maximum(sines * cosines - mixed**2, 1e-9 * sines * cosines + 1e-30)
    first = (cosines * by_sine - mixed * by_cosine) / determinant
    second = (sines * by_cosine - mixed * by_sine) / determinant
    gains = first * by_sine + second * by_cosine
    best = int(np.argmax(gains))
    shape = "cycles" if name == "torque_ripple" else "frequency"
    trial = {"sine": float(first[best]), "cosine": float(second[best]), shape: float(values[best])}
    candidate = tone(point.model, name, joint, trial)
    if candidate is None:
        return None
    response = np.zeros_like(point.weighted)
    response[columns] = first[best] * sine[best] + second[best] * cosine[best]
    return Probed(candidate, float(gains[best]), candidate.trials[0], clear.moves(response), response)
