"""A day of a lab at its arm, over REST and the live stream, with a restart in its middle."""

import io
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import ClientConnection

from daq.traces.reader import read_trace
from tests.server.live.watching import frames, watching
from tests.server.service import Service, running_service

RAMP = {"trajectory": {"kind": "ramp", "amplitude": 0.2, "duration": 0.6}, "settle": 0.1, "hold": 0.3}
LONG = {"trajectory": {"kind": "pause", "duration": 3000}, "joints": [1], "settle": 0, "hold": 0}
FIT = {"kind": "fit", "parameters": ["joint2.motor.*"]}
DIAGNOSIS = {"kind": "diagnose", "joints": [2], "most_steps": 1, "effects": ["coulomb_friction"]}
JOB_WITHIN = 600.0
"""Time (s) for a fit or a diagnosis, on a busy machine."""


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_day_of_work_survives_the_end_of_the_service(tmp_path: Path) -> None:
    with running_service(tmp_path) as service:
        service.until_connected()
        with watching(service, subscribe=["samples", "events", "queue", "jobs"]) as live:
            traces, schedule = _morning(service, live)
            model = _noon(service, live, traces)
        data = {trace: _downloaded(service, trace) for trace in traces}
        running, waiting, job = _left_when_the_service_is_ended(service, traces[0])
        service.end()
    with running_service(tmp_path) as service:
        service.until_connected()
        _what_the_restart_tells(service, running, waiting, job)
        assert {trace: _downloaded(service, trace) for trace in traces} == data
        assert service.robot.get(f"/models/{model}").json()["entry"]["traces"] == [traces[0]]
        assert service.robot.get(f"/schedules/{schedule}").json()["submitted_runs"] == 1
        assert service.robot.post("/queue/resume", json={}).status_code == 200
        assert service.end_of(waiting)["state"] == "done"
        assert service.end_of(running)["state"] == "interrupted"


def _morning(service: Service, live: ClientConnection) -> tuple[list[str], str]:
    """One run of a schedule and one by hand, watched to their end. Their traces, and the schedule."""
    schedule = service.robot.post("/schedules", json={"spec": RAMP, "every": 3600, "count": 3}).json()["id"]
    by_hand = service.robot.post("/experiments", json={"spec": RAMP}).json()["id"]
    completed: list[str] = []
    ticks: list[int] = []
    for frame in frames(live):
        for message in frame.messages:
            if message.topic == "sample":
                ticks.append(message.tick)
            elif message.topic == "event" and message.event.text == "completed":
                completed.append(message.event.experiment)
        if len(completed) == 2:
            break
    assert len(ticks) > 50
    assert ticks == sorted(set(ticks))
    (scheduled,) = _items(service, f"/experiments?schedule={schedule}")
    assert set(completed) == {scheduled["id"], by_hand}
    ended = [service.robot.get(f"/experiments/{number}").json() for number in (scheduled["id"], by_hand)]
    assert [one["state"] for one in ended] == ["done", "done"]
    return [one["trace"] for one in ended], schedule


def _noon(service: Service, live: ClientConnection, traces: list[str]) -> str:
    """A fit and a diagnosis, followed live. The model."""
    fit = service.robot.post("/jobs", json=FIT | {"traces": traces[:1], "held_out": traces[1:]}).json()["id"]
    fitted = _followed(live, fit)
    assert (fitted.state, fitted.reason) == ("done", "")
    diagnosis = DIAGNOSIS | {"traces": traces[:1], "held_out": traces[1:], "model": fitted.model}
    found = _followed(live, service.robot.post("/jobs", json=diagnosis).json()["id"])
    assert (found.state, found.reason) == ("done", "")
    assert service.robot.get(f"/jobs/{found.id}/result").json()["data"]["verdict"]
    assert service.robot.get(f"/jobs/{found.id}/report.html").status_code == 200
    model: str = fitted.model
    return model


def _followed(live: ClientConnection, job: str) -> Any:
    """The job as the stream tells it at its end; its progress never goes back."""
    progress = 0.0
    for frame in frames(live, within=JOB_WITHIN):
        for message in frame.messages:
            if message.topic == "job" and message.job.id == job:
                assert (message.job.progress or 1.0) >= progress
                progress = message.job.progress or progress
                if message.job.state not in ("queued", "running"):
                    return message.job
    raise AssertionError("the stream has ended")


def _downloaded(service: Service, trace: str) -> bytes:
    """The file, which is a trace of this number, and as long as its table."""
    content = service.robot.get(f"/traces/{trace}/data.mcap").content
    copy = service.folder / "copy.mcap"
    copy.write_bytes(content)
    read = read_trace(copy)
    assert read.record.trace_id == trace
    table = service.robot.get(f"/traces/{trace}/data.csv").text
    assert len(io.StringIO(table).readlines()) == len(read) + 1
    return content


def _left_when_the_service_is_ended(service: Service, trace: str) -> tuple[str, str, str]:
    running = service.robot.post("/experiments", json={"spec": LONG}).json()["id"]
    waiting = service.robot.post("/experiments", json={"spec": RAMP}).json()["id"]
    long_fit = {"kind": "fit", "traces": [trace], "method": "nelder_mead", "starts": 20, "seed": 1}
    job = service.robot.post("/jobs", json=long_fit).json()["id"]
    service.until_recording(running)
    return running, waiting, job


def _what_the_restart_tells(service: Service, running: str, waiting: str, job: str) -> None:
    found = service.robot.get(f"/experiments/{running}").json()
    assert found["state"] == "interrupted"
    assert found["outcome"] in ("stopped", "interrupted")  # stopped: there was time to freeze the arm in order
    assert service.robot.get(f"/traces/{found['trace']}").json()["entry"]["experiment"] == running
    queue = service.robot.get("/queue").json()
    assert (queue["paused"], queue["queued"]) == (True, 1)
    assert "look at the arm, then resume" in queue["reason"]
    assert [one["id"] for one in service.robot.get("/queue/experiments").json()] == [waiting]
    service.robot.post(f"/jobs/{job}/cancel")  # one that had not begun is computed after a restart: it moves nothing
    assert service.end_of(job, "jobs")["state"] in ("cancelled", "interrupted")


def _items(service: Service, path: str) -> list[dict[str, Any]]:
    items: list[dict[str, Any]] = service.robot.get(path).json()["items"]
    return items
