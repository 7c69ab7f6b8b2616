"""The rules of tests/conftest.py hold, and the mutation tool makes the faults it promises."""

import re
from pathlib import Path

import pytest

from benchmarks.mutants import Mutant, mutants_of
from benchmarks.mutation import equivalents
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
def test_a_skip_is_an_error_where_all_is_installed(tmp_path: Path, ci: str, expected: dict[str, int]) -> None:
    counts, printed = outcomes(tmp_path, SKIPPING, ci=ci)
    assert expected.items() <= counts.items(), printed
    assert "no browser here" in printed
    assert "passed" not in counts


def test_a_file_that_skips_as_a_whole_or_leaves_something_running_fails(tmp_path: Path) -> None:
    counts, printed = outcomes(tmp_path, SKIPPING_AS_A_WHOLE, ci="true")
    assert counts.get("error") == 1, printed
    counts, printed = outcomes(tmp_path, LEAVING)
    assert counts["passed"] == 3, printed
    assert counts["errors"] == 2, printed
    assert "left running: thread 'forgotten'" in printed
    assert "time.sleep(60)" in printed


def test_files_that_the_rules_name_are_there() -> None:
    for name in DETERMINISTIC:
        assert (ROOT / "tests" / name).is_file(), name
        assert any(name.startswith(f"{folder}/") for folder in AGAINST_THE_CLOCK), name
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


# ---- The mutation tool makes the faults it promises

SOURCE = b'''"""Text 1."""
LIMIT: float = 2.0

def within(x: int | None, low: int = 3) -> bool:
    """Text 2."""
    if x is None or not x:
        raise ValueError(f"{x - 1} of 5")
    self.seen += 1
    self.last = x
    log.info("seen", 7)
    return low <= -x < LIMIT
'''


def test_each_operator_number_condition_statement_and_answer_gets_a_fault_of_its_own() -> None:
    changes = {(mutant.line, mutant.was, mutant.now) for mutant in mutants_of(SOURCE, "a.py")}
    assert changes == {
        (2, "2.0", "4.0"),
        (4, "3", "4"),
        (6, "x is None or not x", "not (x is None or not x)"),
        (6, "x is None or not x", "x is None and (not x)"),
        (6, "x is None", "x is not None"),
        (6, "not x", "x"),
        (7, "raise ValueError(f'{x - 1} of 5')", "pass"),
        (8, "self.seen += 1", "pass"),
        (8, "self.seen += 1", "self.seen -= 1"),
        (8, "1", "2"),
        (9, "self.last = x", "pass"),
        (11, "low <= -x < LIMIT", "None"),
        (11, "low <= -x < LIMIT", "low < -x < LIMIT"),
        (11, "low <= -x < LIMIT", "low <= -x <= LIMIT"),
        (11, "-x", "x"),
    }


def test_a_mutant_differs_in_one_place_and_every_equivalent_one_exists() -> None:
    for mutant in mutants_of(SOURCE, "a.py"):
        changed = mutant.applied(SOURCE)
        compile(changed, "a.py", "exec")
        assert changed[: mutant.start] == SOURCE[: mutant.start]
        assert changed.endswith(SOURCE[mutant.end :])
        assert changed != SOURCE
    listed = set(equivalents())
    made = {mutant.identity for file in {file for file, *_ in listed} for mutant in _mutants_of_file(file)}
    assert listed - made == set()


def _mutants_of_file(file: str) -> list[Mutant]:
    return mutants_of((ROOT / file).read_bytes(), file)
