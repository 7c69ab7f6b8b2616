"""The acquisition process, ended in every way from outside: the arm is frozen, the trace closed, the reason told."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from daq.acquisition.messages import Failed, Finished
from daq.acquisition.stop_socket import request_stop
from daq.contracts import exit_codes
from daq.contracts.experiment import ExperimentSpec, Pause
from daq.traces.reader import read_trace
from daq.traces.salvage import salvage_folder
from tests.daq.acquisition.jobs import AFTERMATH_PERIODS, Running, job, running, text_of

QUICK = ExperimentSpec(trajectory=Pause(duration=0.2), settle=0, hold=0)


@pytest.fixture(autouse=True)
def own_runtime_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Stop sockets of these tests are not those of a person's runs."""
    folder = tmp_path / "run"
    monkeypatch.setenv("DAQ_RUNTIME_FOLDER", str(folder))
    return folder


def test_a_run_to_its_end(tmp_path: Path, own_runtime_folder: Path) -> None:
    with running(text_of(job(tmp_path / "traces", QUICK, report_samples=True))) as process:
        reports = list(process.reports())
        assert process.exit_code() == 0
    end = reports[-1]
    assert isinstance(end, Finished)
    assert end.outcome == read_trace(end.trace).record.outcome == "complete"
    assert {report.kind for report in reports} == {"progress", "event", "sample", "finished"}
    assert sum(report.kind == "sample" for report in reports) == end.samples
    assert not list(own_runtime_folder.iterdir()), "the stop socket is removed"


def send_signal(number: int) -> Callable[[Running], None]:
    return lambda process: process.process.send_signal(number)


def speak(process: Running) -> None:
    os.write(process.process.stdin.fileno(), b"stop\n")  # type: ignore[union-attr]


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
        (ask_at_the_socket, "on request, by daq stop or through the service"),
    ],
    ids=["SIGTERM", "its parent", "the stop socket"],
)
def test_a_stop_ends_the_run_with_its_trace_closed(
    tmp_path: Path, end_it: Callable[[Running], None], reason: str
) -> None:
    with running(text_of(job(tmp_path / "traces"))) as process:
        process.until_event("start")
        end_it(process)
        end = process.end()
        assert process.exit_code() == 6
    assert isinstance(end, Finished)
    assert (end.outcome, end.reason) == ("stopped", reason)
    assert end.samples > AFTERMATH_PERIODS
    trace = read_trace(end.trace)
    assert trace.record.outcome == "stopped"
    assert trace.status is not None
    assert trace.status[-1] & 1, "frozen on the board"


def test_a_parent_that_is_gone_ends_the_run_as_interrupted(tmp_path: Path) -> None:
    with running(text_of(job(tmp_path / "traces"))) as process:
        process.until_event("start")
        process.close_input()
        process.process.stdout.close()  # type: ignore[union-attr]
        assert process.exit_code() == 5
    (path,) = (tmp_path / "traces").iterdir()
    trace = read_trace(path)
    assert trace.record.outcome == "interrupted"
    assert "the process that started this run is gone" in [event.message for event in trace.events]
    assert trace.status is not None
    assert trace.status[-AFTERMATH_PERIODS + 2 :].min() & 1, "a second more was recorded, frozen"


def test_a_parent_that_goes_while_the_robot_is_being_reached_leaves_nothing_behind(tmp_path: Path) -> None:
    with running(text_of(job(tmp_path / "traces"))) as process:
        process.close_input()
        end = process.end()
        assert process.exit_code() == end.exit_code != 0  # type: ignore[union-attr]
    assert isinstance(end, Failed)
    assert "nothing moved" in end.message
    assert not (tmp_path / "traces").exists()


def test_a_job_that_is_none_is_refused_in_one_line() -> None:
    with running("{}") as process:
        end = process.end()
        assert process.exit_code() == 2
        assert process.process.stderr.read() == b""  # type: ignore[union-attr]
    assert isinstance(end, Failed)
    assert end.message == "job: url: Field required"


def test_a_disk_that_fills_up_ends_the_run_and_what_was_written_is_salvaged(tmp_path: Path) -> None:
    traces = tmp_path / "traces"
    # In real time a chunk holds what comes between two syncs; the first ones fit into 40 kB.
    with running(text_of(job(traces, url="mock://?seed=3")), before="ulimit -f 80") as process:
        end = process.end()
        assert process.exit_code() == 5
    assert isinstance(end, Failed)
    assert "too large" in end.message or "No space" in end.message
    assert "arm frozen" in end.message
    (salvaged,) = salvage_folder(traces)
    assert salvaged.path is not None
    trace = read_trace(salvaged.path)
    assert trace.record.outcome == "interrupted"
    assert len(trace) > 20


def test_a_parent_that_does_not_read_costs_no_sample(tmp_path: Path) -> None:
    spec = ExperimentSpec(trajectory=Pause(duration=20), settle=0, hold=0)
    with running(text_of(job(tmp_path / "traces", spec, report_samples=True))) as process:
        watched = os.pidfd_open(process.process.pid)
        try:
            # Nothing is read until the trace is there under its final name: its 1000 samples fill the pipe.
            wait_for_trace(tmp_path / "traces", watched)
        finally:
            os.close(watched)
        end = process.end()
        assert process.exit_code() == 0
    assert isinstance(end, Finished)
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
    with running(text_of(job(tmp_path / "traces", QUICK)), before="ulimit -n 9") as process:  # too few open files
        end = process.end()
        assert isinstance(end, Failed), end
        assert process.exit_code() == end.exit_code == exit_codes.PROGRAM_FAULT
    assert "\n" not in end.message
    assert not list(tmp_path.rglob("*.mcap*"))
