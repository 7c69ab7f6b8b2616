"""A batch on a real cluster: a scheduler and workers as processes, one of which is killed in mid-batch."""

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
from tests.daq_cli.invoke import CommandLine
from tests.extras.lab.batches.dask_processes import cluster
from tests.extras.lab.batches.traces import folder_of_traces, number

pytestmark = [pytest.mark.slow, pytest.mark.timeout(120)]
TRACES = 40


def finished(*words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done


def daq(*words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "import daq_cli; daq_cli.main()", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def numbers_in_rows(out: Path) -> Counter[str]:
    return Counter(json.loads(line)["key"] for line in (out / "rows.jsonl").read_text("utf-8").splitlines())


@pytest.mark.parametrize("where", ["dask", "local"])
def test_a_worker_killed_in_mid_batch_costs_no_trace_and_none_is_in_the_result_twice(
    tmp_path: Path, where: str
) -> None:
    traces, out = folder_of_traces(tmp_path / "traces", TRACES), tmp_path / "out"
    if where == "dask":
        with cluster(4) as made:
            processes = [worker.pid for worker in made.workers]
            done = finished("tests.extras.lab.batches.killing", made.url, traces, out)
            ended = [worker.poll() for worker in made.workers]
        said = json.loads(done.stdout)
        assert {pid: code for pid, code in zip(processes, ended, strict=True) if code is not None} == {
            said["killed"]: -9
        }
    else:
        said = json.loads(finished("tests.extras.lab.batches.killing", "local://4", traces, out).stdout)
    assert (said["done"], said["failed"]) == (TRACES, 0)
    assert numbers_in_rows(out) == dict.fromkeys(map(number, range(TRACES)), 1)
    with (out / "table.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["trace"] for row in rows] == [number(index) for index in range(TRACES)]
    assert {row["state"] for row in rows} == {"done"}


def test_a_batch_that_loses_its_scheduler_ends_in_one_line_and_goes_on(tmp_path: Path) -> None:
    traces, out = folder_of_traces(tmp_path / "traces", TRACES), tmp_path / "out"
    with cluster(1) as made:
        done = finished("tests.extras.lab.batches.killing", made.url, traces, out, made.scheduler.pid)
    said = json.loads(done.stdout)
    assert (said["code"], said["killed"]) == (3, made.scheduler.pid)
    assert "the connection to Dask's scheduler was lost" in said["error"]
    kept = numbers_in_rows(out)
    assert 5 <= len(kept) < TRACES
    assert daq("batch", "simulate", traces, "--out", out, "--executor", "local://1").returncode == 0
    assert numbers_in_rows(out) == dict.fromkeys(map(number, range(TRACES)), 1)


def test_a_worker_of_another_version_is_refused_by_name(tmp_path: Path) -> None:
    traces, out = folder_of_traces(tmp_path / "traces", 1), tmp_path / "out"
    other = tmp_path / "other" / "ma2000_daq-0.0.9.dist-info"
    other.mkdir(parents=True)
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: ma2000-daq\nVersion: 0.0.9\n")
    here = str(Path(__file__).parents[4])
    with cluster(1, {"PYTHONPATH": f"{other.parent}:{here}"}) as made:
        done = daq("batch", "simulate", traces, "--out", out, "--executor", made.url)
    assert (done.returncode, done.stdout) == (4, "")
    last = done.stderr.splitlines()[-1]
    assert last.startswith("daq: worker tcp://127.0.0.1:")
    assert "has ma2000-daq 0.0.9 on Python 3." in last
    assert not (out / "table.csv").exists()


def test_a_cluster_gives_the_same_table_as_this_computer(tmp_path: Path) -> None:
    traces = folder_of_traces(tmp_path / "traces", 2)
    tables = []
    with cluster(1) as made:
        for name, url in (("a", made.url), ("b", "local://1")):
            done = daq("batch", "simulate", traces, "--out", tmp_path / name, "--executor", url)
            assert done.returncode == 0, done.stderr
            with (tmp_path / name / "table.csv").open(encoding="utf-8", newline="") as stream:
                tables.append([{**row, "seconds": ""} for row in csv.DictReader(stream)])
    assert tables[0] == tables[1]


def test_jobs_are_answered_once_with_their_own_errors_and_a_missing_scheduler_is_told_in_one_line() -> None:
    """As far as one process shows it."""
    found = json.loads(finished("tests.extras.lab.batches.one_process_cluster").stdout)
    refused = found.pop("refused")
    assert found == {"count": 1, "squares": [0, 1, 4, 9, 16, 25], "failed": "ValueError('3 is none')"}
    assert refused.startswith("executor dask://127.0.0.1:9: no scheduler answers at tcp://127.0.0.1:9: ")
    assert "\n" not in refused


# ---- docs/batches.md


PAGE = Path(__file__).parents[4].joinpath("docs", "batches.md").read_text("utf-8")
COMMANDS = re.findall(r"^\$ daq (.+)$", PAGE, re.MULTILINE)


@pytest.mark.timeout(300)
def test_the_commands_of_the_page_give_a_table_each(daq: CommandLine) -> None:
    folder_of_traces(Path("traces"), 2)
    assert len(COMMANDS) >= 5
    for command in COMMANDS:
        words = shlex.split(command)
        said = daq(*words, "--executor", "local://1")
        assert said.code == 0, (command, said.err)
        out = Path(words[words.index("--out") + 1])
        with (out / "table.csv").open(encoding="utf-8", newline="") as stream:
            rows = list(csv.DictReader(stream))
        assert [row["state"] for row in rows] == ["done", "done"]
        assert len(list((out / "answers").iterdir())) == 2
    answer = next(Path("fits", "answers").iterdir())
    assert daq("simulate", answer, "traces/000.mcap").code == 0
    found = ma2000.batch("simulate", "traces", "simulated", executor="local://1")
    assert (len(found.rows), found.failed) == (2, {})
