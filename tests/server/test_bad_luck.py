"""What becomes of queue, trace and states when processes, cables and disks break."""

import http.client
import json
import os
import resource
import select
import signal
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest

from benchmarks.service_process import children
from daq.link import Link
from daq.traces.reader import read_trace
from daq.transport import MockPort, parse_port_url
from daq.transport.mock_process import MockProcess, start_mock
from server.jobs.mailbox import PROGRESS
from tests.left_running import wait_for_end
from tests.server.service import Service, running_service

pytestmark = pytest.mark.timeout(600)
LONG = {"trajectory": {"kind": "pause", "duration": 3000}, "joints": [1], "settle": 0, "hold": 0}
SHORT = {"trajectory": {"kind": "ramp", "amplitude": 0.05, "duration": 0.2}, "settle": 0.1, "hold": 0.1}
LONG_FIT = {"kind": "fit", "method": "nelder_mead", "starts": 20, "seed": 1}


def _left_behind(service: Service) -> tuple[str, str]:
    """An experiment that runs and one that waits."""
    service.until_connected()
    running = service.robot.post("/experiments", json={"spec": LONG}).json()["id"]
    waiting = service.robot.post("/experiments", json={"spec": SHORT}).json()["id"]
    service.until_recording(running)
    return running, waiting


def _partial_trace(service: Service, experiment: dict[str, Any], outcome: str) -> None:
    """What was recorded of an experiment is kept, and says how it ended."""
    entry = service.robot.get(f"/traces/{experiment['trace']}").json()["entry"]
    assert (entry["outcome"], entry["experiment"]) == (outcome, experiment["id"])
    assert len(read_trace(service.folder / "traces" / entry["file"])) > 0


# ---- a process is killed


@pytest.mark.slow
def test_whatever_process_is_killed_its_work_is_interrupted_and_what_waits_waits_for_a_person(tmp_path: Path) -> None:
    with running_service(tmp_path) as service:
        running, waiting = _left_behind(service)
        (owner,) = children(service.process.pid, b"server.owner")
        assert service.end(signal.SIGKILL) == -signal.SIGKILL
        wait_for_end(owner, 60)  # it freezes the arm, records a second more and closes the trace by itself
    log = tmp_path / "log"
    with log.open("wb") as stream, running_service(tmp_path, log=stream) as service:
        service.until_connected()
        trace = _after_the_server(service, running, waiting)
        waiting = _without_the_acquisition_process(service)
        _without_the_worker(service, trace)
        service.robot.post("/disconnect")
        _ends_while_somebody_waits(service, waiting)
    assert "Exception in ASGI" not in log.read_text()
    assert "leaked" not in log.read_text()  # of what its worker processes shared with it


def _after_the_server(service: Service, running: str, waiting: str) -> str:
    found = service.robot.get(f"/experiments/{running}").json()
    assert (found["state"], found["outcome"]) == ("interrupted", "interrupted")
    assert "does not run again by itself" in found["reason"]
    _partial_trace(service, found, "interrupted")
    queue = service.robot.get("/queue").json()
    assert (queue["paused"], queue["queued"]) == (True, 1)
    assert "1 waiting and 1 interrupted" in queue["reason"]
    assert service.robot.post("/queue/resume", json={}).status_code == 200
    ended = service.end_of(waiting)
    assert ended["state"] == "done"
    assert service.robot.get(f"/experiments/{running}").json()["state"] == "interrupted"
    trace: str = ended["trace"]
    return trace


def _without_the_acquisition_process(service: Service) -> str:
    running, waiting = _left_behind(service)
    (owner,) = children(service.process.pid, b"server.owner")
    os.kill(owner, signal.SIGKILL)
    ended = service.end_of(running)
    assert ended["state"] == "interrupted", ended
    queue = service.robot.get("/queue").json()
    assert queue["paused"], queue
    assert service.robot.get(f"/experiments/{waiting}").json()["state"] == "queued"
    return waiting


def _ends_while_somebody_waits(service: Service, waiting: str) -> None:
    """Whoever waits for an end that does not come is told how it is when the service ends."""
    with closing(http.client.HTTPConnection("127.0.0.1", int(service.url.rpartition(":")[2]), timeout=60)) as waits:
        waits.request("GET", f"/api/v1/robots/ma2000/experiments/{waiting}?wait=60")
        service.status()  # what was sent before has begun by now
        assert service.end() == 0
        answer = waits.getresponse()
        assert (answer.status, json.loads(answer.read())["state"]) == (200, "queued")


