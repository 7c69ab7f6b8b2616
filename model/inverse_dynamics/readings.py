"""Signals of a trace on an even grid: their noise, the usable bandwidth of accelerations, and the residual torque due
to noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfreqz, welch

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.joint_matching import matched
from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from model.arrays import Floats, Mask
from model.dynamics.recursive import mass_matrix
from model.machine_model.model import Model
from model.record_check.readings import is_bridged
from model.simulation.chain_of_model import chain_of

CUTOFFS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0)
"""Cutoffs that `choose_cutoff` tries, Hz."""
NOISE_SHARE = 0.1
"""Largest noise of an acceleration, as a share of its root mean square, at which a cutoff is accepted."""
QUIET_BAND = (0.3, 0.45)
"""Band, as a share of the sampling rate, in which a record is assumed to contain only noise."""
APART = 5.0
"""Deviations of noise by which a reading must differ from the integral of a speed to count as independent of it. The
integral of white noise walks; the detrended walk's root mean square is half of its end's deviation."""
FEWEST = 32
"""Samples that a trace needs to estimate its noise."""
POSTURES = 20
"""Postures of each record over which its inertia is averaged for the noise floor."""


@dataclass(frozen=True)
class Readings:
    """A trace on an even grid of its own sampling interval, not smoothed. speed: (k, n), None if it is not measured.

    name: the trace's ID. called: its name in messages.
    """

    name: str
    time: Floats
    position: Floats
    speed: Floats | None
    drive: Floats
    period: float
    called: str

    @property
    def _noise_density(self) -> Floats:
        """Noise density of the speed, or of the position if no speed is measured."""
        return _quiet_density(self.position if self.speed is None else self.speed, self.period)

    @property
    def has_own_speed(self) -> Mask:
        """(n,) whether a joint's speed was measured by another sensor than its position.

        Speeds that are computed from the readings contain the sensor's errors of scale and bend, too. A tachometer's do
        not: the readings then differ from the integral of its speed by more than its noise. A constant, a drift and a
        delay of the speed do not count.
        """
        none = np.zeros(self.position.shape[1], dtype=bool)
        if self.speed is None:
            return none
        walk = np.sqrt(0.5 * _quiet_density(self.speed, self.period) * (self.time[-1] - self.time[0]))
        reading = np.sqrt(0.5 * _quiet_density(self.position, self.period) / self.period)
        away = self.position - cumulative_trapezoid(self.speed, dx=self.period, axis=0, initial=0)
        for j in range(len(none)):
            harmless = np.column_stack([np.ones(len(self.time)), self.time, self.speed[:, j]])
            left = away[:, j] - harmless @ np.linalg.lstsq(harmless, away[:, j], rcond=None)[0]
            none[j] = np.sqrt(np.mean(left**2)) > APART * (walk[j] + reading[j])
        return none

    def speed_noise(self, cutoff: float) -> Floats:
        """Returns the standard deviation (n,) of the speed's noise below a cutoff, rad/s (m/s)."""
        power = cutoff if self.speed is not None else (2 * np.pi) ** 2 * cutoff**3 / 3
        return np.asarray(np.sqrt(self._noise_density * power))

    def acceleration_noise(self, cutoff: float) -> Floats:
        """Returns the standard deviation (n,) of the acceleration's noise below a cutoff, rad/s² (m/s²)."""
        power = (2 * np.pi) ** 2 * cutoff**3 / 3 if self.speed is not None else (2 * np.pi) ** 4 * cutoff**5 / 5
        return np.asarray(np.sqrt(self._noise_density * power))

    def acceleration_power(self, cutoff: float) -> Floats:
        """Returns the root mean square (n,) of the acceleration below a cutoff, noise included."""
        signal = self.position if self.speed is None else self.speed
        order = 2 if self.speed is None else 1
        frequency = np.fft.rfftfreq(len(signal), self.period)
        taper = np.hanning(len(signal))[:, None]
        spectrum = np.fft.rfft((signal - signal.mean(axis=0)) * taper, axis=0)
        weights = (2 * np.pi * frequency[:, None]) ** order * (frequency[:, None] <= cutoff)
        return np.asarray(np.sqrt(2 * (np.abs(spectrum * weights) ** 2).sum(axis=0) / (taper**2).sum() / len(signal)))


