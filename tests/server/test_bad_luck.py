"""What becomes of queue, trace and states when things break: each test has a service of its own."""

from __future__ import annotations

import os
import select
import signal
from pathlib import Path

import pytest

from daq.traces.reader import read_trace
from daq.transport import MockPort, parse_port_url
from daq.transport.mock_process import MockProcess, start_mock
from tests.server.service import Service, running_service

pytestmark = pytest.mark.timeout(600)
LONG = {"trajectory": {"kind": "pause", "duration": 3000}, "joints": [1], "settle": 0, "hold": 0}
SHORT = {"trajectory": {"kind": "pause", "duration": 0.1}, "joints": [1], "settle": 0, "hold": 0}


def _mock() -> MockProcess:
    """In real time: a port in lock-step cannot be named by a URL."""
    port = parse_port_url("mock://?pty=1&seed=3")
    assert isinstance(port, MockPort)
    return start_mock(port)


def _left_behind(service: Service) -> tuple[str, str]:
    """An experiment that runs and one that waits."""
    service.until_connected()
    running = service.robot.post("/experiments", json={"spec": LONG}).json()["id"]
    waiting = service.robot.post("/experiments", json={"spec": SHORT}).json()["id"]
    service.until_recording(running)
    return running, waiting


def test_after_kill_9_what_ran_is_interrupted_and_what_waits_waits_for_a_person(tmp_path: Path) -> None:
    with running_service(tmp_path) as service:
        running, waiting = _left_behind(service)
        owner = _owner_of(service.process.pid)
        assert service.end(signal.SIGKILL) == -signal.SIGKILL
        _until_gone(owner)  # it freezes the arm, records a second more and closes the trace by itself
    with running_service(tmp_path) as service:
        service.until_connected()
        found = service.robot.get(f"/experiments/{running}").json()
        assert (found["state"], found["outcome"]) == ("interrupted", "interrupted")
        assert "does not run again by itself" in found["reason"]
        entry = service.robot.get(f"/traces/{found['trace']}").json()["entry"]
        assert (entry["outcome"], entry["experiment"]) == ("interrupted", running)
        assert len(read_trace(tmp_path / "traces" / entry["file"])) > 0
        queue = service.robot.get("/queue").json()
        assert (queue["paused"], queue["queued"]) == (True, 1)
        assert "1 waiting and 1 interrupted" in queue["reason"]
        assert service.robot.post("/queue/resume", json={}).status_code == 200
        assert service.end_of(waiting)["state"] == "done"
        assert service.robot.get(f"/experiments/{running}").json()["state"] == "interrupted"


def test_the_loss_of_the_acquisition_process_interrupts_and_keeps_what_was_recorded(tmp_path: Path) -> None:
    with running_service(tmp_path) as service:
        running, waiting = _left_behind(service)
        os.kill(_owner_of(service.process.pid), signal.SIGKILL)
        ended = service.end_of(running)
        assert ended["state"] == "interrupted", ended
        queue = service.robot.get("/queue").json()
        assert queue["paused"], queue
        assert service.robot.get(f"/experiments/{waiting}").json()["state"] == "queued"


def test_a_clean_end_freezes_the_arm_and_closes_the_trace(tmp_path: Path) -> None:
    with running_service(tmp_path) as service:
        running, _ = _left_behind(service)
        service.end(signal.SIGTERM)
    with running_service(tmp_path) as service:
        found = service.robot.get(f"/experiments/{running}").json()
        assert found["state"] == "interrupted"
        assert service.robot.get("/queue").json()["paused"]
        (entry,) = service.robot.get("/traces").json()["items"]
        assert entry["experiment"] == running


def test_a_second_owner_of_the_port_is_told_so(tmp_path: Path) -> None:
    mock = _mock()
    try:
        (tmp_path / "one").mkdir()
        (tmp_path / "two").mkdir()
        with running_service(tmp_path / "one", mock.url) as first:
            first.until_connected()
            with running_service(tmp_path / "two", mock.url) as second:
                answer = second.robot.post("/connect")
                assert (answer.status_code, answer.json()["type"]) == (409, "docs/service.md#port-in-use")
                assert "is in use by another program" in second.status()["connection_problem"]
    finally:
        mock.close()


def test_disconnected_the_robot_says_so_and_can_be_connected_again(tmp_path: Path) -> None:
    with running_service(tmp_path) as service:
        service.until_connected()
        assert service.robot.post("/disconnect").status_code == 200
        status = service.status()
        assert (status["connection"], status["arm"], status["sample"]) == ("disconnected", "disconnected", None)
        answer = service.robot.get("/gains")
        assert (answer.status_code, answer.json()["type"]) == (503, "docs/service.md#not-reached")
        assert service.until_connected()["connection"] == "connected"


def _owner_of(service: int) -> int:
    """The process that owns the port."""
    threads = Path(f"/proc/{service}/task").iterdir()
    children = [int(child) for thread in threads for child in (thread / "children").read_text().split()]
    for child in children:
        if b"server.owner" in Path(f"/proc/{child}/cmdline").read_bytes():
            return child
    raise AssertionError("no process owns the port")


def _until_gone(process: int) -> None:
    try:
        handle = os.pidfd_open(process)
    except ProcessLookupError:
        return
    try:
        poll = select.poll()
        poll.register(handle, select.POLLIN)
        poll.poll()
    finally:
        os.close(handle)
