"""The sampled controllers of the rigs: one joint and one period per call. Errors and speeds in rad and rad/s."""

from __future__ import annotations

import math
from typing import Any

from trials.rigs.laws import compiled
from trials.rigs.parameters import BOARD, CASCADE

SUM, LAST_ERROR, INNER_SUM, LAST_READING, LAST_WANTED = range(5)
MEMORY = 5
"""State of a controller for one joint."""

DAC_COUNTS = 127.0
"""Largest output of the board-like controller."""
INTEGRAL_SHIFT = 64.0
"""Summed counts of error per count of output at I = 1."""


@compiled
def rounded(value: float) -> float:
    """Rounds to the nearest integer, halves upwards."""
    return math.floor(value + 0.5)


@compiled
def control(wanted: float, read: float, p: Any, loop: Any, exact: bool, memory: Any) -> float:
    """Returns the output of a period, as it is recorded. Without `exact` (a smooth loop) nothing is rounded.

    Board-like: integers, in counts; else volts or N·m. Gains include the effect of a wrong gain. In a smooth loop, a
    share of lost set points is a set point between this one and the last; in an exact one the caller has already
    dropped them.
    """
    taken = wanted if exact else wanted - p.lost * (wanted - memory[LAST_WANTED])
    memory[LAST_WANTED] = wanted
    error = taken - read
    before = memory[LAST_ERROR]
    if loop.controller == BOARD:
        error /= p.count
        error = rounded(error) if exact else error
        share = memory[SUM] / INTEGRAL_SHIFT
        power = p.p * error + (math.floor(share) if exact else share) + p.d * (error - before)
        power *= p.dac_scale * (1.0 + p.gain_error)
        memory[LAST_ERROR] = error
        if abs(power) < DAC_COUNTS or power * error < 0.0:
            memory[SUM] += p.i * error
        power = min(max(rounded(power) if exact else power, -DAC_COUNTS), DAC_COUNTS)
        return power * p.counts_to_volts
    memory[LAST_ERROR] = error
    if loop.controller == CASCADE:
        speed = (read - memory[LAST_READING]) / loop.period
        memory[LAST_READING] = read
        inner = p.p * error - speed
        memory[INNER_SUM] += inner * loop.period
        output = p.inner_p * inner + p.inner_i * memory[INNER_SUM]
    else:
        memory[SUM] += error * loop.period
        output = p.p * error + p.i * memory[SUM] + p.d * (error - before) / loop.period
    output = min(max(output * (1.0 + p.gain_error), -p.limit), p.limit)
    if exact and p.resolution > 0.0:
        output = p.resolution * rounded(output / p.resolution)
    return output
