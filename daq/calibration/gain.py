"""Estimates the actual proportional gain from the errors and powers that the controller reports (section 6.5).

With I = D = 0 the controller's law is power = gain · error, rounded to an integer by an undocumented rule: floor,
truncation or nearest. Error and power of one snapshot are the integers that the controller used, so there is no noise
to average out. Each sample limits the gain to |power − gain · error| < 1, and equal errors always give equal powers.
Repeating an error therefore adds no information, and a contradiction between samples shows that the law is different.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.experiment import Gain
from daq.contracts.machine import Machine
from daq.contracts.trace import Floats, Integers, Trace
from firmware_protocol.units import DAC_MAX

FEWEST_ERRORS = 3
"""Least number of different error magnitudes for an estimate (a choice)."""
WIDEST = 0.1
"""Largest relative half-width of the interval of possible gains for an estimate (a choice)."""
ROUNDING = 1 / math.sqrt(12)
"""Standard deviation of a rounding error, uniform over one count; the scatter is taken to be at least this."""


@dataclass(frozen=True)
class GainEstimate:
    """Proportional gain of one joint.

    gain:            DAC counts per ADC count of error, by least squares through the origin
    standard_error:  of the gain
    lowest, highest: range of gains that agree with every sample, whatever the rounding; the ends are excluded
    volts_per_rad:   the gain at the motor (V/rad); its standard error is `volts_per_rad_error`
    per_unit:        gain per unit of the adjustable P; None if P is unknown
    samples, saturated, errors: samples used, samples left out as saturated, and different errors among those used
    """

    joint: int
    gain: float
    standard_error: float
    lowest: float
    highest: float
    volts_per_rad: float
    volts_per_rad_error: float
    per_unit: float | None
    samples: int
    saturated: int
    errors: int

    def __str__(self) -> str:
        return (
            f"joint {self.joint}: {self.gain:.4f} ± {self.standard_error:.4f} DAC counts per ADC count "
            f"(between {self.lowest:.4f} and {self.highest:.4f}), {self.volts_per_rad:.1f} V/rad, "
            f"from {self.errors} different errors in {self.samples} samples"
        )

    def as_data(self) -> dict[str, object]:
        """Plain data for JSON."""
        return asdict(self)


@dataclass(frozen=True)
class NoEstimate:
    """The reason why a joint's data do not determine the gain."""

    joint: int
    reason: str
    samples: int
    saturated: int

    def __str__(self) -> str:
        return f"joint {self.joint}: {self.reason}"

    def as_data(self) -> dict[str, object]:
        """Plain data for JSON."""
        return asdict(self)


def estimate_gain(
    machine: Machine, joint: int, errors: Integers, powers: Integers, gains: Gain | None = None
) -> GainEstimate | NoEstimate:
    """Estimates the gain of `joint` from errors (n,) in ADC counts and powers (n,) in DAC counts, paired by snapshot.

    `gains`: the adjustable (P, I, D), if known. Samples at the DAC's limits are left out. Raises SpecError if the
    arrays differ in shape or the joint has no DC motor.
    """
    if errors.shape != powers.shape or errors.ndim != 1:
        raise SpecError(f"joint {joint}: errors of shape {errors.shape}, powers of {powers.shape}: must be (n,) both")
    inside = np.abs(powers) < DAC_MAX
    saturated = int((~inside).sum())
    errors, powers = errors[inside], powers[inside]
    reason = _other_terms(gains) or _too_little(errors, saturated) or _not_proportional(errors, powers)
    if reason is not None:
        return NoEstimate(joint, reason, len(errors), saturated)
    lowest, highest = _possible_gains(errors, powers)
    gain, standard_error = _least_squares(errors, powers)
    if (highest - lowest) / 2 > WIDEST * abs(gain):
        largest = int(np.abs(errors).max())
        reason = (
            f"errors of up to {largest} ADC counts leave any gain between {lowest:.3f} and {highest:.3f} possible: "
            "make larger steps"
        )
        return NoEstimate(joint, reason, len(errors), saturated)
    volts = machine.joint(joint).dc_motor.scale.counts_to_volts(machine.drive_sign(joint))
    to_volts_per_rad = volts / machine.calibration(joint).rad_per_count
    return GainEstimate(
        joint=joint,
        gain=gain,
        standard_error=standard_error,
        lowest=lowest,
        highest=highest,
        volts_per_rad=gain * to_volts_per_rad,
        volts_per_rad_error=standard_error * abs(to_volts_per_rad),
        per_unit=gain / gains[0] if gains is not None and gains[0] else None,
        samples=len(errors),
        saturated=saturated,
        errors=len(np.unique(errors)),
    )


