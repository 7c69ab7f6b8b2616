"""`daq diagnose`: the answer for people, the answer for programs, and one line for what cannot be answered."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from daq.cli.diagnose import with_load
from daq.cli.diagnosis_text import WIDTH, answer_text
from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from model.discrepancy.answer import Diagnosis
from model.discrepancy.options import DiagnosisOptions
from model.machine_model.model import base_model
from tests.daq.cli.invoke import CommandLine
from tests.daq.cli_model.conftest import write_csv
from tests.model.discrepancy.answers import an_answer


@pytest.fixture(scope="module")
def answer() -> Diagnosis:
    return an_answer(12.0)[0]


def test_people_read_the_verdict_first_then_where_what_added_shown_asked(answer: Diagnosis) -> None:
    text = answer_text(answer)
    lines = text.splitlines()
    assert lines[0] == "NAMED  coulomb friction on joint 2"
    assert max(map(len, lines)) <= WIDTH
    labels = [line.split()[0] for line in lines if line and not line.startswith(" ")]
    assert labels[:5] == ["NAMED", "where", "what", "added", "shown"]
    assert labels.index("ask") > labels.index("shown")
    assert "joint2.coulomb_friction.torque = 8 N·m (95 %: 7.8 to 8.2)" in text
    assert "98.2 % of the held-out variance beyond noise is gone" in text


def test_other_verdicts_are_said_as_what_they_are(answer: Diagnosis) -> None:
    step = answer.steps[0]
    grouped = step.model_copy(update={"effect": None, "group": step.candidates[:2], "parameters": {}})
    text = answer_text(answer.model_copy(update={"verdict": "ambiguous", "steps": (grouped,)}))
    assert text.startswith("AMBIGUOUS  one of coulomb friction on joint 2, stiction on joint 2")
    text = answer_text(answer.model_copy(update={"verdict": "unknown-effect", "steps": ()}))
    assert text.startswith("UNKNOWN EFFECT  none of the known effects explains what is left")
    assert "N·m against" in text
    text = answer_text(answer.model_copy(update={"verdict": "nothing-significant", "steps": (), "remaining": ()}))
    assert text.startswith("NOTHING SIGNIFICANT  the model explains these traces")


def test_a_step_not_taken_says_so(answer: Diagnosis) -> None:
    step = answer.steps[0].model_copy(update={"adopted": False, "rejected_because": "the held-out error rises"})
    assert "not taken into the model: the held-out error rises" in answer_text(
        answer.model_copy(update={"steps": (step,)})
    )


def test_json_is_the_answer_and_files_are_written(
    daq: CommandLine, answer: Diagnosis, tmp_path: Path, single_axis: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: dict[str, object] = {}

    def imagined(
        model: object, traces: object, holdout: object, options: object, progress: object, ask: object
    ) -> Diagnosis:
        asked.update(model=model, traces=traces, holdout=holdout, options=options)
        return answer

    monkeypatch.setattr("model.discrepancy.workflow.diagnose", imagined)
    monkeypatch.setattr("model.comparison.compare.compare", lambda *_: None)
    monkeypatch.setattr("model.reports.diagnosis_pictures.drawn", lambda *_: "<svg></svg>")
    first, second = write_csv(tmp_path / "first.csv"), write_csv(tmp_path / "second.csv")
    said = daq(
        "diagnose", first, "--holdout", second, "--model", single_axis, "--effects", "backlash,coulomb", "--joints",
        "1", "--most", "2", "--json", "--out", tmp_path / "new.json", "--report", tmp_path / "page.html",
    )  # fmt: skip
    assert said.code == 0, said.err
    assert Diagnosis.model_validate(json.loads(said.out)) == answer
    assert asked["options"] == DiagnosisOptions(effects=("backlash", "coulomb_friction"), joints=(1,), most_steps=2)
    assert len(list(asked["holdout"])) == 1  # type: ignore[call-overload]
    assert json.loads((tmp_path / "new.json").read_text())["lineage"] is not None
    assert "Where they disagree" in (tmp_path / "page.html").read_text()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("nowhere.csv",), "nowhere.csv"),
        (("FIRST", "--out", "model.toml"), "is written as .json"),
        (("FIRST", "--report", "page.pdf"), "is written as .html"),
        (("FIRST", "--effects", "gremlins"), "not in the library"),
        (("FIRST", "--load", "1"), "has no load"),
    ],
)
def test_what_cannot_be_answered_is_one_line(
    daq: CommandLine, tmp_path: Path, single_axis: Path, words: tuple[str, ...], told: str
) -> None:
    first = write_csv(tmp_path / "first.csv")
    daq("diagnose", *[first if w == "FIRST" else w for w in words], "--model", single_axis).complains(2, told)


def test_a_load_that_is_given_is_expected_of_the_arm() -> None:
    arm = base_model(load_machine("ma2000"))
    light = with_load(arm.with_values({"load.mass": 1.0, "link2.mass": 0.9}), 0.5)
    assert light.parameter("load.mass").value == 0.5
    assert light.parameter("link2.mass").value == 0.9
    before = arm.parameter("load.mass")
    assert before.deviation is not None
    assert light.parameter("load.mass").deviation == pytest.approx(0.5 / before.value * before.deviation)
    with pytest.raises(SpecError, match="has no load"):
        with_load(base_model(load_machine("ma2000").model_copy(update={"load": None})), 1.0)
