"""Models as data: named parameters, files, lineage."""

import json
from pathlib import Path
from typing import Any

import pytest

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from model import layout as at
from model.machine_model.model import Lineage, Model, base_model
from model.machine_model.model_file import load_model, save_model


@pytest.fixture
def model() -> Model:
    return base_model(load_machine("ma2000"))


def _with(**changes: Any) -> str:
    """A model's file with other fields."""
    data = json.loads(base_model(load_machine("ma2000")).model_dump_json())
    return json.dumps(data | changes)


def test_a_model_file_gives_the_same_model_back(model: Model, tmp_path: Path) -> None:
    changed = (
        model.with_effect("backlash", (2,), {"gap": 0.01})
        .tied("motor.back_emf_constant", ("joint1.motor.back_emf_constant", "joint3.motor.back_emf_constant"))
        .with_values({"load.mass": 1.1})
        .with_lineage(Lineage(parent=model.identity, traces=("a", "b"), fit={"rmse": 1e-3}))
    )
    save_model(changed, tmp_path / "m.json")
    again = load_model(tmp_path / "m.json")
    assert again == changed
    assert again.identity == changed.identity != model.identity
    assert changed.with_lineage(Lineage()).identity not in (changed.identity, model.identity)
    assert (again.vector == changed.vector).all()


def test_a_newer_model_file_is_refused_in_one_line(model: Model, tmp_path: Path) -> None:
    save_model(model, tmp_path / "m.json")
    data = json.loads((tmp_path / "m.json").read_text("utf-8"))
    (tmp_path / "m.json").write_text(json.dumps({**data, "format": 99}), "utf-8")
    with pytest.raises(SpecError, match="has format 99, this version of the program reads up to"):
        load_model(tmp_path / "m.json")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{", "not JSON"),
        ("[]", "neither a model nor"),
        ('{"machine": {}}', "says no version"),
        ('{"machine": {}, "format": 1}', "machine.version"),
        (_with(values={"link1.mass": -1e9}), "link1.mass = -1000000000.0 kg: allowed are 0.0 to inf"),
        (_with(effects=[{"name": "backlash", "joints": [1, 2]}, {"name": "backlash", "joints": [2]}]), "twice for the"),
        (_with(effects=[{"name": "backlash", "joints": [1, 1]}]), "backlash: in the model twice for the same joint"),
        (_with(ties={"load.mass": ["link1.mass", "link2.mass"]}), "tie 'load.mass': the model has a parameter of this"),
        (_with(ties={"x": ["link1.mass"]}), "ties.x: has 1 entries, must have at least 2"),
        (_with(ties={"x": ["link1.mass", "link1.mass"]}), "names a parameter twice"),
        (_with(ties={"x": ["link1.mass", "link9.mass"]}), "are not parameters of the model"),
    ],
)
def test_what_is_not_a_model_is_refused(text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "m.json").write_text(text, "utf-8")
    with pytest.raises(SpecError, match=says):
        load_model(tmp_path / "m.json")


def test_every_parameter_is_within_its_bounds_and_lies_in_its_own_place(model: Model) -> None:
    slots = [s for p in model.parameters for s in p.slots]
    assert len(slots) == len(set(slots))
    for p in model.parameters:
        assert p.low <= p.value <= p.high
        assert model.vector[list(p.slots)] == pytest.approx(p.value)


def test_changing_values_leaves_the_first_model_as_it_was(model: Model) -> None:
    before = model.vector.copy()
    heavier = model.with_values({"load.mass": 2.0})
    assert heavier.vector[at.LOAD] == 2.0
    assert (model.vector == before).all()
    with pytest.raises(SpecError, match="allowed are"):
        model.with_values({"load.mass": -1.0})
    with pytest.raises(SpecError, match="not in this model"):
        model.with_values({"load.masses": 1.0})


def test_ties_share_one_value(model: Model) -> None:
    tied = model.tied("motor.back_emf_constant", ("joint1.motor.back_emf_constant", "joint3.motor.back_emf_constant"))
    changed = tied.with_values({"motor.back_emf_constant": 0.04})
    assert [changed.vector[at.slot(j, at.BACK_EMF)] for j in (1, 2, 3)] == [
        0.04,
        model.vector[at.slot(2, at.BACK_EMF)],
        0.04,
    ]
