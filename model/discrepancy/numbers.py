"""How the numbers of a sentence are written: as many digits as a person reads, with units, and never an exponent."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from model.units import with_unit


def plain(value: float, digits: int = 2) -> str:
    """A number with so many significant digits: 720, −0.15, 0.00008."""
    text = np.format_float_positional(abs(value), precision=digits, unique=False, fractional=False, trim="-")
    return f"−{text}" if value < 0 and text != "0" else text


def from_to(first: float, last: float) -> tuple[str, str]:
    """Two numbers with enough digits to tell them apart: 1.54 and 1.46, where both round to 1.5."""
    digits = 2 if plain(first) != plain(last) else 3
    return plain(first, digits), plain(last, digits)


@dataclass(frozen=True)
class ReadingUnits:
    """Units in which people read the numbers of one joint.

    factor: from rad (m) to ° (mm). unit: of its residual. place_unit: of its position. least: rad (m), the smallest
    deviation that can be read off a plot; 0 for no limit. turns: whether the joint turns; otherwise it slides.
    """

    factor: float
    unit: str
    place_unit: str
    drive_unit: str
    torque_unit: str
    least: float = 0.0
    turns: bool = True

    def size(self, value: float) -> str:
        """The magnitude of a residual, with its unit."""
        if self.unread(value):
            return f"less than {with_unit(plain(self._least_shown, 1), self.unit)}"
        return with_unit(plain(abs(value) * self.factor), self.unit)

    def signed(self, value: float) -> str:
        """A residual with sign and unit."""
        sign = "" if self.unread(value) else "+" if value >= 0 else "−"
        return f"{sign}{self.size(value)}"

    def behind(self, first: float, second: float) -> tuple[str, str]:
        """Two lags, to be written one after the other, each with the verb for its sign: “lags by 0.067°” and “leads by
        0.037°”, or “lags by 0.067°” and “by 0.02°”."""
        verbs = [None if self.unread(v) else "lags" if v >= 0 else "leads" for v in (first, second)]
        one = verbs[0] or verbs[1] or "lags"
        two = verbs[1] or one
        again = "" if two == one else f"{two} "
        return f"{one} by {self.size(first)}", f"{again}by {self.size(second)}"

    def place(self, value: float) -> str:
        """A position with its unit."""
        return with_unit(plain(value * self.factor, 3), self.place_unit)

    def speed(self, value: float) -> str:
        """A speed with its unit."""
        return f"{with_unit(plain(abs(value) * self.factor), self.place_unit)}/s"

    def cycles(self, value: float) -> str:
        """How often something repeats over the position, from radians of phase per rad (m)."""
        return f"{plain(value, 3)} times a turn" if self.turns else f"{plain(value / (2 * math.pi), 3)} times a metre"

    def unread(self, value: float) -> bool:
        """Whether a residual is too small to be read off a plot."""
        return abs(value) * self.factor < self._least_shown

    @property
    def _least_shown(self) -> float:
        """`least` in the unit that is shown, rounded up to one digit."""
        if self.least <= 0.0:
            return 0.0
        least = self.least * self.factor
        step = 10.0 ** math.floor(math.log10(least))
        return math.ceil(least / step - 1e-9) * step
