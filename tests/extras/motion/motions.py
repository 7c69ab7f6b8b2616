"""Motions of the tests, planned as `daq` plans them, and their attempts on the mock."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from daq.contracts.experiment import ExperimentSpec, parse_spec
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from daq.safety.planned import motion_of, planned
from extras.motion.tracking import Followed, followed
from model.machine_model.model import Model, base_model
from tests.model.discrepancy.recording import recorded

RAMP = parse_spec({"trajectory": {"kind": "ramp"}, "settle": 0.3, "hold": 0.4})
STILL_MOCK = 7
"""Seed of the mock's noise and potentiometers."""


@cache
def machine() -> Machine:
    return load_machine("ma2000")


@cache
def arm() -> Model:
    """The arm as its machine file has it."""
    return base_model(machine())


def plan(spec: ExperimentSpec) -> NDArray[np.float64]:
    """Set points within the machine's limits."""
    return planned(spec, machine())


def attempts(specs: Sequence[ExperimentSpec], folder: Path, modifications: Sequence[str] = ()) -> list[Trace]:
    """Traces of experiments on the mock, which shares no code with the model."""
    return recorded(specs, machine(), STILL_MOCK, folder, modifications)


def judged(trace: Trace) -> Followed:
    """The motion that was asked for beside the arm's."""
    found = followed(trace, lambda spec: motion_of(spec, machine()))
    assert found is not None
    return found


def rms(trace: Trace) -> float:
    """rms error over all joints, degrees."""
    found = judged(trace)
    return float(np.degrees(np.sqrt(np.square(found.wanted - found.reached).mean())))
