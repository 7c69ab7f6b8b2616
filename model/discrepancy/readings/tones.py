"""Spectra of the residual as a torque: they propose the rate of a ripple (waves a turn) or of a disturbance (Hz).

The response of a joint's reading to a torque on it is described by a finite impulse response, fitted to what a few
small simulated tones change. Because of friction it is right only on average, but a proposal is all that is needed: the
fit that follows uses the model itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.fft import fft, ifft, next_fast_len

from model.arrays import Floats
from model.discrepancy.engine.fitting import Fit
from model.discrepancy.engine.probing import Projection, Trial
from model.discrepancy.engine.residual import Samples
from model.discrepancy.excitation import PERIODS, own_frequencies
from model.discrepancy.readings.observation import DIFFERENCE, Observation
from model.discrepancy.readings.residual import ReadingResidual
from model.discrepancy.readings.trials import tone_trial
from model.discrepancy.thresholds import THRESHOLDS
from model.effects.effect import Tone
from model.effects.library import effect, library
from model.fitting.phases import phase_unknowns
from model.fitting.records import Record
from model.machine_model.effect_parameters import effect_parameters
from model.machine_model.model import Model

RESPONSE = 1.5
"""Length of the impulse response, s. In a simulation that follows the record, the controller hardly sees a deviation,
so it decays slowly."""
TRIAL_RATES = {Tone.OVER_POSITION: (23.0, 47.0), Tone.OVER_TIME: (0.7, 2.1, 4.3)}
"""Rates of the tones that the response is fitted to: rad of phase per unit of the joint's travel; Hz."""
USUAL_TONES = 500
"""Tones tried per effect and joint. Longer records get more, so that no tone is skipped."""
HIGHEST = 8.0
"""Highest frequency that is tried, Hz: the arm follows no faster."""
SHORTEST_WAVE = 4096 / 75
"""Shortest wave that is tried, in counts of the sensor: an assumption. On 12 bits over 270° it is a hundredth of a
joint turn, which the fastest ramp of the presets, 20 counts a period, still samples more than twice."""
PEAKS = 6
"""Peaks of a spectrum that are probed."""
AROUND = np.linspace(-1.0, 1.0, 9)
"""Rates that are probed about the best, in distances of two that records can distinguish."""
BLOCK = 4_000_000
"""Samples of tones in memory at a time: 64 MB."""


def propose_tones(clear: Projection, compared: ReadingResidual, joints: Sequence[int]) -> list[Trial]:
    """The best ripple and the best disturbance of every joint; only the other one for a joint that has one of them
    already."""
    found = []
    for joint in joints:
        absent = _absent(clear.now.model, joint)
        if not absent:
            continue
        shown_by = _most_moving(compared.observation, joint)
        if shown_by is None:
            continue
        response = torque_response(clear.now, compared, joint, shown_by)
        for name, over in absent.items():
            best = _best_tone(clear, compared, name, over, joint, response)
            if best is not None:
                found.append(best)
    return found


def rates_tried(observation: Observation, name: str, joint: int) -> Floats:
    """Rates (k,) in equal steps: Hz of a disturbance, or rad of a ripple per unit of the joint's travel (waves a turn).
    Empty if the joint moves by less than one wave.

    Tones that differ by less than one over the record's duration (its travel) cannot be distinguished. Steps are half
    (an eighth) of that; wider, up to that itself, where they would be more than USUAL_TONES.
    """
    machine = observation.machine
    column = machine.modelled_joints.index(joint)
    over = effect(name).tone
    if over is None:
        return np.zeros(0)
    high = next(p.high for p in effect_parameters(machine, name, (joint,), shared=False) if p.part == over)
    alike = _alike(observation, over, column)
    if over is Tone.OVER_POSITION:
        sensor = machine.joint(joint).sensor
        if sensor is not None and sensor.count and sensor.measures == "position":
            high = min(high, 2 * np.pi / (SHORTEST_WAVE * sensor.count))
        low, step = alike / 2, alike / 8
    else:
        high = min(high, HIGHEST, 0.4 / observation.records[0].inputs.period)
        low, step = PERIODS * alike, alike / 2
    if not low < high:
        return np.zeros(0)
    span = high - low
    return np.linspace(low, high, int(max(2.0, min(span / step, max(USUAL_TONES, math.ceil(span / alike) + 1)))))


def _alike(observation: Observation, over: Tone, column: int) -> float:
    """Distance of two rates that the records can just distinguish: a wave over the travel of a joint (index), in rad of
    phase per rad (m), or one over the duration, in Hz. Infinite for a joint at rest."""
    if over is Tone.OVER_TIME:
        return 1 / max(len(r.inputs) * r.inputs.period for r in observation.records)
    travel = max(float(np.ptp(r.measured[:, column])) for r in observation.records)
    return 2 * np.pi / travel if travel > 0 else math.inf


