"""The database: catalogue and cursors do what they say, each robot's rows its own."""

from contextlib import closing
from datetime import timedelta
from pathlib import Path

import pytest
from sqlalchemy import text

from daq.config.service import ServiceSettings
from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.service.experiments import ExperimentRequest
from daq.contracts.service.jobs import DiagnoseRequest
from daq.contracts.service.traces import TraceChange
from server.experiments.states import Event
from server.stopping.tokens import reader_of
from server.store.engine import Store
from server.store.experiments import ExperimentStore
from server.store.jobs import JobStore
from server.store.models import ModelStore
from server.store.tables import ModelRow
from server.store.traces import TraceSearch, TraceStore
from tests.server.store.rows import NOW, new_trace


def _found(traces: TraceStore, **search: object) -> list[int]:
    """The numbers of the traces that a search finds."""
    page = traces.page("ma2000", TraceSearch(**search), None, 10)  # type: ignore[arg-type]
    return [int(one.id, 16) for one in page.items]


def test_nobody_else_may_read_the_database(store: Store, tmp_path: Path) -> None:
    with store.engine.begin() as connection:
        connection.execute(text("CREATE TABLE written (x INTEGER)"))
        files = [path for path in tmp_path.iterdir() if path.name.startswith("service.sqlite")]
        assert files
        assert not [path.name for path in files if path.stat().st_mode & 0o077]


@pytest.mark.parametrize("name", ["why?", "a%41b", "50%", "a#b", "x?mode=memory&y", "ü :@"])
def test_a_folders_name_is_no_syntax_of_an_address(tmp_path: Path, name: str) -> None:
    folder = tmp_path / name / "service"
    file = ServiceSettings(folder=folder).database
    with closing(Store(file)) as store:
        store.migrate()
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert reader_of(file)() == {}


def test_a_database_of_another_version_is_refused(store: Store) -> None:
    with store.writing() as session:
        session.execute(text("UPDATE alembic_version SET version_num='9999'"))
    with pytest.raises(SpecError, match="cannot be brought up to date"):
        store.migrate()


def test_what_is_committed_survives_a_power_cut(store: Store) -> None:
    with store.engine.connect() as connection:
        assert connection.execute(text("PRAGMA journal_mode")).scalar() == "wal"
        assert connection.execute(text("PRAGMA synchronous")).scalar() == 2  # FULL


def test_a_change_that_fails_leaves_nothing(store: Store) -> None:
    def fails() -> None:
        with store.writing() as session:
            session.execute(text("INSERT INTO queues VALUES ('ma2000', true, 'x', '2026-01-01')"))
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fails()
    with store.reading() as session:
        assert session.execute(text("SELECT count(*) FROM queues")).scalar() == 0


def test_what_ran_is_interrupted_after_a_restart_and_what_waits_waits(store: Store) -> None:
    experiments = ExperimentStore(store)
    made = [experiments.submit("ma2000", ExperimentRequest(), NOW, "anna")[0] for _ in range(3)]
    experiments.begin("ma2000", made[0].id, NOW)
    experiments.begin("ma2000", made[1].id, NOW)
    experiments.end("ma2000", made[1].id, Event.COMPLETED, NOW, "", "complete")
    assert [one.id for one in experiments.settle_after_restart("ma2000", NOW)] == [made[0].id]
    states = [experiments.get("ma2000", one.id).state for one in made]
    assert states == ["interrupted", "done", "queued"]
    assert experiments.settle_after_restart("ma2000", NOW) == []


def test_a_trace_that_is_found_before_the_end_of_its_experiment_is_told_stays_found(store: Store) -> None:
    experiments = ExperimentStore(store)
    made, _ = experiments.submit("ma2000", ExperimentRequest(), NOW, "anna")
    experiments.begin("ma2000", made.id, NOW)
    trace = experiments.trace_number(made.id)
    experiments.traced(trace, "interrupted")
    ended = experiments.end("ma2000", made.id, Event.LOST, NOW, "its process was killed")
    assert (ended.outcome, ended.trace) == ("interrupted", trace)


