"""Tries mutants in copies of a process that has imported code and tests already; `mutation` uses it as a pytest plugin.

Starting pytest and importing everything costs seconds, most tests cost milliseconds. So the tests are collected once.
One fork runs them all without a fault, and notes how long each takes and which functions it calls. Then each mutant has
a fork of its own, in which the faulty function's code replaces the right one and only the tests that call the function
run, the quickest first, up to the first that fails.

What is decided when a module is imported (constants, defaults, decorators), and functions that no test calls in its own
process (compiled ones, those of other processes), cannot be tried like this. `mutation` tries them in a
process of their own, as it does with everything that lives on here.
"""

from __future__ import annotations

import gc
import os
import pickle
import select
import signal
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import CodeType, FrameType, FunctionType
from typing import Any, NoReturn, TypeVar

import pytest

from benchmarks.mutants import Mutant

ORDERS = "MUTATION_ORDERS"
"""Environment variable with the path of a pickled `Orders`."""
GRACE_S = 20.0
"""Time that a mutant has beyond three times what its tests take without a fault."""
BASELINE_LIMIT_S = 3600.0
Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Orders:
    """What the plugin is to do, and the file that takes its `Findings`."""

    mutants: tuple[Mutant, ...]
    longest_s: float
    answer: Path
    leave_out_failing: bool = False


@dataclass
class Findings:
    """Seconds of each test; the tests that fail without any fault; each mutant that was killed, with the test that
    failed ("" at the time limit); and those that survived. The others could not be tried here."""

    seconds: dict[str, float] = field(default_factory=dict)
    failing: list[str] = field(default_factory=list)
    broken: str = ""
    killed: dict[Mutant, str] = field(default_factory=dict)
    survived: list[Mutant] = field(default_factory=list)


@dataclass
class _Without:
    """What the tests do without a fault: seconds of each, and by function, as (file, name), the tests that call it."""

    seconds: dict[str, float] = field(default_factory=dict)
    callers: dict[tuple[str, str], list[str]] = field(default_factory=lambda: defaultdict(list))
    failing: list[str] = field(default_factory=list)


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop(session: pytest.Session) -> bool | None:
    """Takes the place of the plain run of the collected tests."""
    if session.testsfailed or ORDERS not in os.environ:
        return None
    orders: Orders = pickle.loads(Path(os.environ[ORDERS]).read_bytes())
    files = {str(session.config.rootpath / mutant.file) for mutant in orders.mutants}
    without = _in_a_fork(lambda: _watched(session.items, files, orders), BASELINE_LIMIT_S)
    findings = Findings()
    if without is None or (without.failing and not orders.leave_out_failing):
        findings.broken = without.failing[0] if without else "no end within the time limit"
    else:
        findings.seconds, findings.failing = without.seconds, without.failing
        for mutant in orders.mutants:
            _try(session, mutant, without, orders, findings)
    orders.answer.write_bytes(pickle.dumps(findings))
    return True


def _try(session: pytest.Session, mutant: Mutant, without: _Without, orders: Orders, findings: Findings) -> None:
    file = session.config.rootpath / mutant.file
    change = change_of(file.read_bytes(), mutant, str(file))
    if change is None:
        return
    name, code = change
    seconds = {
        test: without.seconds[test]
        for test in without.callers.get((str(file), name), ())
        if without.seconds[test] <= orders.longest_s
    }
    items = sorted((item for item in session.items if item.nodeid in seconds), key=lambda item: seconds[item.nodeid])
    if not items:
        return

    def faulty() -> str:
        return _first_failure(items) if replace(str(file), name, code) else ""

    failed = _in_a_fork(faulty, 3.0 * sum(seconds.values()) + GRACE_S)
    if failed == "":
        findings.survived.append(mutant)
    else:
        findings.killed[mutant] = failed or ""


# ---- one function's code for another's


def change_of(source: bytes, mutant: Mutant, file: str) -> tuple[str, CodeType] | None:
    """Name and new code of the function that a mutant changes; None where it changes something else."""
    right, wrong = _functions(source, file), _functions(mutant.applied(source), file)
    parts = mutant.function.split(".")
    for end in range(1, len(parts) + 1):  # a function inside another belongs to the code of the outer one
        name = ".".join(parts[:end])
        if len(right.get(name, ())) == len(wrong.get(name, ())) == 1:
            (before,), (after,) = right[name], wrong[name]
            return None if _same(before, after) or before.co_freevars != after.co_freevars else (name, after)
    return None


