"""Rules for all tests: nothing is left running, and where everything is installed nothing is skipped quietly."""

import os
from collections.abc import Generator, Iterator
from pathlib import Path

import pytest
from hypothesis import settings
from xdist.remote import Producer

from tests.left_running import Running, mark_this_process
from tests.order import Units, alternate, is_against_the_clock, is_thorough

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as `daq` does, before numpy is loaded: two workers, two cores
ROOT = Path(__file__).parent.parent
SKIPS_ARE_ERRORS = os.environ.get("CI", "").lower() in ("1", "true")
# The same examples in every run, and no test that fails because the machine was busy.
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")
DETERMINISTIC = (
    "daq/owner/test_guardian.py",
    "mock/process/test_control.py",
    "server/robot/test_control.py",
    "server/access/test_gate.py",
    "server/jobs/test_job_service.py",
    "server/robot/test_jog_moments.py",
    "daq/owner/test_owner_inbox.py",
    "server/queue/test_queue_service.py",
    "server/queue/test_queue_holds.py",
    "server/experiments/test_rules.py",
    "server/store/test_store.py",
)
"""Files in those folders that start no process and look at no clock but their own. What fails there now and then is a
race, and is not tried again."""
ATTEMPTS = 3
MAY_ALWAYS_SKIP = ("hardware", "lab_data")
"""Marks of tests that need what nobody can install: a real arm, and traces that are kept outside the repository."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--port", metavar="URL", help="run the hardware tests on the real controller at this port")
    parser.addoption(
        "--part",
        choices=("quick", "thorough"),
        help="run the files that take no time, and one path through every door (`make test`), or all others",
    )
    parser.addoption(
        "--lab-data",
        type=Path,
        metavar="FOLDER",
        help="measured traces of real rigs, each in a folder of its own; without it their tests are skipped",
    )


@pytest.fixture(scope="session")
def lab_data(request: pytest.FixtureRequest) -> Path:
    """The folder of measured traces (`--lab-data`); a test that asks for it is marked `lab_data`."""
    folder: Path = request.config.getoption("--lab-data")
    return folder


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """The files of the other part are not even read."""
    part = config.getoption("--part")
    if part is None or collection_path.is_dir() or not collection_path.name.startswith("test_"):
        return None
    return is_thorough(collection_path) == (part == "quick") or None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.config.getoption("--port") or not is_against_the_clock(item):
            continue
        if item.path.relative_to(ROOT / "tests").as_posix() in DETERMINISTIC:
            continue
        if not item.get_closest_marker("hardware"):
            item.add_marker("against_the_clock")
            item.add_marker(pytest.mark.flaky(reruns=ATTEMPTS - 1))
    alternate(items)


def pytest_fixture_setup(fixturedef: pytest.FixtureDef[object], request: pytest.FixtureRequest) -> None:
    """Refuse what pytest takes without a word: in a folder that is no package, it lives until all tests are over."""
    if fixturedef.scope == "package" and isinstance(request.node, pytest.Session):
        pytest.fail(f"{fixturedef.argname} has package scope, and its folder {fixturedef.baseid} is no package")


def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> Units:
    return Units(config, log)


def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("hardware") and not item.config.getoption("--port"):
        pytest.skip("needs a real controller: --port URL")
    folder: Path | None = item.config.getoption("--lab-data")
    if item.get_closest_marker("lab_data") and (folder is None or not folder.is_dir()):
        pytest.skip("needs measured traces that are kept outside the repository: --lab-data FOLDER")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    may_skip = any(item.get_closest_marker(mark) for mark in MAY_ALWAYS_SKIP)
    if SKIPS_ARE_ERRORS and report.skipped and not may_skip and not hasattr(report, "wasxfail"):
        report.outcome = "failed"
        report.longrepr = f"Skipped where everything is installed (CI is set): {report.longrepr}"
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    report = yield
    if SKIPS_ARE_ERRORS and report.skipped:
        report.outcome = "failed"
        report.longrepr = f"A whole file skipped where everything is installed (CI is set): {report.longrepr}"
    return report


def _check_nothing_left_running() -> Iterator[None]:
    before = Running.now()
    yield
    left = Running.now() - before
    if left and (left := left.wait()):
        message = f"left running: {left}"  # named before they are ended
        left.kill_processes()
        pytest.fail(message)


@pytest.fixture(scope="session", autouse=True)
def nothing_left_running_at_the_end() -> Iterator[None]:
    """Fail when a fixture shared by many tests leaves a thread or a process behind."""
    mark_this_process()
    yield from _check_nothing_left_running()


@pytest.fixture(autouse=True)
def nothing_left_running(nothing_left_running_at_the_end: None) -> Iterator[None]:
    """Fail a test that leaves a thread or a process behind."""
    yield from _check_nothing_left_running()
