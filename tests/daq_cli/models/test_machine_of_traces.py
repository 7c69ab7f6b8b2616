"""The machine that traces were made on: one, whatever it is called; its limits may have changed meanwhile."""

import re
from typing import Any

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from daq_cli.app.context import Invocation
from daq_cli.models.model_input import check_made_for, machine_of
from daq_cli.robot.local import LocalRobot
from tests.daq.traces.samples import record
from tests.daq_cli.models.conftest import ROOT

MA2000 = load_machine("ma2000")


def trace(machine: Machine | None, *joints: int) -> Trace:
    """A trace of these joints, of joint 1 where none is named."""
    own = joints or (1,)
    return Trace(record(machine=machine), own, np.arange(3.0), np.zeros((3, len(own))))


def second_link(**changes: Any) -> Machine:
    """The machine with another mass of its second link."""
    joint = MA2000.joint(2)
    link = joint.link.model_copy(update={"mass": joint.link.mass.model_copy(update=changes)})
    return MA2000.model_copy(
        update={"joints": (MA2000.joint(1), joint.model_copy(update={"link": link}), *MA2000.joints[2:])}
    )


def test_different_machines_of_one_name_are_refused_with_the_differing_field() -> None:
    with pytest.raises(SpecError, match=r"both called ma2000: joints\.2\.link\.mass\.value differs"):
        machine_of([trace(MA2000), trace(second_link(value=1.0))], LocalRobot(Invocation()))


def test_machines_that_differ_only_in_words_are_the_same() -> None:
    other = second_link(source="weighed").model_copy(update={"title": "the arm", "limits": Limits(reach=0.5)})
    assert machine_of([trace(MA2000), trace(None, 1, 2, 3), trace(other)], LocalRobot(Invocation())) == other


def test_a_trace_without_a_machine_is_of_the_configured_one_with_a_remark_or_needs_a_model(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert machine_of([trace(None, 1, 2, 3)], LocalRobot(Invocation()), ["bench.csv"]) == MA2000
    assert "bench.csv: no machine is named there: taken for the configured ma2000" in capsys.readouterr().err
    with pytest.raises(SpecError, match=r"^bench\.csv: names no machine, and has no joint 2 or 3 of ma2000.*--model"):
        machine_of([trace(None, 1)], LocalRobot(Invocation()), ["bench.csv"])


def test_a_trace_of_another_machine_is_refused_with_its_file_name() -> None:
    bench = load_machine(str(ROOT / "examples" / "motor_bench.toml"))
    for machine, one, file, said in (
        (bench, trace(None, 1), "axis.csv", "has no velocity, which the sensors of motor-bench measure"),
        (MA2000, trace(None, 1), "axis.csv", "has no joint 2 or 3, which the model of ma2000 moves; it has 1$"),
        (bench, trace(MA2000), "arm.mcap", "was made on ma2000, the model describes motor-bench"),
    ):
        with pytest.raises(SpecError, match=f"^{re.escape(file)}: {said}"):
            check_made_for(machine, [one], [file])
    check_made_for(MA2000, [trace(None, 1, 2, 3)], ["arm.csv"])
