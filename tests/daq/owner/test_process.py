"""An owner on demand, ended in every way from outside: the arm is frozen, the trace closed, the reason told."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from daq.contracts import exit_codes
from daq.contracts.errors import OrderFailedError
from daq.contracts.experiment import ExperimentSpec, Pause
from daq.driver import Controller
from daq.link import LinkError
from daq.owner import client, start
from daq.owner.client import OwnerOnDemand
from daq.owner.long_orders import deliver_late_stop
from daq.owner.messages import REPORT, Answer, CannotOpen, EventHappened, Finished, HaltRun, Report, RunExperiment
from daq.owner.stop_socket import request_stop
from daq.traces.reader import read_trace
from daq.traces.salvage import salvage_folder
from tests.daq.owner.jobs import AFTERMATH_PERIODS, ENDLESS, Running, opening, running
from tests.mock.process.running import RunningMock

QUICK = ExperimentSpec(trajectory=Pause(duration=0.2), settle=0, hold=0)


@pytest.fixture(autouse=True)
def own_runtime_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Stop sockets of these tests are not those of a person's runs."""
    folder = tmp_path / "run"
    monkeypatch.setenv("DAQ_RUNTIME_FOLDER", str(folder))
    return folder


def text_of(folder: Path, **more: object) -> str:
    """The first line."""
    return opening(folder, **more).model_dump_json()  # type: ignore[arg-type]


def finished(end: Answer | CannotOpen) -> Finished:
    """The end of a run that left a trace."""
    assert isinstance(end, Answer), end
    assert end.finished is not None, end
    return end.finished


def test_a_run_to_its_end(tmp_path: Path, own_runtime_folder: Path) -> None:
    heard: list[Report] = []
    with OwnerOnDemand(opening(tmp_path / "traces")) as owner:
        end = owner.run(QUICK, heard.append)
    assert end.outcome == read_trace(end.trace).record.outcome == "complete"
    assert {report.kind for report in heard} == {"progress", "event"}
    assert not list(own_runtime_folder.iterdir()), "the stop socket is removed"


def send_signal(number: int) -> Callable[[Running], None]:
    return lambda process: process.process.send_signal(number)


def speak(process: Running) -> None:
    process.say(HaltRun(here=True).model_dump_json())


def leave(process: Running) -> None:
    process.say('{"kind":"close"}')


def ask_at_the_socket(_process: Running) -> None:
    (attempt,) = request_stop()
    assert attempt.answer is not None
    assert (attempt.answer.delivered, attempt.answer.confirmed) == (True, True)
    assert attempt.answer.tick is not None
    assert len(attempt.answer.postures) == 6
    assert attempt.seconds < 1.0


@pytest.mark.parametrize(
    ("end_it", "reason"),
    [
        (send_signal(signal.SIGTERM), "by a signal"),
        (speak, "by Ctrl-C, or by the program that started the run"),
        (leave, "by Ctrl-C, or by the program that started the run"),
        (ask_at_the_socket, "on request, by STOP on the page or daq stop"),
    ],
    ids=["SIGTERM", "its client", "its client that leaves", "the stop socket"],
)
def test_a_stop_ends_a_run_and_its_trace(tmp_path: Path, end_it: Callable[[Running], None], reason: str) -> None:
    with running(text_of(tmp_path / "traces")) as process:
        process.run()
        process.until_event("start")
        end_it(process)
        answer = process.end()
        assert process.left() == 0
    end = finished(answer)
    assert (end.outcome, end.reason) == ("stopped", reason)
    assert answer.exit_code == exit_codes.STOPPED
    assert end.samples > AFTERMATH_PERIODS
    trace = read_trace(end.trace)
    assert trace.record.outcome == "stopped"
    assert trace.status is not None
    assert trace.status[-1] & 1, "frozen on the board"


def test_a_client_that_is_gone_ends_the_run_as_interrupted(tmp_path: Path) -> None:
    with running(text_of(tmp_path / "traces")) as process:
        process.run()
        process.until_event("start")
        process.close_input()
        process.process.stdout.close()  # type: ignore[union-attr]
        assert process.exit_code() == 0
    (path,) = (tmp_path / "traces").iterdir()
    trace = read_trace(path)
    assert trace.record.outcome == "interrupted"
    assert "the process that started this run is gone" in [event.message for event in trace.events]
    assert trace.status is not None
    assert trace.status[-AFTERMATH_PERIODS + 2 :].min() & 1, "a second more was recorded, frozen"


def test_a_client_that_goes_while_the_robot_is_being_reached_leaves_nothing_behind(tmp_path: Path) -> None:
    with running(text_of(tmp_path / "traces")) as process:
        process.close_input()
        assert process.exit_code() == 0
    assert not (tmp_path / "traces").exists()


def test_a_key_pressed_early_lets_no_run_begin_and_follows_an_order(tmp_path: Path) -> None:
    # A key pressed before the run begins lets none begin
    with OwnerOnDemand(opening(tmp_path / "traces")) as owner:
        owner.halt()
        with pytest.raises(OrderFailedError, match="nothing moved") as refused:
            owner.run(QUICK)
    assert refused.value.exit_code == exit_codes.STOPPED
    assert not (tmp_path / "traces").exists()
    # The signal's handler runs on the thread that writes: it may not wait for it
    with OwnerOnDemand(opening(tmp_path / "traces")) as owner:
        write = owner._process._write

        def pressed(order: object) -> None:
            if not isinstance(order, HaltRun):
                owner.halt()
            write(order)  # type: ignore[arg-type]

        owner._process._write = pressed  # type: ignore[method-assign]
        answer = owner.begin(RunExperiment, spec=ENDLESS, moves_real_arm=False).result()
    assert answer.exit_code in (exit_codes.REFUSED, exit_codes.STOPPED), answer
    assert "by Ctrl-C" in (answer.finished.reason if answer.finished else answer.problem)


