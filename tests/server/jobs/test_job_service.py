"""The service of jobs with an executor that tests hold by hand: what meets in one moment, and what goes wrong once."""

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from sqlalchemy.exc import OperationalError

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from daq.contracts.service.jobs import CompareRequest, DiagnoseRequest, FitRequest, Job, JobRequest
from daq.contracts.trace_limits import TraceLimits
from daq.executors import Workers
from model.machine_model.model import base_model
from model.machine_model.model_file import file_of
from server.api.traces import delete_trace
from server.catalogue.catalogue import Catalogue
from server.experiments.states import Event
from server.jobs.lanes import lane_of
from server.jobs.mailbox import CANCEL, MODEL, Mailbox
from server.jobs.models import Models
from server.jobs.service import JobContext, JobService
from server.jobs.shared_workers import SharedWorkers
from server.jobs.work import Ended, carry_out
from server.problems import ProblemError
from server.store.experiments import ExperimentStore
from server.store.jobs import JobStore
from server.store.models import ModelStore
from server.store.traces import TraceStore
from tests.daq.traces.samples import write
from tests.server.clocks import HandClock
from tests.server.meanwhile import Meanwhile, raising
from tests.server.migrated import migrated_store
from tests.server.store.rows import new_trace

MACHINE = load_machine("ma2000")
TRACE = f"{1:012x}"
COMPARE = CompareRequest(traces=(TRACE,), models=("machine",))


class HandExecutor(Workers):
    """Does what it is given as `carry_out` of a test does, at once; `given` are the jobs that it was given."""

    def __init__(self, carry_out: Callable[[Path], Ended]) -> None:
        self.given: list[str] = []
        self._carry_out = carry_out

    def submit(self, _function: Any, /, *args: Any, **_named: Any) -> Future[Any]:
        (folder,) = args
        self.given.append(folder.name)
        future: Future[Any] = Future()
        future.set_result(self._carry_out(folder))
        return future

    def count(self) -> int:
        return 1


class Bench:
    """A service, its stores, at whose calls something may happen, and everything that it has told."""

    def __init__(self, folder: Path, workers: SharedWorkers | None = None) -> None:
        self.folder = folder / "jobs"
        self.store = migrated_store(folder / "service.sqlite")
        self.jobs: Any = Meanwhile(JobStore(self.store))
        self.clock = HandClock()
        self.kept_traces = TraceStore(self.store)
        self.traces: Any = Meanwhile(self.kept_traces)
        traces = folder / "traces"
        traces.mkdir()
        self.catalogue = Catalogue(traces, "ma2000", self.traces, ExperimentStore(self.store))
        self.traces.insert("ma2000", new_trace(1))
        (traces / "1.mcap").touch()
        models = Models(folder / "models", "ma2000", MACHINE, ModelStore(self.store), self.clock)
        self.models: Any = Meanwhile(models)
        self.carry_out: Callable[[Path], Ended] = lambda _folder: Ended(headline="found")
        self.executor = HandExecutor(self._carry_out)
        self.make_executor: Callable[[int], Workers] = lambda _count: self.executor
        self.changed = threading.Condition()
        self.told: list[Job] = []
        self.service = JobService(
            JobContext(
                robot="ma2000",
                machine=MACHINE,
                folder=self.folder,
                jobs=self.jobs,
                catalogue=self.catalogue,
                models=self.models,
                clock=self.clock,
                changed=self._hear,
                workers=workers or SharedWorkers(1, self._make_executor),
            )
        )

    def _carry_out(self, folder: Path) -> Ended:
        return self.carry_out(folder)  # as it is then

    def _make_executor(self, count: int) -> Workers:
        return self.make_executor(count)

    def _hear(self, job: Job) -> None:
        with self.changed:
            self.told.append(job)
            self.changed.notify_all()

    def end_of(self, job: Job) -> Job:
        """Waits for it; the test's own time limit ends the wait."""
        with self.changed:
            self.changed.wait_for(lambda: self.state_of(job) not in ("queued", "running"))
        return self._kept(job)

    def state_of(self, job: Job) -> str:
        return self._kept(job).state

    def _kept(self, job: Job) -> Job:
        found: Job = self.jobs.get("ma2000", job.id)
        return found


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    """Its service not yet begun: what is submitted waits."""
    made = Bench(tmp_path)
    yield made
    made.service.close(10)
    made.store.close()


