"""Elementary functions in real and dual numbers."""

import cmath
import math

import numba
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from model.dynamics.dual import DUAL_STEP, LARGEST_ANGLE, reciprocal, sin_cos


@numba.njit
def compiled_sin_cos(x: complex) -> tuple[complex, complex]:
    return sin_cos(x)


@numba.njit(error_model="numpy")
def compiled_reciprocal(x: complex) -> complex:
    return reciprocal(x)


@given(st.floats(-LARGEST_ANGLE, LARGEST_ANGLE))
@example(0.0)
@example(math.pi / 4)
@example(-math.pi / 2)
@example(3 * math.pi)
def test_sine_and_cosine_are_right_to_the_last_digits(x: float) -> None:
    s, c = compiled_sin_cos(x)
    assert abs(s - math.sin(x)) <= 2.3e-16
    assert abs(c - math.cos(x)) <= 2.3e-16


@given(st.floats(-100.0, 100.0), st.floats(-10.0, 10.0))
def test_dual_sine_and_cosine_carry_the_derivative(x: float, slope: float) -> None:
    s, c = compiled_sin_cos(complex(x, DUAL_STEP * slope))
    assert s.imag / DUAL_STEP == pytest.approx(slope * math.cos(x), abs=1e-14)
    assert c.imag / DUAL_STEP == pytest.approx(-slope * math.sin(x), abs=1e-14)


@pytest.mark.parametrize("x", [0.7, 0.7 + DUAL_STEP * 1j])
def test_interpreted_functions_agree_with_compiled_ones(x: complex) -> None:
    assert sin_cos(x) == pytest.approx(compiled_sin_cos(x), abs=1e-15)
    assert sin_cos(x) == pytest.approx((cmath.sin(x), cmath.cos(x)), abs=1e-15)
    assert reciprocal(x) == pytest.approx(compiled_reciprocal(x), abs=1e-15)


@given(st.floats(0.01, 100.0))
def test_dual_reciprocal_carries_the_derivative(x: float) -> None:
    r = compiled_reciprocal(complex(x, DUAL_STEP))
    assert r.imag / DUAL_STEP == pytest.approx(-1 / x**2, rel=1e-14)


def test_an_angle_that_is_not_a_number_stays_so() -> None:
    assert all(math.isnan(v) for v in compiled_sin_cos(math.nan))