def _quiet_density(signal: Floats, period: float) -> Floats:
    """Returns the one-sided power density (n,) per Hz of the noise of a signal (k, n), from the band without motion."""
    rate = 1 / period
    frequency, density = welch(np.diff(signal, axis=0) / period, rate, nperseg=min(len(signal) - 1, 1024), axis=0)
    band = (frequency > QUIET_BAND[0] * rate) & (frequency < QUIET_BAND[1] * rate)
    difference = (2 * np.sin(np.pi * frequency[band] * period) / period) ** 2
    return np.asarray(np.median(density[band] / difference[:, None], axis=0))


def readings_of(trace: Trace, machine: Machine) -> Readings:
    """Returns position, speed and drive of the modelled joints on an even grid.

    If the machine's sensors measure speed, positions are its integral from the first one recorded.

    Raises TraceError for a trace without drive, of another machine or of more joints than it has, with a long gap, or
    with too few samples.
    """
    trace = matched(trace, machine)
    name = trace.record.trace_id
    if trace.drive is None:
        raise TraceError(f"{trace.called}: has no recorded drive, without which torques cannot be compared")
    if trace.record.machine is not None and trace.record.machine.name != machine.name:
        raise TraceError(
            f"{trace.called}: recorded on {trace.record.machine.name}, but the model describes {machine.name}"
        )
    if len(trace) < FEWEST:
        raise TraceError(f"{trace.called}: {len(trace)} samples; a comparison of torques needs at least {FEWEST}")
    if max(trace.joints) > len(machine.joints):
        raise TraceError(f"{trace.called}: has a joint {max(trace.joints)}; {machine.name} has {len(machine.joints)}")
    units = [unit for j in machine.modelled_joints for unit in machine.joint(j).drive_units]
    if trace.record.drive_unit not in (None, *units):
        allowed = " or ".join(dict.fromkeys(units))
        raise TraceError(
            f"{trace.called}: the drive is in {trace.record.drive_unit}, but that of {machine.name} in {allowed}"
        )
    columns = [trace.column(j) for j in machine.modelled_joints]
    steps = np.diff(trace.time)
    period = float(np.median(steps))
    if not is_bridged(float(steps.max()), period):
        place = f"a gap of {steps.max():.3g} s after {trace.time[int(steps.argmax())]:.3f} s"
        raise TraceError(f"{trace.called}: {place}; use a piece without any")
    time = np.arange(trace.time[0], trace.time[-1], period)

    def resample(signal: Floats) -> Floats:
        return np.stack([np.interp(time, trace.time, signal[:, c]) for c in columns], axis=1)

    position = resample(trace.position)
    speed = None if trace.velocity is None else resample(trace.velocity)
    sensors = [machine.joint(j).sensor for j in machine.modelled_joints]
    if any(s is not None and s.measures == "velocity" for s in sensors):
        if speed is None:
            raise TraceError(f"{trace.called}: has no velocity, which the sensors of {machine.name} measure")
        position = position[0] + cumulative_trapezoid(speed, dx=period, axis=0, initial=0)
    return Readings(name, time, position, speed, resample(trace.drive), period, trace.called)


def choose_cutoff(traces: Sequence[Trace], machine: Machine) -> float:
    """Returns the highest cutoff (Hz) with little noise of acceleration on every joint that moves.

    Raises SpecError if there is none, because nothing moves beyond the noise of its readings.
    """
    readings = [readings_of(t, machine) for t in traces]
    found = None
    for cutoff in CUTOFFS:
        if cutoff > min(0.4 / r.period for r in readings):
            break
        noise = np.sqrt(np.mean([r.acceleration_noise(cutoff) ** 2 for r in readings], axis=0))
        whole = np.sqrt(np.mean([r.acceleration_power(cutoff) ** 2 for r in readings], axis=0))
        moving = whole > 3 * noise
        if moving.any() and (noise[moving] < NOISE_SHARE * whole[moving]).all():
            found = cutoff
    if found is None:
        called = " and ".join(t.called for t in traces)
        raise SpecError(
            f"{called}: no joint accelerates beyond the noise of its readings, so there is nothing to explain; times "
            "must be in s, positions in rad or m"
        )
    return found


