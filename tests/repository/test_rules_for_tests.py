"""The rules of tests/conftest.py hold: each is shown a file of tests that breaks it."""

import re
from pathlib import Path

import pytest

from tests.conftest import DETERMINISTIC
from tests.order import AGAINST_THE_CLOCK
from tests.repository.inner_run import ROOT, run_folder

SKIPPING = """
import pytest

@pytest.mark.hardware
def test_of_hardware():
    pass

@pytest.mark.lab_data
def test_of_lab_data():
    pass

def test_that_lacks_something():
    pytest.skip("no browser here")

@pytest.mark.xfail(reason="known")
def test_that_is_expected_to_fail():
    assert False
"""

SKIPPING_AS_A_WHOLE = """
import pytest
pytest.importorskip("a_module_that_does_not_exist")
"""

LEAVING = """
import subprocess, sys, threading, time
import pytest
from tests import left_running

left_running.GRACE_S = 0.5  # what is left here does not end by itself

@pytest.fixture(scope="module")
def shared_process():
    return subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])

def test_that_leaves_a_thread():
    threading.Thread(target=time.sleep, args=(60,), name="forgotten", daemon=True).start()

def test_that_uses_what_its_module_shares(shared_process):
    pass

def test_that_leaves_nothing():
    thread = threading.Thread(target=time.sleep, args=(0.01,))
    thread.start()
"""


def outcomes(folder: Path, tests: str, *, ci: str = "") -> tuple[dict[str, int], str]:
    """Run a file of tests under this repository's rules; the counts of pytest's last line, and all it printed."""
    (folder / "test_example.py").write_text(tests)
    printed = run_folder(folder, ci=ci).stdout
    counts = re.findall(r"(\d+) ([a-z]+)", printed.strip().splitlines()[-1])
    return {word: int(count) for count, word in counts}, printed


@pytest.mark.parametrize(
    ("ci", "expected"),
    [("true", {"failed": 1, "skipped": 2, "xfailed": 1}), ("", {"skipped": 3, "xfailed": 1})],
    ids=["where everything is installed", "on a developer's computer"],
)
def test_a_skip_is_an_error_only_where_everything_is_installed(
    tmp_path: Path, ci: str, expected: dict[str, int]
) -> None:
    counts, printed = outcomes(tmp_path, SKIPPING, ci=ci)
    assert expected.items() <= counts.items(), printed
    assert "no browser here" in printed
    assert "passed" not in counts


def test_a_file_that_skips_as_a_whole_is_an_error_where_everything_is_installed(tmp_path: Path) -> None:
    counts, printed = outcomes(tmp_path, SKIPPING_AS_A_WHOLE, ci="true")
    assert counts.get("error") == 1, printed


def test_a_test_or_a_shared_fixture_that_leaves_something_running_fails(tmp_path: Path) -> None:
    counts, printed = outcomes(tmp_path, LEAVING)
    assert counts["passed"] == 3, printed
    assert counts["errors"] == 2, printed
    assert "left running: thread 'forgotten'" in printed
    assert "time.sleep(60)" in printed


def test_files_that_are_never_tried_again_are_there() -> None:
    for name in DETERMINISTIC:
        assert (ROOT / "tests" / name).is_file(), name
        assert any(name.startswith(f"{folder}/") for folder in AGAINST_THE_CLOCK), name


def test_every_thorough_file_is_there() -> None:
    names = (ROOT / "tests" / "thorough.txt").read_text("utf-8").split()
    assert names == sorted(set(names))
    assert [name for name in names if not (ROOT / "tests" / name).is_file()] == []


IN_ORDER = """
import pytest

@pytest.mark.parametrize("number", range(3))
def test_in_order(number, ran=[]):
    ran.append(number)
    assert ran == list(range(number + 1))
"""


def test_tests_of_a_file_run_in_order_in_one_process(tmp_path: Path) -> None:
    for number in range(4):
        (tmp_path / f"test_{number}.py").write_text(IN_ORDER)
    run = run_folder(tmp_path, "-n", "2")
    assert " 12 passed" in run.stdout, run.stdout
