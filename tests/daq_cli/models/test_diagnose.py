"""`daq diagnose`: the answer for people, the answer for programs, and one line for what cannot be answered."""

import json
import re
from pathlib import Path

import pytest

from daq_cli.models.diagnosis_text import WIDTH, answer_text, candidates_lines
from daq_cli.robot.experiment import read_spec
from model.discrepancy.diagnosis import Candidate, Diagnosis, Step
from model.discrepancy.explanation.answer_words import with_sentences
from model.discrepancy.explanation.notes import on_stated_numbers
from model.discrepancy.grounds import Note
from model.discrepancy.options import DiagnosisOptions
from model.fitting.unknowns import Unknown
from model.machine_model.parameter import Kind, Parameter
from model.reports.diagnosis_data import diagnosis_data
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.models.conftest import write_csv
from tests.model.discrepancy import steps
from tests.model.discrepancy.answers import an_answer


@pytest.fixture(scope="module")
def answer() -> Diagnosis:
    return an_answer(12.0)[0]


def test_people_read_the_verdict_first_then_where_what_added_shown_asked(answer: Diagnosis) -> None:
    text = answer_text(answer)
    lines = text.splitlines()
    assert lines[0] == "NAMED  Coulomb friction on joint 2, 8 N·m (7.8 to 8.2)"
    assert max(map(len, lines)) <= WIDTH
    labels = [line.split()[0] for line in lines if line and not line.startswith(" ")]
    assert labels[:6] == ["NAMED", "method", "where", "what", "added", "shown"]
    assert lines[2] == "method   Simulation of the closed loop (output error)."
    torques = answer_text(answer.model_copy(update={"method": "inverse-dynamics"})).splitlines()
    assert torques[2] == "method   Balance of torques along the recorded motion (inverse dynamics)."
    assert labels.index("ask") > labels.index("shown")
    assert "joint2.coulomb_friction.torque = 8 N·m (95 %: 7.8 to 8.2)" in text
    assert "98.2 % of the held-out variance beyond noise is gone" in text


def test_other_verdicts_are_said_as_what_they_are(answer: Diagnosis) -> None:
    step = answer.steps[0]
    grouped = step.model_copy(update={"effect": None, "group": step.candidates[:2], "parameters": {}})
    text = answer_text(answer.model_copy(update={"verdict": "ambiguous", "steps": (grouped,)}))
    assert text.startswith("AMBIGUOUS  one of: Coulomb friction on joint 2 or stiction on joint 2")
    text = answer_text(with_sentences(answer.model_copy(update={"verdict": "unknown-effect", "steps": ()})))
    assert text.startswith("UNKNOWN EFFECT  none of the known effects explains what is left")
    assert "N·m that goes with" in " ".join(text.split())
    text = answer_text(answer.model_copy(update={"verdict": "nothing-significant", "steps": (), "remaining": ()}))
    assert text.startswith("NOTHING SIGNIFICANT  the model explains these traces")


def test_numbers_far_from_what_is_stated_stand_right_under_the_verdict(answer: Diagnosis) -> None:
    load = Parameter(name="load.mass", kind=Kind.INERTIA, part="mass", unit="kg", value=500.0)
    mass = Unknown(load, start=500.0, expected=500.0, deviation=50.0)
    notes = (Note(kind="positions-of-links"), *on_stated_numbers([mass], {"load.mass": 1.3}))
    warned = with_sentences(answer.model_copy(update={"notes_data": notes}))
    lines = [line for line in answer_text(warned).splitlines() if line]
    assert lines[1].startswith("WARNING  This number came out more than 4 of its stated deviations")
    assert sum("stated deviations" in line for line in lines) == 1
    assert "WARNING" not in answer_text(answer)