@dataclass(frozen=True)
class CommonGain:
    """Gain per unit of P common to `joints` (DAC counts per ADC count), and its standard error."""

    joints: tuple[int, ...]
    value: float
    deviation: float


def common_gain(estimates: Sequence[GainEstimate]) -> CommonGain | None:
    """Returns the gain per unit of P that agrees with every sample of every joint; None if there is none, or no P is
    known."""
    known = [(one, one.gain / one.per_unit) for one in estimates if one.per_unit]
    if not known or len(known) < len(estimates):
        return None
    lowest, highest = max(e.lowest / p for e, p in known), min(e.highest / p for e, p in known)
    if lowest >= highest:
        return None
    weights = [(p / e.standard_error) ** 2 for e, p in known]
    mean = sum(w * e.gain / p for w, (e, p) in zip(weights, known, strict=True)) / sum(weights)
    value = mean if lowest < mean < highest else (lowest + highest) / 2
    return CommonGain(tuple(e.joint for e, _ in known), value, 1 / math.sqrt(sum(weights)))


def gains_from_trace(trace: Trace, machine: Machine) -> list[GainEstimate | NoEstimate]:
    """Estimates the gain of every joint of a trace. Raises SpecError if it has no errors or no raw powers."""
    name = trace.record.trace_id
    if trace.error is None or trace.power_raw is None:
        raise SpecError(
            f"trace {name}: it has no {'error' if trace.error is None else 'power_raw'}, the gain needs both"
        )
    results = []
    for column, joint in enumerate(trace.joints):
        errors = np.rint(trace.error[:, column] / machine.calibration(joint).rad_per_count).astype(np.int64)
        gains = (trace.record.gains or {}).get(joint)
        results.append(estimate_gain(machine, joint, errors, trace.power_raw[:, column], gains))
    return results


def _other_terms(gains: Gain | None) -> str | None:
    if gains is None or gains[1:] == (0, 0):
        return None
    return f"gains are P {gains[0]}, I {gains[1]}, D {gains[2]}: set I and D to 0, the law must be proportional"


def _too_little(errors: Integers, saturated: int) -> str | None:
    different = len(np.unique(np.abs(errors[errors != 0])))
    if different >= FEWEST_ERRORS:
        return None
    of_them = f" and {saturated} saturated samples" if saturated else ""
    return f"{different} different errors besides 0{of_them}, at least {FEWEST_ERRORS} unsaturated ones are needed"


def _not_proportional(errors: Integers, powers: Integers) -> str | None:
    """Returns the contradiction between samples, or an empty text."""
    advice = "not proportional: I and D must be 0, and error and power of one snapshot"
    order = np.lexsort((powers, errors))
    same = np.flatnonzero((np.diff(errors[order]) == 0) & (np.diff(powers[order]) != 0))
    if len(same):
        one, other = order[same[0]], order[same[0] + 1]
        return f"powers {powers[one]} and {powers[other]} at the same error {errors[one]}, {advice}"
    at_rest = errors == 0
    if powers[at_rest].any():
        return f"power {powers[at_rest][0]} at error 0, {advice}"
    lowest, highest = _possible_gains(errors, powers)
    if lowest < highest:
        return None
    gain, _ = _least_squares(errors, powers)
    worst = int(np.abs(powers - gain * errors).argmax())
    return f"power {powers[worst]} at error {errors[worst]}, where the others give {gain * errors[worst]:.1f}, {advice}"


def _possible_gains(errors: Integers, powers: Integers) -> tuple[float, float]:
    """Limits of the gains for which |power − gain · error| < 1 in every sample; lower > upper if there are none."""
    size, power = _as_positive(errors, powers)
    return float(((power - 1) / size).max()), float(((power + 1) / size).min())


def _least_squares(errors: Integers, powers: Integers) -> tuple[float, float]:
    """Slope through the origin and its standard error; each different error counts once."""
    distinct, first = np.unique(errors, return_index=True)
    e, p = distinct.astype(np.float64), powers[first].astype(np.float64)
    weight = float(e @ e)
    slope = float(e @ p) / weight
    scatter = math.sqrt(float(((p - slope * e) ** 2).sum()) / max(len(e) - 1, 1))
    return slope, max(scatter, ROUNDING) / math.sqrt(weight)


def _as_positive(errors: Integers, powers: Integers) -> tuple[Floats, Floats]:
    """Nonzero errors as magnitudes, and powers with their sign relative to the error."""
    some = errors != 0
    sign = np.sign(errors[some])
    return np.abs(errors[some]).astype(np.float64), (powers[some] * sign).astype(np.float64)
