"""Rows of several robots in one database: what one robot has is nothing to another."""

from server.store.engine import Store
from server.store.models import ModelStore, NewModel
from server.store.traces import TraceStore
from tests.server.store.rows import NOW, new_trace


def new_model(robot: str) -> NewModel:
    return NewModel("m1", robot, f"of {robot}", "m1.json", NOW, "anna", None, None, ("000000000001",))


def test_the_same_model_belongs_to_each_robot_and_its_file_to_the_last(store: Store) -> None:
    models = ModelStore(store)
    assert models.insert(new_model("left"), lambda: None)
    assert models.insert(new_model("right"), lambda: None)
    assert not models.insert(new_model("right"), lambda: None)
    assert (models.get("left", "m1").name, models.get("right", "m1").name) == ("of left", "of right")
    deleted: list[str] = []
    models.remove("left", "m1", deleted.append)
    assert deleted == []
    assert models.get("right", "m1").traces == ("000000000001",)
    models.remove("right", "m1", deleted.append)
    assert deleted == ["m1.json"]


def test_files_of_one_robot_are_not_missing_in_the_folder_of_another(store: Store) -> None:
    traces = TraceStore(store)
    traces.insert(new_trace(1, robot="left"))
    traces.insert(new_trace(2, robot="right"))
    assert traces.files("left") == {"1.mcap"}
    traces.mark_missing("left", {"1.mcap", "2.mcap"}, missing=True)
    assert traces.get("left", f"{1:012x}").missing
    assert not traces.get("right", f"{2:012x}").missing