def _without_the_worker(service: Service, trace: str) -> None:
    fit = service.robot.post("/jobs", json=LONG_FIT | {"traces": [trace]}).json()
    progress = service.folder / "service" / "jobs" / fit["id"] / PROGRESS
    while not progress.exists():
        assert service.robot.get(f"/jobs/{fit['id']}", params={"wait": 0.1}).json()["state"] in ("queued", "running")
    workers = list(children(service.process.pid, b"spawn_main"))
    compare = {"kind": "compare", "traces": [trace], "models": ["machine"]}
    following = service.robot.post("/jobs", json=compare).json()
    assert workers
    for worker in workers:
        os.kill(worker, signal.SIGKILL)
    ended = service.end_of(fit["id"], "jobs")
    told = "its worker process ended: it was killed, or ran out of memory"
    assert (ended["state"], ended["reason"]) == ("interrupted", told)
    assert service.end_of(following["id"], "jobs")["state"] == "done"


# ---- the robot


@contextmanager
def _on_a_cable(folder: Path) -> Iterator[tuple[Service, MockProcess]]:
    """A service that is not connected, and the robot at the other end of its port: in real time, since a port in
    lock-step cannot be named by a URL."""
    port = parse_port_url("mock://?pty=1&seed=3")
    assert isinstance(port, MockPort)
    mock = start_mock(port)
    (folder / "daq.toml").write_text("[server]\nconnect_at_start = false\n")
    try:
        with running_service(folder, mock.url) as service:
            yield service, mock
    finally:
        mock.close()


def test_a_port_that_another_program_has_and_a_robot_that_is_pulled_out(tmp_path: Path) -> None:
    with _on_a_cable(tmp_path) as (service, mock):
        with Link.open(mock.url):
            _port_in_use(service)
        while (answer := service.robot.post("/connect")).status_code == 409:  # by an attempt that began before
            assert answer.json()["type"] == "/api/v1/problems#port-in-use"
        _disconnected(service)
        running, waiting = _left_behind(service)
        mock.close()
        ended = service.end_of(running)
        assert (ended["state"], ended["outcome"]) == ("interrupted", "interrupted"), ended
        _partial_trace(service, ended, "interrupted")
        assert service.robot.get("/queue").json()["paused"]
        assert service.robot.get(f"/experiments/{waiting}").json()["state"] == "queued"
        assert service.status()["connection"] in ("lost", "disconnected")
        with _terminal_of_the_same_number(mock.url) as ours:
            assert not service.robot.post("/stop").json()["confirmed"]
            assert not select.select([ours], [], [], 0)[0]  # nothing was sent to whoever has the number now


@contextmanager
def _terminal_of_the_same_number(url: str) -> Iterator[int]:
    """Another program's, which got the number of a mock that has ended. The system gives the lowest free number, which
    may be that of a terminal that some other program has closed: then the next one is asked for."""
    opened: list[int] = []
    try:
        for _ in range(50):
            ours, theirs = os.openpty()
            opened += [ours, theirs]
            if url == f"serial://{os.ttyname(theirs)}":
                break
        else:
            pytest.fail(f"{url} is still in use")
        yield ours
    finally:
        for number in opened:
            os.close(number)


def _port_in_use(service: Service) -> None:
    answer = service.robot.post("/connect")
    assert (answer.status_code, answer.json()["type"]) == (409, "/api/v1/problems#port-in-use")
    assert "is in use by another program" in service.status()["connection_problem"]


def _disconnected(service: Service) -> None:
    assert service.robot.post("/disconnect").status_code == 200
    status = service.status()
    assert (status["connection"], status["arm"], status["sample"]) == ("disconnected", "disconnected", None)
    assert status["connection_problem"] == "", "it is what somebody wanted"
    answer = service.robot.get("/gains")
    assert (answer.status_code, answer.json()["type"]) == (503, "/api/v1/problems#not-reached")
    assert service.until_connected()["connection"] == "connected"
    queue = service.robot.get("/queue").json()
    ended = "the connection to the robot has ended: disconnected on request; look at the arm, then resume the queue"
    assert (queue["paused"], queue["reason"]) == (True, ended)
    assert service.robot.post("/queue/resume", json={}).status_code == 200


# ---- the disk


@contextmanager
def _no_file_grows(process: int, size: int) -> Iterator[None]:
    """The system refuses a process every byte beyond `size` of a file, as with a full disk."""
    before = resource.prlimit(process, resource.RLIMIT_FSIZE)
    resource.prlimit(process, resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.prlimit(process, resource.RLIMIT_FSIZE, before)


def test_a_disk_that_fills_up_ends_the_run_and_keeps_what_was_written(service: Service) -> None:
    running = service.robot.post("/experiments", json={"spec": LONG}).json()["id"]
    service.until_recording(running)
    (part,) = (service.folder / "traces").glob("*.part")
    begun = part.stat().st_size
    while part.stat().st_size == begun:  # nothing of it has been synced yet
        assert service.process.poll() is None
    (owner,) = children(service.process.pid, b"server.owner")
    with _no_file_grows(owner, part.stat().st_size):
        ended = service.end_of(running)
    assert ended["state"] == "failed", ended
    assert "the run was ended and the arm frozen" in ended["reason"]
    assert service.status()["arm"] in ("stopped", "fault")
    assert service.robot.get("/queue").json()["paused"]
    _partial_trace(service, ended, "interrupted")
