"""The URLs of clusters, what `daq batch` refuses, and its tables."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from daq.contracts.errors import SpecError
from daq.contracts.extras import MissingExtraError
from daq.contracts.service.jobs import DiagnoseStudy
from daq.executors.workers import OtherVersionError
from daq_cli.robot.operations import RobotAccess
from extras.lab.batches import command
from extras.lab.batches.command import Asked
from extras.lab.batches.executors import open_workers, parse_address
from extras.lab.batches.folder import write_parquet
from extras.lab.batches.program import Checked, Program
from extras.lab.batches.study import Study
from tests.daq.executors.by_hand import square
from tests.daq_cli.invoke import CommandLine


@pytest.mark.parametrize(
    ("url", "kind", "place"),
    [
        ("local://4", "local", "4"),
        ("local://", "local", ""),
        ("dask://host", "dask", "host:8786"),
        ("dask://[::1]:9000", "dask", "[::1]:9000"),
        ("dask+tls://host:8786", "dask+tls", "host:8786"),
    ],
)
def test_what_is_understood(url: str, kind: str, place: str) -> None:
    found = parse_address(url)
    assert (found.kind, found.target) == (kind, place)


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("", "is not an executor URL; write local://4"),
        ("slurm://compute", "is not an executor URL; write local://4 or dask://host:8786"),
        ("local://four", "write the number of processes"),
        ("local://0", "0 workers; 1 to 10000"),
        ("http://[", "Invalid IPv6 URL"),
        ("dask://host:port", "Port could not be cast"),
        ("dask://", "names no scheduler"),
    ],
)
def test_what_is_refused(url: str, says: str) -> None:
    with pytest.raises(SpecError) as refused:
        parse_address(url)
    assert says in str(refused.value)
    assert "\n" not in str(refused.value)


def test_without_its_package_a_cluster_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"executor dask://.*distributed.*\[cluster\]"):
        open_workers("dask://127.0.0.1:9")


def test_every_executor_of_the_page_is_understood() -> None:
    page = Path(__file__).parents[4].joinpath("docs", "batches.md").read_text("utf-8")
    urls = re.findall(r"`((?:local|dask|dask\+tls)://[^`]*)`", page)
    assert {parse_address(url).kind for url in urls} == {"local", "dask", "dask+tls"}


def test_a_worker_of_another_version_is_refused_by_name() -> None:
    with pytest.raises(OtherVersionError, match=r"worker .*process \d+: has ma2000-daq .*, but ma2000-daq 0\.0\.1 on "):
        Checked(square, Program("0.0.1", "3.9"))(2)


# ---- what `daq batch` refuses, in one line each, before anything is computed


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("simulate nowhere/traces --out o", "is no folder of traces"),
        ("simulate traces --out o", "has no trace that matches"),
        ("simulate ramp --out o", "has no trace that matches"),
        ("simulate colour:red --out o", "unknown term; allowed are kind"),
        ("simulate traces --out o --executor 4", "executor '4': is not an executor URL; write local://4"),
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


def test_no_parquet_of_an_earlier_run_stays_where_none_can_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = tmp_path / "table.parquet"
    assert write_parquet([{"trace": "a"}], table) == table
    monkeypatch.delitem(sys.modules, "pyarrow")
    monkeypatch.setattr(sys, "path", [])
    assert write_parquet([{"trace": "a"}], table) is None
    assert not table.exists()
