"""The machine that traces were made on: one, whatever it is called; its limits may have changed meanwhile."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from daq.cli.context import Invocation
from daq.cli.model_input import machine_of
from daq.contracts.errors import SpecError
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from tests.daq.traces.samples import record

MA2000 = load_machine("ma2000")


def trace(machine: Machine | None) -> Trace:
    return Trace(record(machine=machine), (1,), np.arange(3.0), np.zeros((3, 1)))


def second_link(**changes: Any) -> Machine:
    """The machine with another mass of its second link."""
    joint = MA2000.joint(2)
    link = joint.link.model_copy(update={"mass": joint.link.mass.model_copy(update=changes)})
    return MA2000.model_copy(
        update={"joints": (MA2000.joint(1), joint.model_copy(update={"link": link}), *MA2000.joints[2:])}
    )


def test_two_machines_of_one_name_are_refused_with_where_they_differ() -> None:
    with pytest.raises(SpecError, match=r"both called ma2000: joints\.2\.link\.mass\.value differs"):
        machine_of([trace(MA2000), trace(second_link(value=1.0))], Invocation())


def test_what_is_only_said_otherwise_is_the_same_machine() -> None:
    other = second_link(source="weighed").model_copy(update={"title": "the arm", "limits": Limits(reach=0.5)})
    assert machine_of([trace(MA2000), trace(None), trace(other)], Invocation()) == other


def test_traces_that_name_none_are_of_the_configured_machine() -> None:
    assert machine_of([trace(None)], Invocation()) == MA2000
