"""Numbers in a column have the same decimals; an interval has the digits that it knows."""

import pytest

from model.reports.numbers import column, estimate, whole


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ((0.0478, 0.0289), ["0.0478", "0.0289"]),
        ((5.91215, 0.00818), ["5.9121", "0.0082"]),
        ((2000.0, 310.0), ["2000", "310"]),
        ((0.0, 1.5), ["0.00", "1.50"]),
        ((), []),
    ],
)
def test_a_column_has_the_same_decimals_throughout(values: tuple[float, ...], told: list[str]) -> None:
    assert column(values) == told


def test_an_estimate_is_told_to_the_digits_of_its_interval() -> None:
    assert estimate(9.0731, 8.672, 9.475, digits=1) == ("9.1", "8.7 to 9.5")
    assert estimate(9.0731, 8.672, 9.475) == ("9.07", "8.67 to 9.47")
    assert estimate(-0.12345, None, None) == ("−0.123", None)
    assert estimate(-0.2, -16.0, 16.0, digits=1) == ("0", "−16 to 16")


def test_a_negative_number_has_the_minus_of_print() -> None:
    assert [whole(v) for v in (-7.4, -0.2, 0.4, 1714.2)] == ["−7", "0", "0", "1714"]
