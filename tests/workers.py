"""The tests on several processes: `pytest --workers N`.

They are collected once, in one process, which then divides. Each of N workers takes the next unit of work
(tests/order.py) until there is none, and tells the first process what its tests have brought; that one reports it, as
it would have by itself. A test in which a worker dies has failed, and the others of its unit run in another.
"""

import gc
import os
import signal
import struct
import traceback
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from multiprocessing.connection import Connection, Pipe, wait
from typing import Any, Never

import pytest
from _pytest.nodes import Node

from tests.order import units_of

Unit = list[pytest.Item]
Said = tuple[str, dict[str, Any]]
"""A hook of pytest, with its arguments as they pass from process to process."""
RAISED = "raised"
NUMBER = struct.Struct("i")
PRINTED = ("pytest_runtest_logstart", "pytest_runtest_logreport", "pytest_warning_recorded")


def run_tests(session: pytest.Session, count: int) -> bool:
    """Run the tests of a session in so many processes, and report them in this one."""
    session.config._tmp_path_factory.getbasetemp()  # one folder for all: its end is this process's
    gc.freeze()  # so that no worker copies what all share
    units = units_of(session.items)
    while units:
        finished = _Crew(session, units).run(count)
        left = ([item for item in unit if item.nodeid not in finished] for unit in units)
        units = [unit for unit in left if unit]
    return True


@dataclass
class _Worker:
    """A process that runs tests, as the first process sees it."""

    process: int
    end: int  # readable when the process has ended
    messages: Connection
    test: str = ""  # the newest it has begun
    said: list[Said] = field(default_factory=list)  # of that test, kept until it is through: tests are told one by one


class _Crew:
    """The workers of one round, and what they say."""

    def __init__(self, session: pytest.Session, units: list[Unit]) -> None:
        self.session, self.units = session, units
        self.workers: list[_Worker] = []
        self.finished: set[str] = set()

    def run(self, count: int) -> set[str]:
        """Run what no dying worker keeps from running; the names of the tests that were."""
        tasks, numbers = os.pipe()
        os.write(numbers, b"".join(NUMBER.pack(number) for number in range(len(self.units))))
        os.close(numbers)
        try:
            for number in range(min(count, len(self.units))):
                self.workers.append(self._start(number, tasks))
            while self.workers:
                ready = wait([one for worker in self.workers for one in (worker.end, worker.messages)])
                for worker in [worker for worker in self.workers if {worker.end, worker.messages}.intersection(ready)]:
                    self._listen(worker)
        except BaseException:
            self._end_workers()
            raise
        finally:
            os.close(tasks)
        return self.finished

    def _start(self, number: int, tasks: int) -> _Worker:
        receiver, sender = Pipe(duplex=False)
        with warnings.catch_warnings(action="ignore", category=DeprecationWarning):  # of a thread that a library began
            process = os.fork()
        os.setpgid(process, process)  # 0 in the worker. Ctrl-C is the first process's, which hands it on once
        if process == 0:
            for worker in self.workers:
                worker.messages.close()
                os.close(worker.end)
            receiver.close()
            _work(self.session, _units_taken(tasks, self.units), sender, number)
        sender.close()
        return _Worker(process, os.pidfd_open(process), receiver)

    def _listen(self, worker: _Worker) -> None:
        """Take in what a worker has said; where it has ended, all that it has left to say, and how it ended."""
        ended = worker.end in wait([worker.end], timeout=0)
        try:
            while worker.messages.poll():
                self._take_in(worker, worker.messages.recv())
        except EOFError:
            ended = True
        if ended:
            self.workers.remove(worker)
            self._part_with(worker)

    def _take_in(self, worker: _Worker, said: Said) -> None:
        hook, arguments = said
        if hook == RAISED:
            raise arguments["error"]
        if hook == "pytest_runtest_logstart":
            worker.test = arguments["nodeid"]
        worker.said.append(said)
        if hook == "pytest_runtest_logfinish":
            self.finished.add(worker.test)
            self._tell(worker)
        elif worker.test in self.finished:  # between two tests
            self._tell(worker)

    def _tell(self, worker: _Worker) -> None:
        """Report what a worker has said, and stop as the session would."""
        config, said, worker.said = self.session.config, worker.said, []
        for name, arguments in said:
            hook = getattr(config.hook, name)
            if name == "pytest_runtest_logreport":
                hook(report=config.hook.pytest_report_from_serializable(config=config, data=arguments))
            elif name == "pytest_warning_recorded":
                warning = _warning(**arguments.pop("warning_message"))
                hook.call_historic(kwargs={"warning_message": warning, **arguments})
            else:
                hook(**arguments)
        if self.session.shouldfail:
            raise self.session.Failed(self.session.shouldfail)
        if self.session.shouldstop:
            raise self.session.Interrupted(self.session.shouldstop)

    def _part_with(self, worker: _Worker) -> None:
        """A worker has ended; where it had not said so before, the test that it ran last has failed."""
        worker.messages.close()
        os.close(worker.end)
        code = os.waitstatus_to_exitcode(os.waitpid(worker.process, 0)[1])
        if code == 0:
            return
        how = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        if not worker.test:
            raise RuntimeError(f"a process of the tests died before its first test: {how}")
        item = next(item for unit in self.units for item in unit if item.nodeid == worker.test)
        message = f"Its process died: {how}"
        report = pytest.TestReport(item.nodeid, item.location, {}, "failed", message, "call")
        data = self.session.config.hook.pytest_report_to_serializable(config=self.session.config, report=report)
        worker.said.append(("pytest_runtest_logreport", data))
        self.finished.add(worker.test)
        self._tell(worker)

    def _end_workers(self) -> None:
        """Interrupt what runs, and let it tidy up; a second Ctrl-C does not wait for that."""
        for worker in self.workers:
            worker.messages.close()  # nobody listens any more
            _send_signal(worker, signal.SIGINT)
        try:
            for worker in self.workers:
                os.waitpid(worker.process, 0)
        except BaseException:
            for worker in self.workers:
                _send_signal(worker, signal.SIGKILL)
            raise