def test_a_clock_that_is_set_back_keeps_the_order_of_submission(store: Store) -> None:
    experiments = ExperimentStore(store)
    moments = [NOW, NOW - timedelta(days=3), NOW - timedelta(days=1), NOW + timedelta(hours=1)]
    made = [experiments.submit("ma2000", ExperimentRequest(), moment, "anna")[0].id for moment in moments]
    assert [one.id for one in experiments.in_order("ma2000")] == made
    listed = experiments.page("ma2000", (), None, None, 10).items
    assert [one.id for one in listed] == made[::-1]


def test_what_ended_last_comes_first_whenever_it_was_submitted(store: Store) -> None:
    experiments = ExperimentStore(store)
    made = [experiments.submit("ma2000", ExperimentRequest(), NOW, "anna")[0].id for _ in range(5)]
    ends = [2, 0, 4, 1]
    for minutes, place in enumerate(ends):
        experiments.cancel_waiting("ma2000", made[place], NOW + timedelta(minutes=minutes // 2), "anna")
    first = experiments.page("ma2000", (), None, None, 3, "ended")
    rest = experiments.page("ma2000", (), None, first.next, 3, "ended")
    found = [one.id for one in (*first.items, *rest.items)]
    assert (set(found[:2]), set(found[2:])) == ({made[4], made[1]}, {made[2], made[0]})
    assert rest.next is None


def test_pages_leave_nothing_out_and_double_nothing_while_rows_come(store: Store) -> None:
    experiments = ExperimentStore(store)
    for _ in range(7):
        experiments.submit("ma2000", ExperimentRequest(), NOW, "anna")
    seen, cursor = [], None
    while True:
        page = experiments.page("ma2000", (), None, cursor, 3)
        seen += [one.id for one in page.items]
        experiments.submit("ma2000", ExperimentRequest(), NOW, "bert")
        cursor = page.next
        if cursor is None:
            break
    assert len(seen) == len(set(seen)) == 7


def test_search_finds_what_it_is_asked_for_and_takes_nothing_as_a_pattern(store: Store) -> None:
    traces = TraceStore(store)
    traces.insert("ma2000", new_trace(1, notes="Loose BELT at 100%"))
    traces.insert("ma2000", new_trace(2, name="belt_test", kind="sine"))
    traces.insert("ma2000", new_trace(3, outcome="fault"))
    traces.change("ma2000", f"{3:012x}", TraceChange(tags=("wear", "wear", "week 2")))
    assert traces.get("ma2000", f"{3:012x}").tags == ("wear", "week 2")
    for searched, numbers in (
        (None, [3, 2, 1]),
        ("belt", [2, 1]),
        ("100%", [1]),
        ("%", [1]),
        ("belt_", [2]),
        ("'; DROP TABLE traces; --", []),
        ('"belt" OR loose', []),
        ("\0\0\0", []),
        ("elt", [2, 1]),
        ("lt", [3, 2, 1]),
        ("WEEK", [3]),
    ):
        assert _found(traces, text=searched) == numbers, searched
    assert _found(traces, outcome="fault") == _found(traces, tag="wear") == [3]
    assert _found(traces, kind="sine") == [2]
    assert _found(traces, tag="\0") == []
    assert _found(traces, since=NOW + timedelta(seconds=2)) == [3, 2]


def test_traces_are_found_by_joints_that_moved_and_by_what_the_newest_diagnosis_named(store: Store) -> None:
    traces, jobs = TraceStore(store), JobStore(store)
    traces.insert("ma2000", new_trace(1, moved=(1, 12)))
    traces.insert("ma2000", new_trace(2, moved=(2,)))
    assert (_found(traces, joint=1), _found(traces, joint=2), _found(traces, joint=3)) == ([1], [2], [])
    assert traces.get("ma2000", f"{1:012x}").moved == (1, 12)
    request = DiagnoseRequest(traces=(f"{1:012x}",), held_out=(f"{2:012x}",))
    made = [jobs.submit("ma2000", request, NOW, "anna", None)[0].id for _ in range(3)]
    for job, effects in zip(made, (("backlash", "coulomb_friction"), ("load",)), strict=False):
        jobs.change("ma2000", job, Event.TAKEN, NOW)
        jobs.change("ma2000", job, Event.COMPLETED, NOW, effects=effects)
    assert (_found(traces, effect="load"), _found(traces, effect="load", joint=2)) == ([2, 1], [2])
    assert _found(traces, effect="backlash") == _found(traces, effect="loa_") == []
    jobs.remove("ma2000", made[1])
    assert _found(traces, effect="backlash") == [2, 1]


def test_a_spec_and_long_notes_come_back_as_they_were_given(store: Store) -> None:
    experiments, traces = ExperimentStore(store), TraceStore(store)
    spec = ExperimentSpec.model_validate({"trajectory": {"kind": "sine", "amplitude": {1: 0.1}}, "joints": [1]})
    made, _ = experiments.submit("ma2000", ExperimentRequest(spec=spec), NOW, "anna")
    assert experiments.get("ma2000", made.id).spec == spec
    notes = "".join(chr(33 + number * 7919 % 90) for number in range(20_000))  # no two parts are alike: nothing to pack
    traces.insert("ma2000", new_trace(1, notes=notes))
    assert traces.get("ma2000", f"{1:012x}").notes == notes


def test_the_search_follows_every_change_of_a_text(store: Store) -> None:
    traces = TraceStore(store)
    traces.insert("ma2000", new_trace(1, notes="brass bush"))
    traces.insert("ma2000", new_trace(2, notes="brass ring"))
    assert _found(traces, text="brass") == [2, 1]
    traces.change("ma2000", f"{1:012x}", TraceChange(notes="steel bush"))
    assert (_found(traces, text="brass"), _found(traces, text="steel")) == ([2], [1])
    traces.remove("ma2000", f"{2:012x}")
    assert (_found(traces, text="brass"), _found(traces, text="ring")) == ([], [])


def test_texts_are_found_in_the_order_of_the_list_page_by_page(store: Store) -> None:
    traces = TraceStore(store)
    for number in range(8):
        traces.insert("ma2000", new_trace(number, notes="rare" if number in {2, 5} else "often"))
    seen, cursor = [], None
    while cursor is not None or not seen:
        page = traces.page("ma2000", TraceSearch(text="often"), cursor, 2)
        seen += [int(one.id, 16) for one in page.items]
        cursor = page.next
    assert seen == [7, 6, 4, 3, 1, 0]
    assert _found(traces, text="rare") == [5, 2]


def test_the_same_model_belongs_to_each_robot_and_its_file_to_the_last(store: Store) -> None:
    models = ModelStore(store)
    for robot, new in (("left", True), ("right", True), ("right", False)):
        row = ModelRow(id="m1", robot=robot, name=f"of {robot}", file="m1.json", created=NOW, created_by="anna")
        assert models.insert(row, ["000000000001"]) is new
    assert (models.get("left", "m1").name, models.get("right", "m1").name) == ("of left", "of right")
    deleted: list[str] = []
    models.remove("left", "m1", deleted.append)
    assert deleted == []
    assert models.get("right", "m1").traces == ("000000000001",)
    models.remove("right", "m1", deleted.append)
    assert deleted == ["m1.json"]


def test_files_of_one_robot_are_not_missing_in_the_folder_of_another_and_come_back(store: Store) -> None:
    traces = TraceStore(store)
    traces.insert("left", new_trace(1))
    traces.insert("right", new_trace(2))
    assert traces.files("left") == {"1.mcap"}
    traces.mark_missing("left", {"1.mcap", "2.mcap"}, missing=True)
    assert traces.get("left", f"{1:012x}").missing
    assert not traces.get("right", f"{2:012x}").missing
    traces.mark_missing("left", ["1.mcap"], missing=False)
    assert not traces.get("left", f"{1:012x}").missing