def _of_the_excitation(rates: Floats, observation: Observation) -> NDArray[np.bool_]:
    """Which frequencies, (k,), are those of the motion that was asked for; of the motion itself without set points."""
    asked = [r.inputs.set_points if r.inputs.has_set_points else r.measured for r in observation.records]
    speeds = [np.diff(positions, axis=0) for positions in asked]
    return own_frequencies(rates, speeds, observation.records[0].inputs.period)


def _most_moving(observation: Observation, joint: int) -> int | None:
    """The record in which a joint travels furthest, of those at least twice as long as a response; None without any."""
    column = observation.machine.modelled_joints.index(joint)
    travels = [
        float(np.ptp(r.measured[:, column])) if len(r.measured) >= 2 * _samples(r) else -1.0
        for r in observation.records
    ]
    best = int(np.argmax(travels))
    return None if travels[best] < 0.0 else best


def _samples(record: Record) -> int:
    """Samples of an impulse response at a record's rate."""
    return max(2, round(RESPONSE / record.inputs.period))


def torque_response(now: Fit, compared: ReadingResidual, joint: int, record: int = 0) -> Floats:
    """Impulse response (s,) of a joint's reading to a torque on it, rad/(N·m), as one record shows it.

    It is found with kinds of tones that the joint does not have yet, because changing those it has would show what
    their own amplitude does. Raises ValueError where it has both.
    """
    observation = compared.observation
    column, model = now.model.machine.modelled_joints.index(joint), now.model
    absent = _absent(model, joint)
    if not absent:
        raise ValueError(f"joint {joint} has every kind of tone already")
    for name in absent:
        model = model.with_effect(name, (joint,))
    moved, sizes, waves = [], [], []
    for name, over in absent.items():
        for value in TRIAL_RATES[over]:
            sine = model.parameter(f"joint{joint}.{name}.sine")
            size = DIFFERENCE * (sine.deviation or 1.0)
            rate = f"joint{joint}.{name}.{over}"
            moved.append({**now.values, rate: value, sine.name: sine.value + size})
            sizes.append(size)
            waves.append(np.sin(_phase(now, observation, over, column, np.array([value]), record)[0]))
    every = replace(compared, model=model, samples=whole_record(observation, record, column))
    shown = -every.changes(now.values, moved) / np.array(sizes)[:, None]
    count = _samples(observation.records[record])
    rows = [_lagged(wave, count) for wave in waves]
    regressor = np.concatenate([r[count:] for r in rows])
    target = np.concatenate([s[count:] for s in shown])
    gram = regressor.T @ regressor
    gram[np.diag_indices_from(gram)] += 1e-6 * np.trace(gram) / count
    return np.asarray(np.linalg.solve(gram, regressor.T @ target))


def whole_record(observation: Observation, record: int, column: int) -> Samples:
    """All samples of one joint (index) in one record, those that are not compared too."""
    every = ((record, slice(0, len(observation.records[record].measured))),)
    joints = len(observation.deviations)
    return Samples(tuple(every if j == column else () for j in range(joints)), np.ones(joints))


def _absent(model: Model, joint: int) -> dict[str, Tone]:
    """The effects that are tones and that a joint does not have."""
    known = {name: own.tone for name, own in library().items() if own.tone is not None}
    return {n: t for n, t in known.items() if not any(u.name == n and joint in u.joints for u in model.effects)}


def _lagged(wave: Floats, count: int) -> Floats:
    padded = np.concatenate([np.zeros(count - 1), wave])
    return np.ascontiguousarray(np.lib.stride_tricks.sliding_window_view(padded, count)[:, ::-1])


def _phase(now: Fit, observation: Observation, over: Tone, column: int, values: Floats, record: int = 0) -> Floats:
    """Phase (k, m) of tones of the given cycles or frequencies along a record."""
    source = observation.records[record]
    if over is Tone.OVER_POSITION:
        angle = source.measured[:, column] - now.signals[record][:, column]
        return values[:, None] * angle[None]
    time = (source.inputs.rows + 0.0) * source.inputs.period
    return 2 * np.pi * values[:, None] * time[None]


def _passed(
    now: Fit, observation: Observation, over: Tone, column: int, values: Floats, response: Floats, record: int
) -> NDArray[np.complex128]:
    """Readings (k, m) that tones of unit torque cause, the cosine as real part and the sine as imaginary part."""
    source = observation.records[record]
    waves = np.exp(1j * _phase(now, observation, over, column, values, record))
    if over is Tone.OVER_POSITION:
        samples = waves.shape[1]
        room = next_fast_len(samples + len(response) - 1)
        waves = ifft(fft(waves, room, axis=1) * fft(response, room), axis=1)[:, :samples]
    else:  # a frequency passes a linear response as it is, but for its size and phase
        lags = np.arange(len(response)) * source.inputs.period
        waves *= np.exp(-2j * np.pi * values[:, None] * lags) @ response[:, None]
    return np.concatenate([waves[:, run] for run in source.runs], axis=1)