def test_an_opening_that_is_none_is_refused_in_one_line() -> None:
    with running("{}") as process:
        end = process.end()
        assert process.exit_code() == 2
        assert process.process.stderr.read() == b""  # type: ignore[union-attr]
    assert isinstance(end, CannotOpen)
    assert end.problem.endswith("Field required")


def test_a_disk_that_fills_up_ends_the_run_and_what_was_written_is_salvaged(tmp_path: Path) -> None:
    traces = tmp_path / "traces"
    # In real time a chunk holds what comes between two syncs; the first ones fit into 40 kB.
    with running(text_of(traces, url="mock://?seed=3"), before="ulimit -f 80") as process:
        process.run()
        end = process.end()
        assert process.left() == 0
    assert isinstance(end, Answer)
    assert end.exit_code == exit_codes.FAULT
    assert "too large" in end.problem or "No space" in end.problem
    assert "arm frozen" in end.problem
    (salvaged,) = salvage_folder(traces)
    assert salvaged.path is not None
    trace = read_trace(salvaged.path)
    assert trace.record.outcome == "interrupted"
    assert len(trace) > 20


def test_a_client_that_does_not_read_costs_no_sample(tmp_path: Path) -> None:
    spec = ExperimentSpec(trajectory=Pause(duration=20), settle=0, hold=0)
    with running(text_of(tmp_path / "traces", live=True)) as process:
        process.run(spec)
        watched = os.pidfd_open(process.process.pid)
        try:
            # Nothing is read until the trace is there under its final name: its 1000 samples fill the pipe.
            wait_for_trace(tmp_path / "traces", watched)
        finally:
            os.close(watched)
        end = finished(process.end())
        assert process.left() == 0
    assert (end.outcome, end.missing) == ("complete", 0)


def wait_for_trace(folder: Path, watched: int) -> None:
    """Returns when a finished trace is in `folder`; the folder tells by itself when something changes."""
    import ctypes
    import select

    libc = ctypes.CDLL(None, use_errno=True)
    notifier = libc.inotify_init()
    try:
        folder.mkdir(exist_ok=True)
        moved_to = 0x80
        assert libc.inotify_add_watch(notifier, str(folder).encode(), moved_to) >= 0
        while not list(folder.glob("*.mcap")):
            ready, _, _ = select.select([notifier, watched], [], [], 60)
            assert notifier in ready, "it ended, or hung, before its trace was finished"
            os.read(notifier, 4096)
    finally:
        os.close(notifier)


def test_a_program_fault_is_told_as_one_and_freezes_nothing_else(tmp_path: Path) -> None:
    with running(text_of(tmp_path / "traces"), before="ulimit -n 6") as process:  # too few open files
        end = process.end()
        assert isinstance(end, CannotOpen), end
        assert process.exit_code() != 0
    assert end.exit_code == exit_codes.PROGRAM_FAULT
    assert "\n" not in end.problem
    assert not list(tmp_path.rglob("*.mcap*"))


def test_an_owner_that_is_killed_is_told_in_one_line(tmp_path: Path) -> None:
    with OwnerOnDemand(opening(tmp_path / "traces")) as owner:

        def kill(report: Report) -> None:
            if isinstance(report, EventHappened):
                os.kill(owner.pid, signal.SIGKILL)

        with pytest.raises(OrderFailedError, match=r"signal 9.*holds its last set point.*salvage") as lost:
            owner.run(ENDLESS, kill)
    assert lost.value.exit_code == exit_codes.PROGRAM_FAULT


def test_an_owner_started_early_is_the_next_one_and_ends_with_a_client_that_needs_none(tmp_path: Path) -> None:
    start.start_early()
    (early,) = start._early
    with OwnerOnDemand(opening(tmp_path)) as owner:
        assert owner.pid == early.pid
    output, _ = start.start_owner().communicate(timeout=60)
    assert isinstance(REPORT.validate_json(output), CannotOpen)


def test_an_owner_that_does_not_end_is_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The wait for it is given up; here at once."""
    deaf = """
import os, signal, sys, threading
os.write(1, b'{"kind":"opened","identity":{"simulated":true,"protocol":1,"period":0.02,"boots":0}}\\n')
threading.Event().wait(100)
"""
    monkeypatch.setattr(start, "PROGRAM", (sys.executable, "-c", deaf))
    monkeypatch.setattr(client, "OWN_GRACE", 0.0)
    before = threading.active_count()
    with OwnerOnDemand(opening(tmp_path)):
        pass
    assert threading.active_count() == before


# ---- A stop that could not be delivered is delivered when the link comes back


def test_the_arm_is_frozen_when_the_link_comes_back_in_time() -> None:
    with (
        RunningMock("--tcp", "127.0.0.1:0", "--lock-step") as mock,
        Controller.connect(f"{mock.url}?lock_step=1") as arm,
    ):
        mock.control("disconnect")
        with pytest.raises(LinkError):
            arm.status()
        # The first delay is the moment in which somebody pushes the plug back in.
        line = deliver_late_stop(arm, 60.0, sleep=lambda _seconds: reconnect(mock))
        assert "the link came back" in line
        assert "the board confirmed" in line
        assert mock.control("state")["frozen"] is True
    with (
        RunningMock("--tcp", "127.0.0.1:0", "--lock-step") as mock,
        Controller.connect(f"{mock.url}?lock_step=1") as arm,
    ):
        mock.end()
        with pytest.raises(LinkError):
            arm.status()
        assert deliver_late_stop(arm, 0.0).startswith("the link did not come back within 0 s")


def reconnect(mock: RunningMock) -> None:
    mock.control("reconnect")
