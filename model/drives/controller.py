"""Sampled controllers of one joint, one call per period."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from model import layout as at
from model.drives.piecewise import clamped, magnitude, rounded_half_up
from model.dynamics.compilation import compiled_borrowing
from model.dynamics.wide_numbers import where, whole

POWER_MAX = 127.0
"""Largest magnitude of the 8-bit DAC's signed input."""
INTEGRAL_SHARE = 64.0
"""Counts of summed error for one DAC count at I = 1: an assumption, the source does not give the scale."""

# State of a controller between periods.
SUM, LAST_ERROR, INNER_SUM, LAST_INNER_ERROR, LAST_READING = range(5)
MEMORY = 5

# Columns of the gains: the (outer) controller, then the inner one of a cascade, then DAC counts per ADC count, and of a
# sampled controller the resolution of its output and the dead band of its error (0: none).
P, I, D, INNER_P, INNER_I, INNER_D, SCALE, RESOLUTION, DEAD_BAND = range(9)  # noqa: E741
GAINS = 9


@compiled_borrowing
def board_pid(error: complex, gains: NDArray[Any], joint: NDArray[Any], quantise: bool, memory: NDArray[Any]) -> Any:
    """Returns the power (DAC counts, ±127) for an error in ADC counts, by the board's integer arithmetic (section 6.2).

    power = P e + ⌊S/64⌋ + D (e − e₋₁), and S grows by I e except beyond an active limit.
    """
    proportional = gains[SCALE] * (1.0 + joint[at.GAIN_ERROR])
    share = memory[SUM] / INTEGRAL_SHARE
    if quantise:
        share = whole(share) + 0.0 * share
    power = proportional * (gains[P] * error + share + gains[D] * (error - memory[LAST_ERROR]))
    if quantise:
        power = rounded_half_up(power)
    growth = gains[I] * error
    above = (power.real >= POWER_MAX) & (growth.real > 0.0)
    below = (power.real <= -POWER_MAX) & (growth.real < 0.0)
    memory[SUM] += where(above | below, 0.0 * growth, growth)
    memory[LAST_ERROR] = error
    return clamped(power, POWER_MAX + 0.0 * power)


@compiled_borrowing
def linear_board_pid(error: complex, gains: NDArray[Any], memory: NDArray[Any]) -> Any:
    """Returns the same without rounding, limit and wrong gain."""
    power = gains[SCALE] * (gains[P] * error + memory[SUM] / INTEGRAL_SHARE + gains[D] * (error - memory[LAST_ERROR]))
    memory[SUM] += gains[I] * error
    memory[LAST_ERROR] = error
    return power


@compiled_borrowing
def outside_band(error: complex, gains: NDArray[Any]) -> Any:
    """Returns the error that a sampled controller uses: zero within its dead band."""
    return where(magnitude(error).real <= gains[DEAD_BAND], 0.0 * error, error)


@compiled_borrowing
def sampled_pid(error: complex, period: complex, gains: NDArray[Any], memory: NDArray[Any]) -> Any:
    """Returns P e + I ∫e dt + D de/dt in SI units, with rectangles for the integral and a backward difference."""
    memory[SUM] += error * period
    slope = (error - memory[LAST_ERROR]) / period
    memory[LAST_ERROR] = error
    return gains[P] * error + gains[I] * memory[SUM] + gains[D] * slope


@compiled_borrowing
def cascade(error: complex, speed: complex, period: complex, gains: NDArray[Any], memory: NDArray[Any]) -> Any:
    """Returns the drive of a cascade in SI units: an outer PID on position gives a speed set point for an inner PID on
    speed."""
    inner_error = sampled_pid(error, period, gains, memory) - speed
    memory[INNER_SUM] += inner_error * period
    slope = (inner_error - memory[LAST_INNER_ERROR]) / period
    memory[LAST_INNER_ERROR] = inner_error
    return gains[INNER_P] * inner_error + gains[INNER_I] * memory[INNER_SUM] + gains[INNER_D] * slope


@compiled_borrowing
def given_out(
    output: complex,
    error: complex,
    period: complex,
    gains: NDArray[Any],
    joint: NDArray[Any],
    quantise: bool,
    memory: NDArray[Any],
) -> Any:
    """Returns the drive for a sampled controller's output: rounded to its resolution, then limited.

    At the limit the error is not integrated beyond it.
    """
    resolution = gains[RESOLUTION]
    if quantise and resolution > 0.0:
        output = resolution * rounded_half_up(output / resolution)
    limit = joint[at.OUTPUT_LIMIT]
    beyond = (magnitude(output).real > limit.real) & (output.real * error.real > 0.0)
    memory[SUM] -= where(beyond, error * period, 0.0 * error)
    return clamped(output, limit)
