"""The integer PID, vector by vector."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mock_controller.board.pid import IntegerPid


def powers(errors: list[int], gains: tuple[int, int, int]) -> list[int]:
    pid = IntegerPid(6)
    return [pid.update(error, gains) for error in errors]


@pytest.mark.parametrize(
    ("gains", "errors", "expected"),
    [
        ((2, 0, 0), [0, 1, -1, 50, 63, 64, -64, 500], [0, 2, -2, 100, 126, 127, -127, 127]),
        ((0, 0, 0), [100, -4000], [0, 0]),
        ((0, 0, 3), [5, 5, 9, 2], [0, 0, 12, -21]),
        ((0, 20, 0), [16, 16, 0, 0, -32], [5, 10, 10, 10, 0]),
        ((0, 1, 0), [-1, -1], [-1, -1]),
        ((2, 1, 1), [10, 20, 20], [20, 50, 40]),
        ((20, 0, 20), [4095, -4095], [127, -127]),
    ],
)
def test_the_integer_pid_agrees_with_worked_examples(
    gains: tuple[int, int, int], errors: list[int], expected: list[int]
) -> None:
    assert powers(errors, gains) == expected


def test_integral_does_not_wind_up_while_the_output_is_at_its_limit() -> None:
    # Saturated by the proportional part: the sum stays where it was, so the output leaves the limit at once.
    assert powers([100] * 50 + [0], (2, 20, 0))[-1] <= 20 * 100 // 64 + 1


def test_integral_is_forgotten_when_its_gain_becomes_zero() -> None:
    pid = IntegerPid(6)
    for _ in range(5):
        pid.update(30, (0, 20, 0))
    pid.update(0, (0, 0, 0))
    assert pid.update(0, (0, 20, 0)) == 0


@given(
    st.lists(st.integers(-4095, 4095), min_size=1, max_size=30),
    st.tuples(st.integers(0, 20), st.integers(0, 20), st.integers(0, 20)),
)
def test_power_always_fits_the_dac(errors: list[int], gains: tuple[int, int, int]) -> None:
    assert all(-127 <= power <= 127 for power in powers(errors, gains))


@given(st.integers(-4095, 4095), st.integers(0, 20))
def test_proportional_power_is_odd_in_the_error(error: int, gain: int) -> None:
    assert powers([error], (gain, 0, 0))[0] == -powers([-error], (gain, 0, 0))[0]