def _functions(source: bytes, file: str) -> dict[str, list[CodeType]]:
    """Code of each function of a file that lies in no other function, by its name."""
    found: dict[str, list[CodeType]] = defaultdict(list)
    waiting = [compile(source, file, "exec", dont_inherit=True)]
    while waiting:
        for code in waiting.pop().co_consts:
            if not isinstance(code, CodeType) or code.co_name.startswith("<"):
                continue
            if code.co_flags & 0x1:  # CO_OPTIMIZED: a function, not the body of a class
                found[code.co_qualname].append(code)
            else:
                waiting.append(code)
    return found


def _same(one: Any, other: Any) -> bool:
    """Whether two pieces of code, or constants of them, do the same: line numbers do not count."""
    if not isinstance(one, CodeType) or not isinstance(other, CodeType):
        return type(one) is type(other) and repr(one) == repr(other)
    return (
        (one.co_code, one.co_names, one.co_varnames) == (other.co_code, other.co_names, other.co_varnames)
        and len(one.co_consts) == len(other.co_consts)
        and all(map(_same, one.co_consts, other.co_consts))
    )


def replace(file: str, name: str, code: CodeType) -> bool:
    """Gives every function of this file and name in the process new code; whether there was one."""
    functions = [
        each
        for each in gc.get_objects()
        if isinstance(each, FunctionType) and each.__code__.co_filename == file and each.__code__.co_qualname == name
    ]
    for function in functions:
        function.__code__ = code
    return bool(functions)


# ---- tests, run in a fork


def _in_a_fork(work: Callable[[], Answer], limit_s: float) -> Answer | None:
    """What `work` returns in a fork of this process; None when it takes too long. Everything it began is ended."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        _answer(work, writing)
    os.close(writing)
    said = bytearray()
    deadline = time.monotonic() + limit_s
    ended = False
    try:
        while not ended and select.select([reading], [], [], max(0.0, deadline - time.monotonic()))[0]:
            piece = os.read(reading, 1 << 16)
            said += piece
            ended = not piece
        return pickle.loads(said) if ended and said else None
    finally:
        os.close(reading)
        with suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)
        os.waitpid(child, 0)


def _answer(work: Callable[[], object], pipe: int) -> NoReturn:
    try:
        os.setpgid(0, 0)
        os.set_inheritable(pipe, False)
        silence = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silence, 1)
        os.dup2(silence, 2)
        with open(pipe, "wb") as answer:
            answer.write(pickle.dumps(work()))
    finally:
        os._exit(0)


def _first_failure(items: list[pytest.Item]) -> str:
    """Name of the first test that fails; "" when none does."""
    failures = _Failures()
    items[0].config.pluginmanager.register(failures)
    for item, following in zip(items, [*items[1:], None], strict=True):
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
        if failures.names:
            return failures.names[0]
    return ""


class _Failures:
    """Hears of every test that failed."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Notes the test when it failed for good."""
        if report.failed:
            self.names.append(report.nodeid)


def _watched(items: list[pytest.Item], files: set[str], orders: Orders) -> _Without:
    """Runs every test. Those that took too long run once more, since the first time may have gone into compiling."""
    without = _Without()
    failures = _Failures()
    items[0].config.pluginmanager.register(failures)
    for item, following in zip(items, [*items[1:], None], strict=True):
        called: set[CodeType] = set()
        limit_s = 2.0 * orders.longest_s if orders.leave_out_failing else 0.0
        with _calls_into(files, called), _interrupted(limit_s):
            without.seconds[item.nodeid] = _seconds(item, following)
        if without.seconds[item.nodeid] > orders.longest_s and not failures.names:
            without.seconds[item.nodeid] = _seconds(item, following)
        if failures.names:
            without.failing.append(item.nodeid)
            failures.names.clear()
            if not orders.leave_out_failing:
                break
            del without.seconds[item.nodeid]
            continue
        for code in called:
            without.callers[code.co_filename, code.co_qualname.partition(".<locals>")[0]].append(item.nodeid)
    without.callers = {function: sorted(set(tests)) for function, tests in without.callers.items()}
    return without


@contextmanager
def _interrupted(after_s: float) -> Iterator[None]:
    """Fails what takes longer; 0: nothing does."""

    def fail(_signal: int, _frame: FrameType | None) -> NoReturn:
        raise TimeoutError(f"longer than {after_s:g} s")

    before = signal.signal(signal.SIGALRM, fail)
    signal.setitimer(signal.ITIMER_REAL, after_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _seconds(item: pytest.Item, following: pytest.Item | None) -> float:
    begun = time.monotonic()
    item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
    return time.monotonic() - begun


@contextmanager
def _calls_into(files: set[str], called: set[CodeType]) -> Iterator[None]:
    """Collects the code of functions of these files that is called meanwhile, in threads too."""

    def hear(frame: FrameType, event: str, _arg: object) -> None:
        if event == "call" and frame.f_code.co_filename in files:
            called.add(frame.f_code)

    threading.setprofile(hear)
    sys.setprofile(hear)
    try:
        yield
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
