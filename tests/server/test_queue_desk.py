"""The queue's own thread, on stores of its own and an arm that answers what a test says."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from sqlalchemy import text
from sqlalchemy.exc import OperationalError

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.service.experiments import Experiment, ExperimentRequest, Schedule, ScheduleRequest
from daq.contracts.service.robot import RobotIdentity
from server.owner.messages import Answer, ArmReport
from server.queue.desk import QueueDesk, QueueParts
from server.robot.control import ControlDesk
from server.store.engine import Store
from server.store.experiments import ExperimentStore
from server.store.queues import QueueStore
from server.store.schedules import ScheduleStore
from tests.server.clocks import HandClock

CALM = ArmReport(arm="idle", cause="", activity="none", limp=(), link="connected", counters={})
MOCK = RobotIdentity(simulated=True, protocol=1, period=0.02, boots=1)
SPEC = ExperimentSpec.model_validate({"trajectory": {"kind": "pause", "duration": 0.1}, "joints": [1]})


class Bench:
    """A queue, its stores, an arm, and all events."""

    def __init__(self, folder: Path) -> None:
        self.store = Store(f"sqlite:///{folder / 'service.sqlite'}")
        self.store.migrate()
        self.experiments, self.schedules = ExperimentStore(self.store), ScheduleStore(self.store)
        self.clock = HandClock()
        self.answer = Answer(number=1, problem="refused", exit_code=2)
        self._heard = threading.Condition()
        self.events: list[str] = []
        self.control = ControlDesk(self.clock, lambda _holder: None)
        robot: Any = SimpleNamespace(
            name="ma2000", identity=MOCK, arm=CALM, problem="", experiment=None,
            place=SimpleNamespace(folder=folder), ask=self._ask, tell=lambda _order: None,
        )  # fmt: skip
        self.queue = QueueDesk(
            QueueParts(
                robot=robot, control=self.control, experiments=self.experiments, schedules=self.schedules,
                queues=QueueStore(self.store), clock=self.clock, told=self._hear, recorded=lambda _answer: None,
                unfinished=lambda: None, unattended=False,
            )
        )  # fmt: skip

    def _ask(self, _order: object, **_fields: object) -> Future[Answer]:
        future: Future[Answer] = Future()
        future.set_result(self.answer)
        return future

    def _hear(self, kind: str, text: str, *, actor: str | None = None, experiment: str | None = None) -> None:
        del actor, experiment
        with self._heard:
            self.events.append(f"{kind}: {text}")
            self._heard.notify_all()

    def until(self, said: Callable[[str], bool]) -> str:
        """Waits for such an event; the test's own time limit ends the wait."""
        with self._heard:
            self._heard.wait_for(lambda: any(said(event) for event in self.events))
            return next(event for event in self.events if said(event))

    def schedule(self) -> Schedule:
        """One whose first run is due now, and then every hour."""
        return self.schedules.create("ma2000", ScheduleRequest(spec=SPEC, every=3600), self.clock.utc(), "anna")

    def runs(self, schedule: Schedule) -> list[Experiment]:
        """What it has submitted."""
        return list(self.experiments.page("ma2000", (), schedule.id, None, 10).items)

    def counted(self, schedule: Schedule) -> int:
        """How many runs count as made."""
        return self.schedules.get("ma2000", schedule.id).submitted_runs


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    """Its queue not yet begun, and not paused."""
    made = Bench(tmp_path)
    yield made
    made.queue.close(10)
    made.control.close()
    made.store.close()


def test_a_run_that_a_full_disk_refuses_is_not_counted_and_comes_when_there_is_room(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    schedule = bench.schedule()
    usage = shutil.disk_usage
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: SimpleNamespace(free=10**6))
    bench.queue.start()
    line = "1 MB are free for traces, 20 MB stay free"
    bench.until(lambda event: event == f"schedule: schedule {schedule.id}: its run waits: {line}")
    assert (bench.runs(schedule), bench.counted(schedule)) == ([], 0)
    monkeypatch.setattr(shutil, "disk_usage", usage)
    bench.queue.wake()
    bench.until(lambda event: "queued by schedule" in event)
    assert (len(bench.runs(schedule)), bench.counted(schedule)) == (1, 1)


def test_a_run_counts_as_made_only_with_its_experiment(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    schedule = bench.schedule()
    submit = bench.experiments.submit

    def fails_once(*args: Any, **named: Any) -> tuple[Experiment, bool]:
        monkeypatch.setattr(bench.experiments, "submit", submit)
        raise OperationalError("INSERT", {}, Exception("database or disk is full"))

    monkeypatch.setattr(bench.experiments, "submit", fails_once)
    bench.queue.start()
    bench.until(lambda event: "queued by schedule" in event)
    assert (len(bench.runs(schedule)), bench.counted(schedule)) == (1, 1)


def test_an_experiment_is_made_only_with_the_count_of_its_run(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    schedule = bench.schedule()
    count = bench.schedules.count_run

    def fails_once(*_args: Any) -> None:
        monkeypatch.setattr(bench.schedules, "count_run", count)
        raise OperationalError("UPDATE", {}, Exception("database or disk is full"))

    monkeypatch.setattr(bench.schedules, "count_run", fails_once)
    bench.queue.start()
    bench.until(lambda event: "queued by schedule" in event)
    assert (len(bench.runs(schedule)), bench.counted(schedule)) == (1, 1)


def test_a_schedule_that_cannot_be_read_holds_up_neither_another_nor_the_queue(bench: Bench) -> None:
    bad = bench.schedule()
    with bench.store.writing() as session:
        session.execute(text("UPDATE schedules SET spec = :spec"), {"spec": '{"trajectory": {"kind": "none"}}'})
    good = bench.schedule()
    bench.experiments.submit("ma2000", ExperimentRequest(spec=SPEC), bench.clock.utc(), "anna")
    bench.queue.start()
    bench.until(lambda event: event.startswith(f"schedule: schedule {bad.id}: its run waits"))
    bench.until(lambda event: event == f"experiment: queued by schedule {good.id}")
    bench.until(lambda event: event == "experiment: failed: refused")


@pytest.mark.parametrize(("exit_code", "state"), [(3, "interrupted"), (6, "cancelled"), (5, "failed")])
def test_events_and_the_queue_call_an_end_as_the_experiment_does(bench: Bench, exit_code: int, state: str) -> None:
    bench.answer = Answer(number=1, problem="why", exit_code=exit_code)
    made = bench.queue.submit(ExperimentRequest(spec=SPEC), "anna", None)[0]
    bench.queue.start()
    bench.until(lambda event: event == f"experiment: {state}: why")
    bench.until(lambda event: event.startswith("queue: paused"))
    assert bench.experiments.get("ma2000", made.id).state == state
    expected = f"experiment {made.id} ended as {state} (why): look at the arm, then resume"
    assert bench.queue.status().reason == expected
