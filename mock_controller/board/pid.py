"""The controller's integer PID of one joint.

    e = set point − position                                      (ADC counts)
    S ← S + I·e, unless the last output was at its limit on e's side; |S| ≤ 127·2^shift; S = 0 while I = 0
    power = limit(P·e + floor(S / 2^shift) + D·(e − previous e))  (DAC counts, ±127)

One unit of P is one DAC count per ADC count, and one of D the same per ADC count and period. The source gives none
of these scales: they are assumptions, except that gains run from 0 to 20 and the DAC has eight bits.
"""

from __future__ import annotations

from math import floor

from firmware_protocol.units import DAC_MAX


class IntegerPid:
    """State of one joint's controller. A `scale` other than 1 multiplies its output before the limit."""

    __slots__ = ("_integral_limit", "_last_power", "_previous", "_scale", "_shift", "_sum")

    def __init__(self, integral_shift: int, scale: float = 1.0) -> None:
        self._shift = integral_shift
        self._scale = scale
        self._integral_limit = DAC_MAX << integral_shift
        self.reset()

    def reset(self) -> None:
        """Clears the integral and the previous error, as at power-up."""
        self._sum = 0
        self._previous: int | None = None
        self._last_power = 0

    def update(self, error: int, gains: tuple[int, int, int]) -> int:
        """Returns the power (DAC counts, −127 to 127) for this period's error (ADC counts) under gains (P, I, D)."""
        p, i, d = gains
        if i == 0:
            self._sum = 0
        elif self._last_power * error < DAC_MAX * abs(error):
            limit = self._integral_limit
            self._sum = min(max(self._sum + i * error, -limit), limit)
        change = 0 if self._previous is None else error - self._previous
        self._previous = error
        power = p * error + (self._sum >> self._shift) + d * change
        if self._scale != 1.0:
            power = floor(self._scale * power + 0.5)
        self._last_power = min(max(power, -DAC_MAX), DAC_MAX)
        return self._last_power
