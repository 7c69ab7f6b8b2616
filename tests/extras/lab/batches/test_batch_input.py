"""What `daq batch` refuses, in one line each, before anything is computed."""

from pathlib import Path

import pytest

from daq.contracts.service.jobs import DiagnoseStudy
from daq_cli.robot.operations import RobotAccess
from extras.lab.batches import command
from extras.lab.batches.command import Asked
from extras.lab.batches.study import Study
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

    def run(_robot: RobotAccess, _asked: Asked, study: Study) -> bool:
        begun.append(study)
        return True

    monkeypatch.setattr(command, "run", run)
    assert daq("batch", "diagnose", "traces", "--out", "o", *words.split()).code == 0
    assert begun == [study]


def test_a_file_in_place_of_the_result_folder_is_told(daq: CommandLine) -> None:
    Path("traces").mkdir()
    Path("traces", "broken.mcap").write_text("no trace")
    Path("o").write_text("mine")
    daq("batch", "simulate", "traces", "--out", "o").complains(2, "o: cannot be written")
    assert Path("o").read_text() == "mine"
