"""Tests on several processes are reported as on one (tests/workers.py)."""

import os
import re
import signal
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from tests.repository.inner_run import command, environment, run_folder

OF_EVERY_KIND = """
import os, warnings
import pytest

@pytest.fixture
def broken():
    raise OSError("no such fixture")

@pytest.fixture(scope="module")
def ends_badly():
    yield
    raise OSError("a bad end")

def test_that_fails(record_property):
    record_property("of", "one")
    print("said before")
    assert [1, 2] == [1, 3]

def test_that_lacks_something():
    pytest.skip("no browser here")

@pytest.mark.xfail(reason="known")
def test_that_is_expected_to_fail():
    assert False

def test_that_warns():
    warnings.warn("old")

@pytest.mark.filterwarnings("default")
def test_that_may_warn():
    warnings.warn("older")

def test_with_a_broken_fixture(broken):
    pass

@pytest.mark.flaky(reruns=1)
def test_that_is_tried_again(attempts=[]):
    attempts.append(1)
    assert len(attempts) == 2

def test_whose_module_ends_badly(ends_badly):
    pass
"""

ONE_AFTER_THE_OTHER = """
import os
import pytest

@pytest.fixture(scope="session")
def shared(tmp_path_factory):
    yield tmp_path_factory.mktemp("shared") / "runs"
    print("the session has ended")

@pytest.mark.parametrize("number", range(3))
def test_in_order(number, shared):
    with shared.open("a") as file:
        print(os.getpid(), number, file=file)
    assert shared.read_text().splitlines() == [f"{os.getpid()} {earlier}" for earlier in range(number + 1)]
"""

DYING = """
import os, signal

def test_before():
    pass

def test_that_ends_its_process():
    os.kill(os.getpid(), signal.SIGKILL)

def test_after():
    pass
"""

WAITING = """
from pathlib import Path
import os, sys, threading
import pytest

@pytest.fixture
def something_to_end():
    yield
    Path(__file__).with_suffix(".ended").touch()

def test_that_waits(something_to_end):
    with open(os.environ["WAITING"], "w") as fifo:
        print(os.getpid(), file=fifo)
    threading.Event().wait()
"""

FAILING = """
import os

def test_that_fails_once_another_waits():
    with open(os.environ["WAITING"]) as fifo:
        fifo.read()
    assert False
"""


CHANGES = re.compile(r"in [\d.]+s|0x\w+|\[ *\d+%\]| +$", re.MULTILINE)
"""Times, addresses of objects, how far a run is."""


def told(folder: Path, *options: str) -> tuple[int, list[str], list[tuple[str | None, ...]]]:
    """What a run of pytest tells: its exit code, the lines that it prints, and its report as JUnit."""
    junit = folder / "junit.xml"
    run = run_folder(folder, f"--junit-xml={junit}", "-o", "junit_family=xunit1", "-v", *options)
    assert not run.stderr
    assert "INTERNALERROR" not in run.stdout, run.stdout
    cases = ET.fromstring(CHANGES.sub("", junit.read_text("utf-8"))).iter("testcase")
    parts = [(case.get("name"), part.tag, part.get("message"), part.text) for case in cases for part in [case, *case]]
    lines = CHANGES.sub("", run.stdout).splitlines()
    return run.returncode, sorted(line.strip("=-_ ") for line in lines), sorted(parts, key=str)


def test_reports_are_those_of_one_process(tmp_path: Path) -> None:
    for name in ("one", "other"):
        (tmp_path / f"test_{name}.py").write_text(OF_EVERY_KIND)
    alone = told(tmp_path)
    assert alone[0] == 1
    assert told(tmp_path, "--workers", "2") == alone
    (tmp_path / "test_other.py").unlink()
    (tmp_path / "test_one.py").write_text("def test_that_passes(): pass")
    assert told(tmp_path, "--workers", "2") == told(tmp_path)


def test_tests_of_a_file_run_in_order_in_one_process(tmp_path: Path) -> None:
    for number in range(4):
        (tmp_path / f"test_{number}.py").write_text(ONE_AFTER_THE_OTHER.replace("runs", f"runs-{number}"))
    run = run_folder(tmp_path, "--workers", "2")
    assert " 12 passed" in run.stdout, run.stdout


def test_a_test_in_which_a_worker_dies_has_failed_and_the_others_run(tmp_path: Path) -> None:
    (tmp_path / "test_dying.py").write_text(DYING)
    (tmp_path / "test_other.py").write_text(ONE_AFTER_THE_OTHER)
    run = run_folder(tmp_path, "--workers", "2")
    assert run.returncode == 1
    assert re.findall("^FAILED (.*)$", run.stdout, re.MULTILINE) == [
        "test_dying.py::test_that_ends_its_process - Its process died: signal SIGKILL"
    ], run.stdout
    assert "1 failed, 5 passed" in run.stdout


def test_a_worker_that_cannot_begin_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "conftest.py").write_text("import os\ndef pytest_runtest_protocol(item): os._exit(7)")
    (tmp_path / "test_one.py").write_text("def test_that_passes(): pass")
    run = run_folder(tmp_path, "--workers", "2")
    assert run.returncode == pytest.ExitCode.INTERNAL_ERROR
    assert "a process of the tests died before its first test: exit code 7" in run.stdout


@pytest.fixture
def fifo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What a test that waits writes its process's number into."""
    path = tmp_path / "fifo"
    os.mkfifo(path)
    monkeypatch.setenv("WAITING", str(path))
    return path


def test_the_first_failure_ends_all_where_that_is_asked_for(tmp_path: Path, fifo: Path) -> None:
    (tmp_path / "test_waiting.py").write_text(WAITING)
    (tmp_path / "test_failing.py").write_text(FAILING)
    run = run_folder(tmp_path, "--workers", "2", "-x")
    assert "stopping after 1 failures" in run.stdout, run.stdout
    assert "1 failed in" in run.stdout
    assert (tmp_path / "test_waiting.ended").exists()


def test_ctrl_c_ends_all_workers_once_they_have_tidied_up(tmp_path: Path, fifo: Path) -> None:
    for name in ("one", "other"):
        (tmp_path / f"test_{name}.py").write_text(WAITING)
    with (
        fifo.open("r+b", buffering=0) as numbers,
        subprocess.Popen(
            command(tmp_path, "--workers", "2"), cwd=tmp_path, env=environment(), stdout=subprocess.PIPE, text=True
        ) as run,
    ):
        processes = [int(numbers.readline()) for _ in range(2)]
        os.kill(run.pid, signal.SIGINT)
        printed = run.communicate(timeout=60)[0]
    assert run.returncode == pytest.ExitCode.INTERRUPTED
    assert "KeyboardInterrupt" in printed
    assert {path.stem for path in tmp_path.glob("*.ended")} == {"test_one", "test_other"}
    assert [process for process in processes if Path(f"/proc/{process}").exists()] == []
