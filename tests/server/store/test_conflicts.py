"""What a refusal says: people know experiments, traces, jobs and models by their names and times, not by numbers."""

from datetime import UTC, datetime
from pathlib import Path

import pytest

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.service.experiments import ExperimentRequest
from daq.contracts.service.jobs import CompareRequest
from server.experiments.states import Event
from server.problems import ProblemError
from server.store.engine import Store
from server.store.experiments import ExperimentStore
from server.store.jobs import JobStore
from server.store.labels import trace_label
from server.store.models import ModelStore
from server.store.tables import ModelRow
from server.store.traces import TraceStore
from tests.server.store.rows import new_trace

ROBOT = "ma2000"
NOW = datetime(2026, 10, 5, 14, 3, tzinfo=UTC)
NUMBER = f"{0:012x}"
TRACE = new_trace(0, created=NOW, name="loose belt")


@pytest.fixture
def store(sqlite_store: Store) -> Store:
    """A new database with one trace."""
    TraceStore(sqlite_store).insert(ROBOT, TRACE)
    return sqlite_store


def test_a_trace_in_use_names_itself_and_its_users(store: Store) -> None:
    JobStore(store).submit(ROBOT, CompareRequest(traces=(NUMBER,), models=("machine",)), NOW, "anna", None)
    model = ModelRow(id="9d2f4b6c8e10", robot=ROBOT, name="rig b", file="m.json", created=NOW, created_by="anna")
    ModelStore(store).insert(model, [NUMBER])
    with pytest.raises(ProblemError) as refused:
        TraceStore(store).remove(ROBOT, NUMBER)
    users = "the comparison of 2026-10-05 14:03 UTC, model 'rig b'"
    assert str(refused.value) == f"trace 'loose belt' of 2026-10-05 14:03 UTC is used by {users}"


def test_a_trace_that_exists_already_is_named_with_its_file(store: Store) -> None:
    with pytest.raises(ProblemError) as refused:
        TraceStore(store).insert(ROBOT, TRACE.model_copy(update={"path": Path("other.mcap")}))
    label = "trace 'loose belt' of 2026-10-05 14:03 UTC"
    assert str(refused.value) == f"{label} is in the catalogue already, as {TRACE.path}"


def test_a_trace_without_a_name_is_named_by_its_kind_or_its_file() -> None:
    assert trace_label(None, "slow_ramp", "a_b.mcap", NOW).startswith("trace 'slow ramp' of")
    assert trace_label(None, None, "a_b.mcap", NOW).startswith("trace 'a_b.mcap' of")


def test_a_job_that_has_not_ended_is_named_by_its_kind_and_time(store: Store) -> None:
    jobs = JobStore(store)
    made, _ = jobs.submit(ROBOT, CompareRequest(traces=(NUMBER,), models=("machine",)), NOW, "anna", None)
    with pytest.raises(ProblemError) as refused:
        jobs.remove(ROBOT, made.id)
    assert str(refused.value) == "the comparison of 2026-10-05 14:03 UTC is queued"


@pytest.mark.parametrize(("name", "called"), [("belt-test", "belt-test"), (None, "step")])
def test_an_experiment_whose_priority_cannot_change_is_named(store: Store, name: str | None, called: str) -> None:
    experiments = ExperimentStore(store)
    spec = ExperimentSpec.model_validate({"name": name, "trajectory": {"kind": "step"}})
    made, _ = experiments.submit(ROBOT, ExperimentRequest(spec=spec), NOW, "anna")
    experiments.begin(ROBOT, made.id, NOW)
    experiments.end(ROBOT, made.id, Event.COMPLETED, NOW, "", "complete")
    with pytest.raises(ProblemError) as refused:
        experiments.change(ROBOT, made.id, "anna", 1, None)
    assert str(refused.value) == f"experiment '{called}' of 2026-10-05 14:03 UTC is done"
