"""Elementary functions for real and for dual numbers carried in complex128.

A complex number a + ih with h of about 1e-20 serves as a dual number: i·h carries an exact first derivative
and h² vanishes below rounding. The functions here drop terms of second order in the imaginary part, which
makes them cheaper than the complex functions of the library (no sinh, no Smith division) and equally exact
for this use. They are not for complex numbers of any other kind.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types
from numba.extending import overload

from model.dynamics.compilation import inlined
from model.dynamics.wide_numbers import DUAL, LANES, chained, where, whole

# numba requires that an overload and its implementations have equal annotations, hence Any throughout.
_OPTIONS: Any = {"error_model": "numpy", "fastmath": {"contract"}}

DUAL_STEP = 1e-20
"""Imaginary part that represents a unit derivative; its square is far below the rounding of any quantity."""

LARGEST_ANGLE = 1e5
"""Up to here, in rad, sine and cosine are right to 2.3e-16. Joints turn a few radians."""

# π/2 in three parts, the first two with 33 significant bits, so that their products with a count are exact.
_HALF_PI_HIGH = 1.5707963267341256
_HALF_PI_MIDDLE = 6.077100506303966e-11
_HALF_PI_LOW = 2.0222662487959506e-21


@inlined
def _near_multiple(x: Any) -> Any:
    """Returns sine and cosine of an angle without its quarter turns, by the Taylor series, and the number of these.

    Written out because the library's function is a call, and a loop with a call in it cannot be vectorised. The terms
    left out are below 1e-17 of the result.
    """
    turns = whole(x * (2.0 / math.pi) + 0.5)
    r = ((x - turns * _HALF_PI_HIGH) - turns * _HALF_PI_MIDDLE) - turns * _HALF_PI_LOW
    z = r * r
    zz = z * z
    # Neighbouring terms are paired: half as many steps wait for each other as in Horner's form.
    odd = (-1 / 6 + z * (1 / 120)) + zz * (
        (-1 / 5040 + z * (1 / 362880))
        + zz * ((-1 / 39916800 + z * (1 / 6227020800)) + zz * (-1 / 1307674368000 + z * (1 / 355687428096000)))
    )
    even = (1 / 24 + z * (-1 / 720)) + zz * (
        (1 / 40320 + z * (-1 / 3628800)) + zz * ((1 / 479001600 + z * (-1 / 87178291200)) + zz * (1 / 20922789888000))
    )
    s = r + r * z * odd
    half = 0.5 * z
    near_one = 1.0 - half
    c = near_one + (((1.0 - near_one) - half) + zz * even)  # the rounding of 1 − z/2 is put back
    return s, c, turns


@inlined
def _sin_cos_real(x: float) -> tuple[float, float]:
    """Sine and cosine together, by reduction to |r| ≤ π/4."""
    s, c, turns = _near_multiple(x)
    quadrant = np.int64(turns) & 3
    sine, cosine = (c, s) if quadrant & 1 else (s, c)
    return -sine if quadrant & 2 else sine, -cosine if (quadrant + 1) & 2 else cosine


@inlined
def _sin_cos_of_lanes(x: Any) -> Any:
    s, c, turns = _near_multiple(x)
    quadrant = turns - 4.0 * whole(0.25 * turns)
    odd = quadrant - 2.0 * whole(0.5 * quadrant) > 0.5
    sine, cosine = where(odd, c, s), where(odd, s, c)
    below, left = quadrant > 1.5, (quadrant > 0.5) & (quadrant < 2.5)
    return where(below, -sine, sine), where(left, -cosine, cosine)


def sin_cos(x: float | complex) -> tuple[Any, Any]:
    """Returns sine and cosine of an angle in rad, |x| ≤ `LARGEST_ANGLE`."""
    if isinstance(x, complex):
        s, c = math.sin(x.real), math.cos(x.real)
        return complex(s, x.imag * c), complex(c, -x.imag * s)
    return math.sin(x), math.cos(x)


def reciprocal(x: float | complex) -> Any:
    """Returns 1 / x."""
    if isinstance(x, complex):
        r = 1.0 / x.real
        return complex(r, -x.imag * r * r)
    return 1.0 / x


@overload(sin_cos, jit_options=_OPTIONS, strict=False)
def _sin_cos(x: Any) -> Any:
    if isinstance(x, types.Complex):

        def dual(x: Any) -> Any:
            s, c = _sin_cos_real(x.real)
            return complex(s, x.imag * c), complex(c, -x.imag * s)

        return dual

    if x == DUAL:

        def with_derivatives(x: Any) -> Any:
            s, c = _sin_cos_real(x.real)
            return chained(s, c, x), chained(c, -s, x)

        return with_derivatives

    if x == LANES:
        return _sin_cos_of_lanes.py_func

    def real(x: Any) -> Any:
        return _sin_cos_real(x)

    return real


@overload(reciprocal, jit_options=_OPTIONS, strict=False)
def _reciprocal(x: Any) -> Any:
    if isinstance(x, types.Complex):

        def dual(x: Any) -> Any:
            r = 1.0 / x.real
            return complex(r, -x.imag * r * r)

        return dual

    if x == DUAL:

        def with_derivatives(x: Any) -> Any:
            r = 1.0 / x.real
            return chained(r, -r * r, x)

        return with_derivatives

    def real(x: Any) -> Any:
        return 1.0 / x

    return real
