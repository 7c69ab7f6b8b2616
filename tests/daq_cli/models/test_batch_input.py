"""What `daq batch` refuses, in one line each, before anything is computed."""

from pathlib import Path

import pytest

from daq.contracts.service.jobs import DiagnoseStudy, Study
from daq_cli.commands import batch
from daq_cli.models.batch import Asked
from daq_cli.robot.access import RobotAccess
from tests.daq_cli.invoke import CommandLine


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("simulate nowhere/traces --out o", "is no folder of traces"),
        ("simulate traces --out o", "has no trace that matches"),
        ("simulate ramp --out o", "has no trace that matches"),
        ("simulate colour:red --out o", "no such term; there are kind"),
        ("simulate traces --out o --executor 4", "executor '4': is none; write local://4"),
        ("simulate traces --out o --executor local://0", "0 workers; 1 to 10000"),
        ("simulate traces --out o --model none.json", "none.json"),
        ("fit traces --out o --effects rust", "effect 'rust': not in the library"),
        ("fit traces --out o --bound link1.mass=2:1", "the lower bound 2 is not below the upper 1"),
        ("diagnose traces --out o --joints 9-1", "9-1"),
        ("diagnose traces --out o --method guess", "'guess'"),
        ("validate traces --out o --effect-file none.py", "none.py"),
    ],
)
def test_wrong_input_is_told_in_one_line_and_nothing_is_begun(daq: CommandLine, words: str, says: str) -> None:
    Path("traces").mkdir()
    daq("batch", *words.split()).complains(2, says)
    assert not Path("o").exists()


@pytest.mark.parametrize(
    ("words", "study"),
    [
        ("", DiagnoseStudy()),
        ("--method output-error --most 5", DiagnoseStudy(method="output-error", most_steps=5)),
        ("--method inverse-dynamics", DiagnoseStudy(method="inverse-dynamics")),
    ],
)
def test_a_batch_of_diagnoses_takes_the_method_and_the_steps_that_were_asked_for(
    daq: CommandLine, words: str, study: DiagnoseStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[Study] = []

    def run_here(_robot: RobotAccess, _asked: Asked, study: Study) -> bool:
        begun.append(study)
        return True

    monkeypatch.setattr(batch, "run_here", run_here)
    assert daq("batch", "diagnose", "traces", "--out", "o", *words.split()).code == 0
    assert begun == [study]


def test_a_service_looks_for_one_word(daq: CommandLine) -> None:
    words = ("--server", "http://127.0.0.1:9", "batch", "simulate", "ramp slow", "--out", "o")
    daq(*words).complains(2, "query: ramp slow: a service looks for one word")
    assert not Path("o").exists()


def test_a_batch_goes_on_only_where_it_began(daq: CommandLine) -> None:
    service = ("--server", "http://127.0.0.1:9")
    for folder, file in (("here", "batch.json"), ("there", "job")):
        Path(folder).mkdir()
        Path(folder, file).touch()
    daq(*service, "batch", "simulate", "ramp", "--out", "here").complains(2, "a batch that this computer computed")
    daq("batch", "simulate", "here", "--out", "there").complains(2, "there: holds a batch of a service")


def test_a_file_in_place_of_the_result_folder_is_told(daq: CommandLine) -> None:
    Path("traces").mkdir()
    Path("traces", "broken.mcap").write_text("no trace")
    Path("o").write_text("mine")
    daq("batch", "simulate", "traces", "--out", "o").complains(2, "o: cannot be written")
    assert Path("o").read_text() == "mine"


def test_the_executor_of_a_service_is_checked_with_its_configuration(daq: CommandLine) -> None:
    Path("daq.toml").write_text('[server]\nexecutor = "dask:/host"\n')
    daq("config", "check").complains(2, "executor 'dask:/host': is none")
