"""A load that is told is known as well as the machine file's own, relative to its size."""

import pytest

from daq.contracts.carried_load import LEAST_DEVIATION, carrying
from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine, load_machine
from daq.contracts.quantity import Quantity

ARM = load_machine("ma2000")


def with_load(**fields: float | None) -> Machine:
    """The arm whose file states another load."""
    stated = {"value": 1.0, "deviation": 0.1, **fields}
    return ARM.model_copy(update={"load": Quantity(unit="kg", source="test", **stated)})


@pytest.mark.parametrize(
    ("stated", "kilograms", "deviation"),
    [
        ({}, 0.4, 0.04),
        ({}, 2.5, 0.25),
        ({}, 0.0, LEAST_DEVIATION),
        ({"value": 0.0, "deviation": 0.05}, 2.0, 0.05),
        ({"deviation": None}, 2.0, None),
    ],
    ids=["grows with the load", "and with more", "none to a gram", "file without load", "not claimed by the file"],
)
def test_the_deviation_is_that_of_the_file_and_grows_with_the_load(
    stated: dict[str, float | None], kilograms: float, deviation: float | None
) -> None:
    load = carrying(with_load(**stated), kilograms, "told").load
    assert load is not None
    assert (load.value, load.source, load.assumed) == (kilograms, "told", False)
    assert load.deviation == (None if deviation is None else pytest.approx(deviation))


def test_a_load_that_the_machine_cannot_carry_is_refused() -> None:
    with pytest.raises(SpecError, match="has no load in its machine file"):
        carrying(ARM.model_copy(update={"load": None}), 1.0, "told")
    with pytest.raises(SpecError, match=r"load -1 kg: .* allows at least 0 kg"):
        carrying(ARM, -1.0, "told")
    with pytest.raises(SpecError, match=r"load 4 kg: .* allows 0.5 to 3 kg"):
        carrying(with_load(low=0.5, high=3.0), 4.0, "told")
