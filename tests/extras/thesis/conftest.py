"""What `daq thesis` computes with its default options, but for the hill climbing, which takes a minute."""

import pytest

from daq.contracts.trace import Trace
from extras.thesis.command import recorded_ramp
from extras.thesis.reproduction import Reproduction, reproduce_thesis

DEFAULT_SEED = 1991


@pytest.fixture(scope="session")
def ramp() -> Trace:
    """The record that the command makes."""
    return recorded_ramp(DEFAULT_SEED)


@pytest.fixture(scope="session")
def result(ramp: Trace) -> Reproduction:
    return reproduce_thesis([ramp], ("least_squares",))
