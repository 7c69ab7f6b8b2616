"""Which experiment that a diagnosis asks for is run, and what is kept of it."""

from pathlib import Path
from typing import Any

import pytest

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import load_machine
from daq_cli.models.stopping_rule import as_run, next_to_run, time_left
from model.discrepancy.diagnosis import Acquired, Diagnosis, NextExperiment
from model.machine_model.model import base_model
from tests.model.discrepancy.steps import answer_of
from tests.model.simulation.records import ramp_trace

MACHINE = load_machine("ma2000")


def asked(duration: float) -> NextExperiment:
    return NextExperiment(
        name="ramp",
        spec=ExperimentSpec(name="ramp"),
        duration=duration,
        separates=("a", "b"),
        predicted_separation=4.0,
        reason="a and b would differ",
    )


def answered(wanted: NextExperiment | None, verdict: Any = "ambiguous") -> Diagnosis:
    return answer_of(base_model(MACHINE), verdict=verdict, next_experiment=wanted)


def run(duration: float, outcome: str = "complete") -> Acquired:
    return Acquired(experiment="ramp", trace="1", file="1.mcap", outcome=outcome, duration=duration, reason="")


def test_an_experiment_is_run_while_it_fits_into_the_remaining_robot_time() -> None:
    assert next_to_run(answered(asked(20.0)), [], 20.0) == asked(20.0)
    assert next_to_run(answered(asked(20.1)), [], 20.0) is None
    assert next_to_run(answered(asked(8.0)), [run(7.0), run(5.0)], 20.0) == asked(8.0)
    assert next_to_run(answered(asked(8.1)), [run(7.0), run(5.0)], 20.0) is None
    assert time_left([run(7.0), run(5.0, "stopped")], 20.0) == 8.0
    assert next_to_run(answered(None), [], 20.0) is None
    assert next_to_run(answered(asked(8.0), "named"), [], 20.0) == asked(8.0), "an uncertain name"


@pytest.mark.parametrize("outcome", ["stopped", "fault", "interrupted"])
def test_no_experiment_follows_an_incomplete_run(outcome: str) -> None:
    assert next_to_run(answered(asked(8.0)), [run(1.0, outcome)], 20.0) is None


def test_a_run_is_recorded_with_its_trace(tmp_path: Path) -> None:
    trace = ramp_trace(MACHINE)
    told = as_run(asked(8.0), trace, tmp_path / "ramp.mcap", "complete")
    assert (told.trace, told.experiment, told.outcome) == (trace.record.trace_id, "ramp", "complete")
    assert told.duration == pytest.approx(float(trace.time[-1] - trace.time[0]))