def _submitted(bench: Bench) -> Job:
    return bench.service.submit(COMPARE, "anna", None)[0]


def test_a_job_is_running_before_a_worker_has_it(bench: Bench) -> None:
    job = _submitted(bench)
    seen: list[str] = []

    def carry_out(_folder: Path) -> Ended:
        seen.append(bench.state_of(job))
        return Ended()

    bench.carry_out = carry_out
    bench.service.start()
    assert bench.end_of(job).state == "done"
    assert seen == ["running"]


def test_a_job_that_is_cancelled_as_it_is_handed_over_is_told_to_end_and_the_next_begins(bench: Bench) -> None:
    def carry_out(folder: Path) -> Ended:
        if folder.name != first.id:
            return Ended()
        assert bench.service.cancel(first.id, "anna").state == "running"
        return Ended(cancelled=(folder / CANCEL).exists())

    bench.carry_out = carry_out
    first, second = _submitted(bench), _submitted(bench)
    bench.service.start()
    assert bench.end_of(second).state == "done"
    assert bench.end_of(first).state == "cancelled"


def test_a_job_that_is_cancelled_just_before_it_is_taken_is_never_computed(bench: Bench) -> None:
    first, second = _submitted(bench), _submitted(bench)
    bench.jobs.after("waiting", lambda: bench.service.cancel(first.id, "anna"))
    bench.service.start()
    assert bench.end_of(second).state == "done"
    assert bench.state_of(first) == "cancelled"
    assert bench.executor.given == [second.id]


def test_a_job_that_begins_while_it_is_being_cancelled_is_told_to_end(bench: Bench) -> None:
    job = _submitted(bench)
    bench.jobs.before("change", lambda: bench.jobs.change("ma2000", job.id, Event.TAKEN, bench.clock.utc()))
    assert bench.service.cancel(job.id, "anna").state == "running"
    assert (bench.folder / job.id / CANCEL).exists()


def test_a_worker_that_cannot_be_had_ends_its_job_and_no_other(bench: Bench) -> None:
    class Refusing(HandExecutor):
        def submit(self, _function: Any, /, *args: Any, **named: Any) -> Future[Any]:
            if not self.given:
                self.given.append(args[0].name)
                raise OSError("no process any more")
            return super().submit(_function, *args, **named)

    bench.executor = Refusing(lambda _folder: Ended())
    first, second = _submitted(bench), _submitted(bench)
    bench.service.start()
    assert bench.end_of(second).state == "done"
    failed = bench.end_of(first)
    assert (failed.failure, failed.reason) == ("program-fault", "program fault: OSError: no process any more")


def test_a_job_whose_executor_is_broken_is_given_to_a_new_one(bench: Bench) -> None:
    class Broken(HandExecutor):
        def submit(self, _function: Any, /, *args: Any, **named: Any) -> Future[Any]:
            raise BrokenExecutor

    executors = [Broken(lambda _folder: Ended()), bench.executor]
    bench.make_executor = lambda _count: executors.pop(0)
    job = _submitted(bench)
    bench.service.start()
    assert bench.end_of(job).state == "done"


def _makes_a_model(folder: Path) -> Ended:
    mass = next(one for one in base_model(MACHINE).parameters if one.name.endswith("mass"))
    model = base_model(MACHINE).with_values({mass.name: 1.01 * mass.value})
    (folder / MODEL).write_text(model.model_dump_json(), "utf-8")
    return Ended(model=model.identity, headline="fitted")


def test_a_model_that_could_not_be_kept_at_once_is_kept_at_the_next_look(bench: Bench) -> None:
    bench.carry_out = _makes_a_model
    bench.models.before("add_from_file", raising(OperationalError("INSERT", {}, Exception("database or disk is full"))))
    job = bench.service.submit(FitRequest(traces=(TRACE,)), "anna", None)[0]
    bench.service.start()
    ended = bench.end_of(job)
    assert (ended.state, ended.headline) == ("done", "fitted")
    assert ended.model is not None
    assert bench.models.path_of(ended.model).is_file()