def _best_tone(
    clear: Projection, compared: ReadingResidual, name: str, over: Tone, joint: int, response: Floats
) -> Trial | None:
    """The tone that explains most of what is left, once the tolerance parameters have moved too.

    A response that is right only on average lets waves of other rates look alike: the highest peaks of the spectrum are
    probed in the simulation, and then rates around the best, closer than two that can be distinguished.
    """
    now, observation = clear.now, compared.observation
    column = now.model.machine.modelled_joints.index(joint)
    rates = rates_tried(observation, name, joint)
    if over is Tone.OVER_TIME:
        rates = rates[~_of_the_excitation(rates, observation)]
    if not len(rates):
        return None
    columns = compared.samples.columns[column]
    blocks = math.ceil(len(rates) * (columns.stop - columns.start) / BLOCK)
    gains = np.concatenate(
        [_gains(clear, observation, over, column, own, response) for own in np.array_split(rates, max(1, blocks))]
    )
    places, model = max(USUAL_TONES, len(rates)), now.fitted_model

    rate = f"joint{joint}.{name}.{over.value}"

    def trial(tried: Floats) -> Trial | None:
        found = tone_trial(model, name, joint, over, tried, float(rates[0]), places, observation)
        if found is None or over is Tone.OVER_POSITION:
            return found
        unknowns = phase_unknowns(found.model, len(observation.records))
        own = [u.name for u in unknowns if (u.parameter.effect, u.joints) == (name, (joint,))]
        chosen = np.array([start[rate] for start in found.starts])
        parts = _by_record(clear, observation, over, column, chosen, response)
        phases = np.array([np.arctan2(second, first) for _, first, second in parts])
        starts = (
            {**start, **dict(zip(own, (phases[1:, k] - phases[0, k]).tolist(), strict=True))}
            for k, start in enumerate(found.starts)
        )
        return replace(found, starts=tuple(starts), phases=len(own))

    proposed = trial(rates[_peaks(gains)])
    if proposed is None or gains.max() < THRESHOLDS.interesting:
        return proposed
    best = clear.nearest(proposed)[rate] + _alike(observation, over, column) * AROUND
    around = trial(np.clip(best, rates[0], rates[-1]))
    return None if around is None else replace(around, starts=(clear.nearest(around),))


def _gains(
    clear: Projection, observation: Observation, over: Tone, column: int, rates: Floats, response: Floats
) -> Floats:
    """How much tones of these rates take off the cost, (k,), by the spectrum."""
    return np.sum([gain for gain, _, _ in _by_record(clear, observation, over, column, rates, response)], axis=0)


def _by_record(
    clear: Projection, observation: Observation, over: Tone, column: int, rates: Floats, response: Floats
) -> list[tuple[Floats, Floats, Floats]]:
    """What tones of these rates take off the cost, and their sines and cosines, up to their sign, (k,) each: in each
    record, where each begins at a phase of its own; in all together, where the position decides it."""
    now, every = clear.now, range(len(observation.records))
    waves = [_passed(now, observation, over, column, rates, response, t) for t in every]
    shown = np.concatenate(waves, axis=1)
    sine, cosine = (now.weighted(-part, column) for part in (shown.imag, shown.real))
    columns = now.compared.samples.columns[column]
    if over is Tone.OVER_POSITION:
        return [_explained(clear, sine, cosine, columns)]
    edges = np.cumsum([0, *(wave.shape[1] for wave in waves)])
    return [
        _explained(clear, sine[:, a:b], cosine[:, a:b], slice(columns.start + a, columns.start + b))
        for a, b in pairwise(edges.tolist())
    ]


def _peaks(gains: Floats) -> NDArray[np.int64]:
    """Places of the highest peaks of a spectrum (k,), the highest first."""
    padded = np.concatenate([[-np.inf], gains, [-np.inf]])
    peaks = np.flatnonzero((gains >= padded[:-2]) & (gains >= padded[2:]))
    return np.asarray(peaks[np.argsort(-gains[peaks])][:PEAKS])


def _explained(clear: Projection, sine: Floats, cosine: Floats, columns: slice) -> tuple[Floats, Floats, Floats]:
    """How much pairs of signals (k, m) take off the cost, and how much of each does, up to the sign, (k,) each."""
    sines, cosines, mixed, by_sine, by_cosine = clear.pairs(sine, cosine, columns)
    determinant = np.maximum(sines * cosines - mixed**2, 1e-9 * sines * cosines + 1e-30)
    first = (cosines * by_sine - mixed * by_cosine) / determinant
    second = (sines * by_cosine - mixed * by_sine) / determinant
    return np.asarray(first * by_sine + second * by_cosine), first, second
