"""What a refusal says: people know experiments, traces, jobs and models by their names and times, not by numbers."""

from datetime import UTC, datetime
from pathlib import Path

import pytest

from daq.contracts.service.jobs import CompareRequest
from server.problems import ProblemError
from server.store.engine import Store
from server.store.jobs import JobStore
from server.store.models import ModelStore
from server.store.tables import ModelRow
from server.store.traces import TraceStore
from tests.server.store.rows import new_trace

ROBOT = "ma2000"
NOW = datetime(2026, 10, 5, 14, 3, tzinfo=UTC)
NUMBER = f"{0:012x}"
TRACE = new_trace(0, created=NOW, name="loose belt")


@pytest.fixture
def store(store: Store) -> Store:
    """A new database with one trace."""
    TraceStore(store).insert(ROBOT, TRACE)
    return store


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
