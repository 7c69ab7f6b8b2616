"""`daq.client` with a real service."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from daq.client import Client, ControlLostError, HeldControl, Robot, ServiceError, ServiceNotReachedError
from daq.contracts.errors import SpecError, TraceError
from daq.contracts.experiment import ExperimentSpec, Ramp
from daq.contracts.service.live import SampleMessage
from daq.teaching.program import Program, Wait
from daq.traces.reader import read_trace
from tests.server.service import Service

SHORT = ExperimentSpec(trajectory=Ramp(amplitude=0.05, duration=0.2), joints=(1, 2), settle=0.1, hold=0.1)
LONG = SHORT.model_copy(update={"hold": 600.0})


@pytest.fixture
def client(service: Service) -> Iterator[Client]:
    with Client(service.url) as client:
        yield client


@pytest.fixture
def robot(client: Client) -> Robot:
    robot = client.robot()
    robot.connect()
    return robot


def test_an_experiment_from_its_submission_to_its_trace(robot: Robot, tmp_path: Path) -> None:
    assert robot.experiments.preview(SHORT).violations == ()
    made = robot.experiments.submit(SHORT, key="once")
    assert robot.experiments.submit(SHORT, key="once").id == made.id
    ended = robot.experiments.wait(made.id)
    assert (ended.state, ended.outcome) == ("done", "complete")
    assert ended.trace is not None
    path = robot.traces.download(ended.trace, tmp_path)
    assert robot.traces.download(ended.trace, tmp_path) == path
    trace = read_trace(path)
    details = robot.traces.get(ended.trace)
    assert (details.entry.samples, details.record.trace_id) == (len(trace), ended.trace)
    assert details.entry.experiment == made.id
    assert robot.traces.find("last").id == robot.traces.find(ended.trace[:8]).id == ended.trace
    assert robot.traces.change(ended.trace, tags=["client"]).tags == ("client",)
    assert [entry.id for entry in robot.traces.list(tag="client")] == [ended.trace]
    signals = robot.traces.signals(ended.trace, points=20)
    assert (signals.samples, len(signals.time)) == (len(trace), 20)
    assert max(signals.position[0]) == trace.position[:, 0].max()
    assert next(iter(robot.experiments.list("done"))).id == made.id
    table = robot.traces.download_csv(ended.trace, tmp_path / "table.csv").read_text()
    assert table.startswith("time [s],")
    assert len(table.splitlines()) == len(trace) + 1
    with pytest.raises(ServiceError) as there_already:
        robot.traces.upload(path)
    assert there_already.value.kind == "trace-exists"
    assert robot.traces.upload_unless_there(path, ended.trace).id == ended.trace
    robot.traces.delete(ended.trace)
    assert robot.traces.upload(path).id == ended.trace
    with pytest.raises(TraceError, match="cannot be read"):
        robot.traces.upload(tmp_path / "table.txt")


def test_a_stop_a_reset_and_the_queue(robot: Robot, service: Service) -> None:
    made = robot.experiments.submit(LONG)
    service.until_recording(made.id)
    with pytest.raises(TimeoutError):
        robot.experiments.wait(made.id, seconds=0.1)
    assert robot.stop().confirmed
    assert robot.experiments.wait(made.id).state == "cancelled"
    assert service.until_arm("stopped")["arm"] == robot.status().arm
    with pytest.raises(ServiceError) as stopped:
        robot.queue.resume()
    assert stopped.value.kind == "arm-stopped"
    assert "takes set points again" in robot.reset().text
    assert not robot.queue.resume().paused
    assert robot.queue.pause().paused
    waits = robot.experiments.submit(SHORT)
    assert robot.experiments.set_priority(waits.id, 5).priority == 5
    assert [one.id for one in robot.queue.waiting()] == [waits.id]
    assert robot.experiments.cancel(waits.id).state == "cancelled"
    texts = [event.text for event in robot.events(made.id)]
    assert texts[-1] == "queued"


def test_a_schedule_is_made_switched_off_and_deleted(robot: Robot) -> None:
    made = robot.schedules.create(SHORT, every=86400, count=2)
    assert made.id in [one.id for one in robot.schedules.list()]
    assert not robot.schedules.switch(made.id, active=False).active
    robot.schedules.delete(made.id)
    with pytest.raises(ServiceError) as gone:
        robot.schedules.get(made.id)
    assert (gone.value.status, gone.value.kind) == (404, "not-found")
    for waiting in robot.queue.waiting():
        robot.experiments.cancel(waiting.id)


def test_the_live_stream(robot: Robot) -> None:
    with robot.live("samples", "robot", rate=50, history=5) as stream:
        samples = (message for message in stream.messages() if isinstance(message, SampleMessage))
        ticks = [next(samples).tick for _ in range(10)]
        stream.unsubscribe("samples")
        stream.subscribe("queue")
        assert any(message.topic == "queue" for message in stream.messages())
    assert ticks == list(range(ticks[0], ticks[0] + 10))
    with pytest.raises(ServiceNotReachedError):
        stream.next_frame(1)


def test_the_control_is_held_given_back_and_told_when_it_is_lost(robot: Robot, client: Client) -> None:
    with robot.control() as control:
        assert robot.control_status().holder == "client"
        assert control.set_output(2, on=True).outputs[2]
        assert not any(control.set_output(2, on=False).outputs)
        assert control.perform(Program(name="wait", instructions=(Wait(duration=0.1),))).activity in ("program", "none")
        with pytest.raises(ServiceError) as held, client.robot().control():
            pass
        assert held.value.kind == "control-held"
    assert robot.control_status().holder == "nobody"
    with pytest.raises(ControlLostError):
        _ = robot.control().lease


def test_a_heartbeat_that_is_refused_ends_the_control(robot: Robot, service: Service) -> None:
    with robot.control() as control:
        service.robot.delete("/control", headers={"Control-Lease": control.lease.lease})
        with pytest.raises((ServiceError, ControlLostError)):
            control.set_gripper(closed=True)
        assert "the arm holds" in _why_lost(control)


def _why_lost(control: HeldControl) -> str:
    """Asks until the heartbeat has found out."""
    while True:
        try:
            _ = control.lease
        except ControlLostError as error:
            return str(error)


def test_a_service_that_does_not_answer_is_said_to_be_unreachable() -> None:
    with Client("http://127.0.0.1:1") as client:
        with pytest.raises(ServiceNotReachedError):
            client.robot()
        with pytest.raises(ServiceNotReachedError):
            client.robot("ma2000").live("samples")
        stopped = client.robot("ma2000").stop()
    assert not stopped.delivered
    assert "emergency stop" in stopped.text
    with pytest.raises(SpecError):
        Client("arm.lab")
