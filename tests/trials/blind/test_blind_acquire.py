"""A blind trial that may ask for more, by the diagnosis itself: what it is told, asks for, and is given."""

import json
from pathlib import Path
from typing import Any

import pytest

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import load_machine
from daq.traces.reader import read_trace
from daq_cli.models.stopping_rule import as_run, next_to_run, time_left
from model.discrepancy import workflow
from model.discrepancy.diagnosis import Acquired, Diagnosis, NextExperiment
from model.discrepancy.options import DiagnosisOptions
from model.machine_model.model import base_model
from model.machine_model.model_file import save_model
from model.trial.registration import compose
from tests.daq.executors.by_hand import WorkersByHand
from tests.model.discrepancy.steps import answer_of
from trials.blind import diagnoser
from trials.blind.campaign import ROBOT_TIME, Campaign
from trials.blind.folder import TrialFolder
from trials.blind.recording import record, trial_experiment

MACHINE = load_machine("ma2000")
SOUND = compose(7654321, "clean", "nominal")


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


@pytest.fixture(scope="module")
def ramp(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The trial's ramp step on a sound arm, as a trial records it."""
    folder = tmp_path_factory.mktemp("ramp")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("DAQ_RUNTIME_FOLDER", str(folder / "run"))
        made = record(SOUND, "ramp", trial_experiment("ramp"), MACHINE, folder)
    assert made.outcome == "complete"
    return made.file


@pytest.mark.slow
def test_the_diagnoser_asks_for_an_experiment_only_where_it_may(
    ramp: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = workflow.diagnose

    def of_one_effect(*given: Any, **named: Any) -> Diagnosis:
        options = DiagnosisOptions(effects=("coulomb_friction",), joints=(2,), most_steps=1)
        return whole(*given, options=options, **named)

    monkeypatch.setattr(workflow, "diagnose", of_one_effect)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "trace-1.mcap").write_bytes(ramp.read_bytes())
    save_model(base_model(MACHINE), tmp_path / "model.json")

    def answer() -> Diagnosis:
        assert diagnoser.main() == 0
        return Diagnosis.model_validate_json((tmp_path / "answer.json").read_text("utf-8"))

    assert answer().next_experiment is None
    (tmp_path / "asking.json").write_text(json.dumps({"budget": 15.0}), "utf-8")
    wanted = answer().next_experiment
    assert wanted.duration <= 15.0


def test_a_run_is_recorded_with_its_trace(ramp: Path) -> None:
    trace = read_trace(ramp)
    told = as_run(asked(8.0), trace, ramp, "complete")
    assert (told.trace, told.experiment, told.outcome) == (trace.record.trace_id, "ramp", "complete")
    assert told.duration == pytest.approx(float(trace.time[-1] - trace.time[0]))


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_trial_runs_the_experiment_that_its_diagnosis_asks_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DAQ_RUNTIME_FOLDER", str(tmp_path / "run"))
    folder = TrialFolder.open(tmp_path / "trial", "ramp", True, None)
    folder.add("detect", {"seed": SOUND, "d_prime": 0.0, "effects": [], "load_kg": None})
    said: list[str] = []
    Campaign(folder, MACHINE, until="diagnose").run([SOUND], WorkersByHand(), lambda _number, line: said.append(line))
    assert [line.partition(": ")[2] for line in said] == ["done"]
    row = folder.row("diagnose", SOUND)
    assert "failure" not in row
    assert len(row["further"]) >= 1
    assert sum(further["duration"] for further in row["further"]) <= ROBOT_TIME
    assert len(row["traces"]) == 1 + len(row["further"])
    answer = Diagnosis.model_validate_json((folder.path / "answers" / row["answer"]).read_text("utf-8"))
    assert len(answer.traces) == len(row["traces"])
    assert answer.robot_seconds == pytest.approx(row["robot_seconds"], abs=0.1)