def torque_noise(model: Model, traces: Sequence[Trace], cutoff: float) -> Floats:
    """Returns the standard deviation (n,), N·m or N, of a residual torque due to the readings' noise in accelerations.

    The recorded drive counts as exact: its fast part is mostly real, the controller's reaction to noise of the
    readings.
    """
    chain = chain_of(model)
    squares = []
    for trace in traces:
        readings = readings_of(trace, model.machine)
        step = max(1, len(readings.time) // POSTURES)
        postures = np.ascontiguousarray(readings.position[::step])
        masses = np.mean([mass_matrix(chain, q) ** 2 for q in postures], axis=0)
        squares.append(masses @ readings.acceleration_noise(cutoff) ** 2)
    return np.asarray(np.sqrt(np.mean(squares, axis=0)))


# --- Smooths evenly sampled signals and computes their derivatives, without delay


ORDER = 4
"""Order of the Butterworth low-pass, which runs forwards and backwards."""
CONTINUED = 4.0
"""Periods of the cutoff by which a signal is extended at both ends before it is low-passed."""


def low_pass(signal: Floats, cutoff: float, period: float) -> Floats:
    """Applies Butterworth's low-pass forwards and backwards along the first axis, thus without delay.

    The gain is that of `scipy.signal.sosfiltfilt` at every frequency, with odd extension at both ends, but it takes a
    quarter of the time. This matters because a diagnosis does little else. The signal is unchanged if the Nyquist
    frequency is below the cutoff.

    Args:
        signal: (k, …). cutoff: Hz. period: between samples, s.
    """
    if cutoff >= 0.45 / period:
        return signal
    count = len(signal)
    padding = min(count - 1, int(CONTINUED / (cutoff * period)))
    whole = next_fast_len(count + 2 * padding, real=True)
    after = min(count - 1, whole - count - padding)
    whole = count + padding + after
    # the filter does not change a straight line; without it the extended signal ends where it begins, however far a
    # wheel turned
    share = np.linspace(0.0, 1.0, count).reshape(-1, *([1] * (signal.ndim - 1)))
    line = signal[0] + (signal[-1] - signal[0]) * share
    level = signal - line
    before, behind = -level[padding:0:-1], -level[-2 : -after - 2 : -1]
    gain = _gain(2 * cutoff * period, whole).reshape(-1, *([1] * (signal.ndim - 1)))
    spectrum = rfft(np.concatenate([before, level, behind]), axis=0)
    return np.asarray(line + irfft(spectrum * gain, whole, axis=0)[padding : padding + count])


def derivative(signal: Floats, period: float) -> Floats:
    """Returns the derivative along the first axis of a signal (k, …) by cubic splines, in the signal's unit per s.

    Central differences lose (2πf·period)²/6 at frequency f: 1.5 % at 12 Hz with 250 samples per second, and twice that
    for an acceleration. Splines lose the fourth power of that over 180, about a ten-thousandth.

    Args:
        period: between samples, s.
    """
    return np.asarray(CubicSpline(period * np.arange(len(signal)), signal)(period * np.arange(len(signal)), 1))


@lru_cache(maxsize=64)
def _gain(share: float, count: int) -> Floats:
    """Returns the gain of both passes at the frequencies of `count` samples, for a cutoff relative to half their
    rate."""
    sections = butter(ORDER, share, output="sos")
    _, response = sosfreqz(sections, 2 * np.pi * np.arange(count // 2 + 1) / count)
    return np.asarray(np.abs(response) ** 2)
