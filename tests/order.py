"""In which order the test files run, and which of them stay with one worker."""

from functools import cache
from pathlib import Path

import pytest
from xdist.scheduler import LoadScopeScheduling

TESTS = Path(__file__).parent
AGAINST_THE_CLOCK = (
    "contract",
    "daq/owner",
    "daq_cli",
    "daq/client",
    "daq/transport",
    "deploy",
    "extras",
    "mock/process",
    "server",
)
"""Folders of tests with processes in real time. A machine that gives them no processor for half a second makes them
fail, rightly (a mock that is silent for so long is a controller that has gone), and says nothing of the product. They
are tried again, and the summary names each that was: one that comes up again and again is a race, not a busy machine.
What runs on a real arm is never repeated by itself."""
DOORS = (
    "contract/test_reading.py",
    "daq_cli/test_run.py",
    "daq_cli/models/test_diagnose.py",
    "ma2000/test_arm.py",
    "mock/process/test_process.py",
    "server/api/test_wrong_input.py",
    "server/dashboard/test_stop.py",
)
"""Files that `make test` runs all the same: one path through every door."""
ONE_WORKER = ("server/dashboard", "server/jobs", "server", "extras/lab", "deploy", "extras/thesis")
"""Folders whose tests share a service, a browser or a reproduction of the thesis, each costly to make: one worker runs
the whole folder."""


def is_thorough(path: Path) -> bool:
    """Whether a file of tests takes long (`thorough.txt`), and is no door."""
    name = path.relative_to(TESTS).as_posix()
    return name in _thorough() and name not in DOORS


@cache
def _thorough() -> frozenset[str]:
    return frozenset((TESTS / "thorough.txt").read_text("utf-8").split())


def is_against_the_clock(test: pytest.Item) -> bool:
    """Whether the test starts processes that run in real time."""
    return _lies_below(test.path, AGAINST_THE_CLOCK)


@cache
def _lies_below(path: Path, folders: tuple[str, ...]) -> bool:
    return any(path.is_relative_to(TESTS / folder) for folder in folders)


@cache
def unit_of(path: Path) -> str:
    """The unit of work, all of which one worker runs, that a test file belongs to: a folder's name, or its own.

    A file that is not below `tests` is named in full.
    """
    for folder in ONE_WORKER:
        if path.is_relative_to(TESTS / folder):
            return folder
    return path.relative_to(TESTS).as_posix() if path.is_relative_to(TESTS) else str(path)


class Units(LoadScopeScheduling):
    """Of tests on several processes, one worker runs a unit."""

    def _split_scope(self, nodeid: str) -> str:
        return unit_of(TESTS.parent / nodeid.partition("::")[0])


def units_of(items: list[pytest.Item]) -> list[list[pytest.Item]]:
    """The tests by their units of work, in the order of `items`."""
    units: dict[str, list[pytest.Item]] = {}
    for item in items:
        units.setdefault(unit_of(item.path), []).append(item)
    return list(units.values())


def alternate(items: list[pytest.Item]) -> None:
    """Put units that wait for processes in real time between units that compute, folders and doors first: they are the
    largest. Run one kind after the other, the cores would be idle during the first and short during the second."""
    kinds: dict[bool, list[list[pytest.Item]]] = {True: [], False: []}
    for unit in units_of(items):
        kinds[is_against_the_clock(unit[0])].append(unit)
    mixed: list[tuple[float, list[pytest.Item]]] = []
    for units in kinds.values():
        units.sort(key=_heaviness)
        mixed += [((number + 0.5) / len(units), unit) for number, unit in enumerate(units)]
    mixed.sort(key=lambda placed: placed[0])
    items[:] = [item for _, unit in mixed for item in unit]


def _heaviness(unit: list[pytest.Item]) -> int:
    """Small for what must begin early: else one process would have it left when all others have ended."""
    path = unit[0].path
    if not path.is_relative_to(TESTS):
        return 0
    if unit_of(path) in ONE_WORKER:
        return -len(unit)
    return -1 if path.relative_to(TESTS).as_posix() in DOORS else 0
