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


@pytest.mark.parametrize("kilograms", [0.4, 1.0, 2.5])
def test_the_deviation_grows_with_the_load(kilograms: float) -> None:
    load = carrying(with_load(), kilograms, "told").load
    assert load is not None
    assert (load.value, load.source, load.assumed) == (kilograms, "told", False)
    assert load.deviation == pytest.approx(0.1 * kilograms)


def test_an_arm_without_load_is_known_to_a_gram() -> None:
    load = carrying(with_load(), 0.0, "told").load
    assert load is not None
    assert (load.value, load.deviation) == (0.0, LEAST_DEVIATION)


def test_beside_a_file_without_load_the_deviation_is_in_kilograms() -> None:
    load = carrying(with_load(value=0.0, deviation=0.05), 2.0, "told").load
    assert load is not None
    assert load.deviation == 0.05


def test_what_the_file_does_not_claim_is_not_claimed() -> None:
    load = carrying(with_load(deviation=None), 2.0, "told").load
    assert load is not None
    assert load.deviation is None


def test_a_load_that_the_machine_cannot_carry_is_refused() -> None:
    with pytest.raises(SpecError, match="has no load in its machine file"):
        carrying(ARM.model_copy(update={"load": None}), 1.0, "told")
    with pytest.raises(SpecError, match=r"load -1 kg: .* allows at least 0 kg"):
        carrying(ARM, -1.0, "told")
    with pytest.raises(SpecError, match=r"load 4 kg: .* allows 0.5 to 3 kg"):
        carrying(with_load(low=0.5, high=3.0), 4.0, "told")
