"""A queue on stores of its own, with a clock turned by hand and an arm that answers what a test says."""

import itertools
import sqlite3
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlalchemy.exc import OperationalError

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.labels import Outcome
from daq.contracts.machine import load_machine
from daq.contracts.service.experiments import Experiment, ExperimentRequest, Schedule, ScheduleRequest
from daq.contracts.service.robot import RobotIdentity
from daq.owner.messages import Answer, ArmReport, Finished
from server.queue.context import QueueContext
from server.queue.service import QueueService
from server.robot.control import ControlService
from server.robot.robot import RobotPlace
from server.store.experiments import ExperimentStore
from server.store.queues import QueueStore
from server.store.schedules import ScheduleStore
from tests.server.clocks import HandClock
from tests.server.meanwhile import Happening, Meanwhile
from tests.server.migrated import migrated_store

CALM = ArmReport(arm="idle", cause="", activity="none", limp=(), link="connected", counters={})
MOCK = RobotIdentity(simulated=True, protocol=2, period=0.02, boots=1)
REAL = MOCK.model_copy(update={"simulated": False})
FULL = OperationalError("INSERT", {}, Exception("database or disk is full"))
_BUSY = sqlite3.OperationalError("database is locked")
_BUSY.sqlite_errorcode = sqlite3.SQLITE_BUSY
LOCKED = OperationalError("INSERT", {}, _BUSY)
SPEC = ExperimentSpec.model_validate({"trajectory": {"kind": "pause", "duration": 0.1}, "joints": [1]})

_NUMBERS = itertools.count()
ONLY_WHEN_WOKEN = 3600.0
"""s: a queue that looks so rarely shows whether what happens wakes it."""
AT_ONCE = 0.01
"""s: of a queue that has to look by itself."""
TOO_LONG = 20.0
"""s: what has not happened by then never happens."""


@dataclass
class Arm:
    """What the queue knows of a robot. ask: what becomes of an experiment; orders: what it was told besides"""

    place: RobotPlace
    ask: Callable[..., Future[Answer]]
    orders: list[object]
    identity: RobotIdentity | None = MOCK
    arm: ArmReport | None = CALM
    problem: str = ""
    experiment: str | None = None

    @property
    def name(self) -> str:
        """As in addresses and rows."""
        return self.place.name

    def send(self, order: object) -> None:
        """An order without an answer."""
        self.orders.append(order)


class Asked(Future[Answer]):
    """What becomes of an experiment. looks: how often the queue has looked for it"""

    def __init__(self) -> None:
        super().__init__()
        self.looks = threading.Semaphore(0)

    def result(self, timeout: float | None = None) -> Answer:
        self.looks.release()
        return super().result(timeout)


class Bench:
    """A queue, its stores, at whose calls something may happen, an arm, and all events.

    answer:  what the arm answers an experiment with; None while it moves
    request: what the arm was asked for last
    happens: what is done when an event is recorded, once, by its text
    events:  kind and text of each; records: the same with who did it and the number of the experiment
    lost:    raised for a trace that is to be taken into the catalogue
    """

    def __init__(self, folder: Path) -> None:
        self.store = migrated_store(folder / "service.sqlite")
        self.experiments: Any = Meanwhile(ExperimentStore(self.store))
        self.schedules: Any = Meanwhile(ScheduleStore(self.store))
        self.clock = HandClock()
        self.answer: Answer | None = Answer(number=1, problem="refused", exit_code=2)
        self.asked = Asked()
        self.moves = threading.Event()
        self.request: dict[str, Any] = {}
        self.happens: dict[str, Happening] = {}
        self.lost: Exception | None = None
        self.looked_for_traces = 0
        self.orders: list[object] = []
        self._heard = threading.Condition()
        self.events: list[str] = []
        self.records: list[tuple[str, str | None, str | None]] = []
        self.control = ControlService(
            self.clock, lambda who: self._end("lapsed", who), lambda who: self._end("given_back", who)
        )
        place = RobotPlace("ma2000", "mock://", load_machine("ma2000"), folder)
        self.robot: Any = Arm(place, self._ask, self.orders)
        self.queues: Any = Meanwhile(QueueStore(self.store))
        self.queue = self.begun_anew()

    def close(self) -> None:
        """What runs ends, and so does everything else."""
        if self.moves.is_set() and not self.asked.done():
            self.asked.set_result(done())
        self.queue.close(10)
        self.control.close()
        self.store.close()

    def begun_anew(self, look_every: float = ONLY_WHEN_WOKEN) -> QueueService:
        """The queue as a service that begins now has it."""
        context = QueueContext(
            robot=self.robot,
            control=self.control,
            experiments=self.experiments,
            schedules=self.schedules,
            queues=self.queues,
            clock=self.clock,
            record_event=self._record_event,
            add_trace=self._record,
            add_unfinished_traces=self._look_for_traces,
            unattended=False,
        )
        return QueueService(context, look_every)

    def _end(self, how: str, who: str) -> None:
        """The queue is made after the control, and anew by some tests."""
        {"lapsed": self.queue.control_lapsed, "given_back": self.queue.control_given_back}[how](who)

    def _ask(self, order: object, **fields: object) -> Future[Answer]:
        self.request, self.asked = {"order": order, **fields}, Asked()
        if self.answer is not None:
            self.asked.set_result(self.answer)
        self.moves.set()
        return self.asked

    def _record(self, _answer: Answer) -> None:
        if self.lost is not None:
            raise self.lost

    def _look_for_traces(self) -> None:
        self.looked_for_traces += 1

    def _record_event(self, kind: str, text: str, *, actor: str | None = None, experiment: str | None = None) -> None:
        with self._heard:
            self.events.append(f"{kind}: {text}")
            self.records.append((self.events[-1], actor, experiment))
            self._heard.notify_all()
        self.happens.pop(text, lambda: None)()

    def until(self, said: Callable[[str], bool]) -> str:
        """Waits for such an event."""
        with self._heard:
            assert self._heard.wait_for(lambda: any(said(event) for event in self.events), TOO_LONG), self.events
            return next(event for event in self.events if said(event))

    def until_it_waits(self, line: str) -> None:
        """Waits until this is what the queue says it waits for."""
        end = time.monotonic() + TOO_LONG
        while self.queue.status().waiting_for != line:
            assert time.monotonic() < end, self.queue.status()

    def submit(self) -> Experiment:
        """An experiment that may run at once."""
        return self.queue.submit(ExperimentRequest(spec=SPEC), "anna", None)[0]

    def schedule(self, every: float = 3600) -> Schedule:
        """One whose first run is due now, and then every hour."""
        spec = SPEC.model_copy(update={"notes": str(next(_NUMBERS))})  # the same one twice at the same time is refused
        request = ScheduleRequest(spec=spec, every=every)
        made: Schedule = self.schedules.create("ma2000", request, self.clock.utc(), "anna")
        return made

    def runs(self, schedule: Schedule) -> list[Experiment]:
        return list(self.experiments.page("ma2000", (), schedule.id, None, 10).items)

    def counted(self, schedule: Schedule) -> int:
        """How many runs count as made."""
        return int(self.schedules.get("ma2000", schedule.id).submitted_runs)


def done(outcome: Outcome = "complete") -> Answer:
    """Of a run that left a trace."""
    finished = Finished(outcome=outcome, trace="x.mcap", samples=1, missing=0, counters={}, reason="")
    return Answer(number=1, finished=finished)
