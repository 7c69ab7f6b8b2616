"""Elementary functions for real and for dual numbers carried in complex128.

A complex number a + ih with h of about 1e-20 serves as a dual number: i·h carries an exact first derivative
and h² vanishes below rounding. The functions here drop terms of second order in the imaginary part, which
makes them cheaper than the complex functions of the library (no sinh, no Smith division) and equally exact
for this use. They are not for complex numbers of any other kind.
"""

from __future__ import annotations

import math
from typing import Any

from numba import types
from numba.extending import overload

# numba asks that an overload and its implementations agree in their annotations, hence Any throughout.
_OPTIONS = {"error_model": "numpy", "fastmath": {"contract"}}

DUAL_STEP = 1e-20
"""Imaginary part that stands for a unit derivative; its square is far below the rounding of any quantity."""


def sin_cos(x: complex) -> tuple[Any, Any]:
    """Sine and cosine of an angle in rad."""
    if isinstance(x, complex):
        s, c = math.sin(x.real), math.cos(x.real)
        return complex(s, x.imag * c), complex(c, -x.imag * s)
    return math.sin(x), math.cos(x)


def reciprocal(x: complex) -> Any:
    """1 / x."""
    if isinstance(x, complex):
        r = 1.0 / x.real
        return complex(r, -x.imag * r * r)
    return 1.0 / x


@overload(sin_cos, jit_options=_OPTIONS)
def _sin_cos(x: Any) -> Any:
    if isinstance(x, types.Complex):

        def dual(x: Any) -> Any:
            s, c = math.sin(x.real), math.cos(x.real)
            return complex(s, x.imag * c), complex(c, -x.imag * s)

        return dual

    def real(x: Any) -> Any:
        return math.sin(x), math.cos(x)

    return real


@overload(reciprocal, jit_options=_OPTIONS)
def _reciprocal(x: Any) -> Any:
    if isinstance(x, types.Complex):

        def dual(x: Any) -> Any:
            r = 1.0 / x.real
            return complex(r, -x.imag * r * r)

        return dual

    def real(x: Any) -> Any:
        return 1.0 / x

    return real