def test_json_is_the_answer_and_files_are_written(
    daq: CommandLine, answer: Diagnosis, tmp_path: Path, single_axis: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: dict[str, object] = {}

    def imagined(
        model: object, traces: object, holdout: object, options: object, progress: object, *, chooser: object
    ) -> Diagnosis:
        asked.update(model=model, traces=traces, holdout=holdout, options=options)
        return answer

    monkeypatch.setattr("model.discrepancy.workflow.diagnose", imagined)
    monkeypatch.setattr("model.reports.diagnosis_data.told", lambda found, *_: diagnosis_data(found, None))
    first, second = write_csv(tmp_path / "first.csv"), write_csv(tmp_path / "second.csv")
    files = {"--out": tmp_path / "new.json", "--report": tmp_path / "page.html", "--next": tmp_path / "asked.json"}
    options = ("--effects", "backlash,coulomb", "--joints", 1, "--most", 2, "--json", *sum(files.items(), ()))
    said = daq("diagnose", first, "--holdout", second, "--model", single_axis, *options)
    assert said.code == 0, said.err
    assert answer.next_experiment is not None
    assert read_spec(tmp_path / "asked.json") == answer.next_experiment.spec
    assert f"daq run spec {tmp_path / 'asked.json'}" in "".join(said.err.split("\n"))
    assert Diagnosis.model_validate(json.loads(said.out)) == answer
    assert asked["options"] == DiagnosisOptions(
        effects=("backlash", "coulomb_friction"), joints=(1,), most_steps=2, method="output-error"
    ), "it alone proposes the experiment that --next is to write"
    assert len(list(asked["holdout"])) == 1  # type: ignore[call-overload]
    assert json.loads((tmp_path / "new.json").read_text())["lineage"] is not None
    page = (tmp_path / "page.html").read_text()
    (data,) = re.findall(r'<script id="data" type="application/json">(.*?)</script>', page)
    assert json.loads(data)["found"]["summary"] == answer.summary


@pytest.mark.parametrize(
    ("words", "method"),
    [
        ((), None),
        (("--method", "inverse-dynamics"), "inverse-dynamics"),
        (("--method", "output-error"), "output-error"),
        (("--method", "inverse-dynamics", "--next", "asked.json"), "inverse-dynamics"),
    ],
)
def test_the_method_is_the_one_that_was_asked_for(
    words: tuple[str, ...],
    method: str | None,
    daq: CommandLine,
    answer: Diagnosis,
    tmp_path: Path,
    single_axis: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[DiagnosisOptions] = []

    def imagined(*given: object, **_more: object) -> Diagnosis:
        asked.append(next(one for one in given if isinstance(one, DiagnosisOptions)))
        return answer

    monkeypatch.setattr("model.discrepancy.workflow.diagnose", imagined)
    monkeypatch.chdir(tmp_path)
    said = daq("diagnose", write_csv(tmp_path / "first.csv"), "--model", single_axis, *words)
    assert said.code == 0, said.err
    assert [options.method for options in asked] == [method]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("nowhere.csv",), "nowhere.csv"),
        (("FIRST", "--out", "model.toml"), "is written as .json"),
        (("FIRST", "--report", "page.pdf"), "must be an .html file"),
        (("FIRST", "--next", "asked.toml"), "an experiment is written as .json"),
        (("FIRST", "--next", "nowhere/asked.json"), "there is no folder"),
        (("FIRST", "--effects", "gremlins"), "not in the library"),
        (("FIRST", "--effects", "viscous:2,coulomb"), "joints go with --joints here"),
        (("FIRST", "--load", "1"), "has no load"),
    ],
)
def test_what_cannot_be_answered_is_one_line(
    daq: CommandLine, tmp_path: Path, single_axis: Path, words: tuple[str, ...], told: str
) -> None:
    first = write_csv(tmp_path / "first.csv")
    daq("diagnose", *[first if w == "FIRST" else w for w in words], "--model", single_axis).complains(2, told)


# ---- candidates in a terminal: what fits have shown, the named one always among them; below it what probes promise


def fitted(effect: str, evidence: float) -> Candidate:
    return Candidate(effect=effect, joints=(1,), evidence=evidence, misfit=1.0, refitted=True)


def probed(effect: str, evidence: float) -> Candidate:
    return Candidate(effect=effect, joints=(1,), evidence=evidence)


def step(effect: str, *candidates: Candidate) -> Step:
    return steps.step(effect, candidates=candidates)


def test_probes_stand_below_what_was_fitted_however_much_they_promise() -> None:
    lines = candidates_lines(
        step("backlash", *(probed(f"p{k}", 9000.0 - k) for k in range(6)), fitted("backlash", 50.0))
    )
    assert [line.split()[-1] for line in lines] == ["evidence", "1.00", "fitted)", "1", "1", "more"]
    assert "backlash on joint 1" in lines[1]
    assert lines[2] == "promised by probes alone (not fitted)"
    assert lines[-1].split() == ["and", "4", "more"]


def test_the_named_one_is_listed_wherever_it_stands() -> None:
    others = [fitted(f"f{k}", 100.0 - k) for k in range(7)]
    lines = candidates_lines(step("backlash", *others, fitted("backlash", 5.0)))
    assert "backlash on joint 1" in lines[-2]
    assert len(lines) == 8
    group = step("f0", *others).model_copy(update={"effect": None, "group": (others[0], others[6])})
    assert "f6" in candidates_lines(group)[-2]