def _send_signal(worker: _Worker, number: signal.Signals) -> None:
    try:
        os.killpg(worker.process, number)
    except ProcessLookupError:
        return


def _warning(text: str, category: str, filename: str, lineno: int) -> warnings.WarningMessage:
    kind = type(category, (Warning,), {})
    return warnings.WarningMessage(kind(text), kind, filename, lineno)


# ---- in a worker


class _Teller:
    """Says to the first process what a test has brought."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config
        self.messages: Connection | None = None

    def _say(self, hook: str, arguments: dict[str, Any]) -> None:
        if self.messages:
            self.messages.send((hook, arguments))

    def pytest_runtest_logstart(self, nodeid: str, location: tuple[str, int | None, str]) -> None:
        self._say("pytest_runtest_logstart", {"nodeid": nodeid, "location": location})

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        data = self.config.hook.pytest_report_to_serializable(config=self.config, report=report)
        self._say("pytest_runtest_logreport", data)

    def pytest_runtest_logfinish(self, nodeid: str, location: tuple[str, int | None, str]) -> None:
        self._say("pytest_runtest_logfinish", {"nodeid": nodeid, "location": location})

    def pytest_warning_recorded(
        self, warning_message: warnings.WarningMessage, when: str, nodeid: str, location: tuple[str, int, str] | None
    ) -> None:
        data = {
            "text": str(warning_message.message),
            "category": warning_message.category.__name__,
            "filename": warning_message.filename,
            "lineno": warning_message.lineno,
        }
        arguments = {"warning_message": data, "when": when, "nodeid": nodeid, "location": location}
        self._say("pytest_warning_recorded", arguments)


def _units_taken(tasks: int, units: list[Unit]) -> Iterator[Unit]:
    while number := os.read(tasks, NUMBER.size):
        yield units[NUMBER.unpack(number)[0]]


def _work(session: pytest.Session, units: Iterator[Unit], messages: Connection, number: int) -> Never:
    """Run units, and end this process."""
    code = 1
    try:
        _become_worker(session.config, messages, number)
        try:
            _run_units(session, units)
        except (KeyboardInterrupt, pytest.exit.Exception, session.Failed) as error:
            messages.send((RAISED, {"error": error}))
        except Exception:  # noqa: BLE001
            messages.send((RAISED, {"error": RuntimeError(traceback.format_exc())}))
        code = 0
    except BrokenPipeError:
        pass  # the first process listens no more
    except BaseException:  # noqa: BLE001
        traceback.print_exc()
    finally:
        os._exit(code)


def _become_worker(config: pytest.Config, messages: Connection, number: int) -> None:
    """Of what the processes of a division share, take what must be this one's own; leave reporting to the first."""
    manager = config.pluginmanager
    terminal = manager.get_plugin("terminalreporter")
    for hook in PRINTED:
        getattr(config.hook, hook)._remove_plugin(terminal)
    manager.register(teller := _Teller(config))  # which is told of the warnings that there have been
    teller.messages = messages
    capture = manager.get_plugin("capturemanager")
    capture.stop_global_capturing()  # the files of the capture: places in them are shared
    capture.start_global_capturing()
    capture.suspend_global_capture()
    folders = config._tmp_path_factory
    folders._basetemp = folders.getbasetemp() / f"worker-{number}"
    folders._basetemp.mkdir(mode=0o700, exist_ok=True)


class _Next:
    """What comes after the last test of a unit, in place of the test itself: another unit is taken only when pytest
    asks whether that shares fixtures, at the test's end. Until then another worker may take it."""

    def __init__(self, units: Iterator[Unit]) -> None:
        self.units = units

    @cached_property
    def unit(self) -> Unit:
        """Empty when there is none left."""
        return next(self.units, [])

    def listchain(self) -> list[Node]:
        """As of the first test of the unit."""
        return self.unit[0].listchain() if self.unit else []


def _run_units(session: pytest.Session, units: Iterator[Unit]) -> None:
    item: pytest.Item | None = None
    following = _Next(units)
    try:
        while unit := following.unit:
            following = _Next(units)
            for item, afterwards in zip(unit, [*unit[1:], following], strict=True):
                session.config.hook.pytest_runtest_protocol(item=item, nextitem=afterwards)
                if session.shouldfail:
                    raise session.Failed(session.shouldfail)
                if session.shouldstop:
                    raise session.Interrupted(session.shouldstop)
    finally:
        session._setupstate.teardown_exact(None)
    if item is not None:
        _unconfigure(session.config, item)


def _unconfigure(config: pytest.Config, last: pytest.Item) -> None:
    """What nobody closed or awaited raises only here; the test that ran last is named for it."""
    try:
        teller = config.hook.pytest_runtest_logreport
        config._ensure_unconfigure()
    except Exception:  # noqa: BLE001
        teller(report=pytest.TestReport(last.nodeid, last.location, {}, "failed", traceback.format_exc(), "teardown"))
