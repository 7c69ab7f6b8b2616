"""`daq batch` on this computer: what it refuses, a worker that is killed, and the commands of its page."""

from __future__ import annotations

import csv
import json
import re
import shlex
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

import ma2000
from daq.contracts.service.jobs import DiagnoseStudy
from daq_cli.robot.operations import RobotAccess
from extras.lab.batches import command
from extras.lab.batches.command import Asked
from extras.lab.batches.folder import write_parquet
from extras.lab.batches.study import Study
from tests.daq_cli.invoke import CommandLine
from tests.extras.lab.batches.traces import folder_of_traces, number

TRACES = 40


# ---- what `daq batch` refuses, in one line each, before anything is computed


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("simulate nowhere/traces --out o", "is no folder of traces"),
        ("simulate traces --out o", "has no trace that matches"),
        ("simulate ramp --out o", "has no trace that matches"),
        ("simulate colour:red --out o", "unknown term; allowed are kind"),
        ("simulate traces --out o --workers 0", "--workers"),
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


def test_no_parquet_of_an_earlier_run_stays_where_none_can_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = tmp_path / "table.parquet"
    assert write_parquet([{"trace": "a"}], table) == table
    monkeypatch.delitem(sys.modules, "pyarrow")
    monkeypatch.setattr(sys, "path", [])
    assert write_parquet([{"trace": "a"}], table) is None
    assert not table.exists()


@pytest.mark.slow
@pytest.mark.timeout(120)
def test_a_worker_killed_in_mid_batch_costs_no_trace_and_none_is_in_the_result_twice(tmp_path: Path) -> None:
    traces, out = folder_of_traces(tmp_path / "traces", TRACES), tmp_path / "out"
    program = [sys.executable, "-m", "tests.extras.lab.batches.killing", str(traces), str(out)]
    done = subprocess.run(program, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert (said["done"], said["failed"]) == (TRACES, 0)
    keys = Counter(json.loads(line)["key"] for line in (out / "rows.jsonl").read_text("utf-8").splitlines())
    assert keys == dict.fromkeys(map(number, range(TRACES)), 1)
    with (out / "table.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["trace"] for row in rows] == [number(index) for index in range(TRACES)]
    assert {row["state"] for row in rows} == {"done"}


# ---- docs/batches.md


PAGE = Path(__file__).parents[4].joinpath("docs", "batches.md").read_text("utf-8")
COMMANDS = re.findall(r"^\$ daq (.+)$", PAGE, re.MULTILINE)


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_the_commands_of_the_page_give_a_table_each(daq: CommandLine) -> None:
    folder_of_traces(Path("traces"), 2)
    assert len(COMMANDS) >= 5
    for line in COMMANDS:
        words = shlex.split(line)
        said = daq(*words, "--workers", "1")
        assert said.code == 0, (line, said.err)
        out = Path(words[words.index("--out") + 1])
        with (out / "table.csv").open(encoding="utf-8", newline="") as stream:
            rows = list(csv.DictReader(stream))
        assert [row["state"] for row in rows] == ["done", "done"]
        assert len(list((out / "answers").iterdir())) == 2
    answer = next(Path("fits", "answers").iterdir())
    assert daq("simulate", answer, "traces/000.mcap").code == 0
    found = ma2000.batch("simulate", "traces", "simulated", workers=1)
    assert (len(found.rows), found.failed) == (2, {})
