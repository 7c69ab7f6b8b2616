"""What a fit may change: impossible searches are refused, and every unknown has a natural size."""

import math

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from model.fitting.unknowns import Unknown, prior_precision, scales
from model.machine_model.parameter import Kind, Parameter

MASS = Parameter(name="load.mass", kind=Kind.INERTIA, part="mass", unit="kg", value=0.5)


def unknown(start: float = 0.5, **fields: float | None) -> Unknown:
    return Unknown(MASS, start, **fields)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"low": 1.0, "high": 1.0}, "load.mass: lower bound 1 kg is not below the upper 1"),
        ({"start": 0.4, "low": 0.5}, "starting value 0.4 kg is outside 0.5 to inf"),
        ({"start": 0.6, "high": 0.5}, "starting value 0.6 kg is outside -inf to 0.5"),
        ({"deviation": 0.0}, "expected deviation 0 kg must be above 0"),
        ({"deviation": -1.0}, "expected deviation -1 kg must be above 0"),
        ({"deviation": math.inf}, "expected deviation inf kg must be above 0"),
    ],
)
def test_an_impossible_search_is_refused(fields: dict[str, float], says: str) -> None:
    with pytest.raises(SpecError, match=says):
        unknown(**fields)


def test_a_search_may_begin_at_a_bound() -> None:
    assert unknown(0.5, low=0.5, high=1.0).start == 0.5
    assert unknown(1.0, low=0.5, high=1.0).start == 1.0


def test_the_natural_size_is_the_expected_deviation_else_the_size_the_value_or_the_bounds_distance() -> None:
    every = (
        unknown(-0.5, deviation=0.1, size=3.0),
        unknown(-0.5, size=3.0),
        unknown(-0.5, low=-1.0),
        unknown(0.0, low=-1.0, high=4.0),
        unknown(0.0, low=-1.0),
    )
    np.testing.assert_array_equal(scales(every), [0.1, 3.0, 0.5, 5.0, 1.0])
    np.testing.assert_allclose(prior_precision(every), [100.0, 0.0, 0.0, 0.0, 0.0])