@pytest.mark.parametrize("error", [ValueError("no model"), OSError("read-only")])
def test_a_model_that_can_never_be_kept_holds_up_no_other_job(bench: Bench, error: Exception) -> None:
    bench.models.before("add_from_file", *[raising(error)] * 1000)
    bench.carry_out = lambda folder: _makes_a_model(folder) if folder.name == first.id else Ended()
    first = bench.service.submit(FitRequest(traces=(TRACE,)), "anna", None)[0]
    second = _submitted(bench)
    bench.service.start()
    assert bench.end_of(second).state == "done"
    if isinstance(error, ValueError):  # nothing that another look could mend
        failed = bench.end_of(first)
        assert (failed.failure, failed.reason) == ("program-fault", "program fault: ValueError: no model")


def test_what_could_not_be_begun_is_begun_at_the_next_look(bench: Bench) -> None:
    job = _submitted(bench)
    bench.jobs.before("waiting", raising(OperationalError("SELECT", {}, Exception("database is locked"))))
    bench.service.start()
    assert bench.end_of(job).state == "done"


def _kept(bench: Bench) -> tuple[Job, ...]:
    return tuple(bench.jobs.page("ma2000", (), None, None, 10).items)


def test_there_is_no_job_without_its_request(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    class KilledError(OSError):
        """The disk takes no more, or the process ends."""

    def killed(_self: Mailbox, _name: str, _data: Any) -> None:
        raise KilledError

    monkeypatch.setattr(Mailbox, "write", killed)
    with pytest.raises(KilledError):
        _submitted(bench)
    assert _kept(bench) == ()
    assert list(bench.folder.iterdir()) == []


def test_the_same_key_is_the_same_job_whatever_became_of_its_traces(bench: Bench) -> None:
    first, new = bench.service.submit(COMPARE, "anna", "key")
    assert new
    bench.catalogue.path_of(TRACE).unlink()
    assert bench.service.submit(COMPARE, "anna", "key") == (first, False)
    with pytest.raises(ProblemError, match="used for another request"):
        bench.service.submit(FitRequest(traces=(TRACE,)), "anna", "key")
    with pytest.raises(ProblemError, match="there is no file for trace"):
        bench.service.submit(COMPARE, "anna", "another key")


def test_a_job_refers_to_no_trace_that_is_deleted_as_it_is_submitted(bench: Bench) -> None:
    bench.jobs.before("submit", lambda: bench.traces.remove("ma2000", TRACE))
    with pytest.raises(ProblemError, match="there is no trace"):
        _submitted(bench)
    assert _kept(bench) == ()


def test_a_trace_is_not_deleted_when_a_job_comes_to_refer_to_it_meanwhile(bench: Bench) -> None:
    bench.traces.before("remove", lambda: _submitted(bench))
    one = SimpleNamespace(robot=SimpleNamespace(name="ma2000"), catalogue=bench.catalogue)
    with pytest.raises(ProblemError, match="is used by"):
        delete_trace(TRACE, one, None)  # type: ignore[arg-type]
    assert bench.catalogue.path_of(TRACE).is_file()


class HeldExecutor(HandExecutor):
    """Computes nothing until the test lets it."""

    def __init__(self) -> None:
        super().__init__(lambda _folder: Ended())
        self.futures: dict[str, Future[Ended]] = {}

    def submit(self, _function: Any, /, *args: Any, **_named: Any) -> Future[Any]:
        (folder,) = args
        self.futures[folder.name] = future = Future()
        return future


def _asked(bench: Bench, request: JobRequest) -> Job:
    return bench.service.submit(request, "anna", None)[0]


def _until(bench: Bench, is_so: Callable[[], bool]) -> None:
    with bench.changed:
        bench.changed.wait_for(is_so)


def test_a_short_job_waits_behind_no_diagnosis_and_the_next_one_says_behind_what(bench: Bench) -> None:
    held = HeldExecutor()
    bench.make_executor = lambda _count: held
    diagnosis = _asked(bench, DiagnoseRequest(traces=(TRACE,)))
    fit, other_fit = _asked(bench, FitRequest(traces=(TRACE,))), _asked(bench, FitRequest(traces=(TRACE,)))
    short, next_short = _asked(bench, COMPARE), _asked(bench, COMPARE)
    bench.service.start()
    _until(bench, lambda: {diagnosis.id, short.id} <= {job.id for job in bench.told if job.state == "running"})
    assert set(held.futures) == {diagnosis.id, short.id}

    told = {job.id: job for job in bench.service.with_progress_all(bench.jobs.waiting("ma2000"))}
    behind = [told[job.id].waits_behind for job in (fit, other_fit, next_short)]
    assert [(one.job, one.request.kind, one.others) for one in behind if one] == [
        (diagnosis.id, "diagnose", 0),
        (diagnosis.id, "diagnose", 1),
        (short.id, "compare", 0),
    ]
    assert all(one and one.started == bench.clock.utc() for one in behind)

    held.futures[diagnosis.id].set_result(Ended())
    _until(bench, lambda: any(job.id == other_fit.id and _waits_behind(job) == fit.id for job in bench.told))
    held.futures[short.id].set_result(Ended())
    _until(bench, lambda: any(job.id == next_short.id and job.state == "running" for job in bench.told))


def _waits_behind(job: Job) -> str | None:
    return None if job.waits_behind is None else job.waits_behind.job


def test_a_worker_that_ends_takes_no_job_of_the_other_lane_with_it(bench: Bench) -> None:
    executors = [HeldExecutor(), HeldExecutor(), HeldExecutor()]
    made: list[HeldExecutor] = []

    def make_executor(_count: int) -> Workers:
        made.append(executors[len(made)])
        return made[-1]

    bench.make_executor = make_executor
    diagnosis, short, next_short = _asked(bench, DiagnoseRequest(traces=(TRACE,))), _submitted(bench), _submitted(bench)
    bench.service.start()
    _until(bench, lambda: {diagnosis.id, short.id} <= {job.id for job in bench.told if job.state == "running"})
    made[1].futures[short.id].set_exception(BrokenExecutor())
    _until(bench, lambda: any(job.id == next_short.id and job.state == "running" for job in bench.told))
    assert next_short.id in made[2].futures
    assert bench.state_of(diagnosis) == "running"
    assert not made[0].futures[diagnosis.id].done()


def test_an_executor_that_is_lost_is_ended_and_the_next_job_has_another(bench: Bench) -> None:
    held, ended = HeldExecutor(), threading.Event()
    held.abandon = ended.set  # type: ignore[method-assign]
    executors: list[Workers] = [held, bench.executor]
    bench.make_executor = lambda _count: executors.pop(0)
    job = _submitted(bench)
    bench.service.start()
    _until(bench, lambda: job.id in held.futures)
    held.futures[job.id].set_exception(BrokenExecutor("killed"))
    assert bench.end_of(job).failure == "lost"
    assert ended.wait(5)
    following = _submitted(bench)
    _until(bench, lambda: following.id in bench.executor.given)


@pytest.mark.parametrize(("models", "lane"), [(10, "short"), (11, "long")])
def test_a_comparison_is_short_by_what_it_has_to_compute(models: int, lane: str) -> None:
    request = CompareRequest.model_construct(traces=(TRACE,) * 2, models=("machine",) * models)
    assert lane_of(request) == lane


def test_a_job_reads_traces_within_the_limits_that_are_configured(bench: Bench) -> None:
    path = bench.catalogue.folder / "1.mcap"
    path.unlink()
    write(path)
    bench.catalogue.limits = TraceLimits(records=10)
    bench.carry_out = carry_out
    job = _submitted(bench)
    bench.service.start()
    ended = bench.end_of(job)
    assert ended.state == "failed"
    assert "traces.limits.records" in ended.reason


def test_a_model_is_not_taken_for_another_that_is_in_its_file(bench: Bench) -> None:
    made = file_of(base_model(MACHINE))
    path = bench.models.folder / f"{made.identity}.json"
    path.parent.mkdir(exist_ok=True)
    path.write_text(made.text, "utf-8")
    with pytest.raises(SpecError, match="another model has this ID"):
        bench.models.add(made.model_copy(update={"text": made.text.replace("1", "2", 1)}), "forged", "bert")
    assert path.read_text("utf-8") == made.text
    path.write_text("cut off", "utf-8")
    assert bench.models.add(made, "sound", "anna")
    assert path.read_text("utf-8") == made.text
