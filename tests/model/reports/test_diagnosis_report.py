"""The page of a diagnosis tells the whole story, for every verdict, from the answer alone."""

from __future__ import annotations

import re

import pytest

from model.comparison.compare import Comparison
from model.discrepancy.answer import Diagnosis, SignalError
from model.reports.diagnosis_report import diagnosis_page, diagnosis_report
from model.reports.page import Table, html
from tests.model.discrepancy.answers import EFFECT, an_answer


@pytest.fixture(scope="module")
def answer() -> tuple[Diagnosis, Comparison]:
    return an_answer(12.0)


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures cost seconds; what the words say does not need them."""
    for module in ("diagnosis_pictures", "motion"):
        monkeypatch.setattr(f"model.reports.{module}.drawn", lambda *_: "<svg></svg>")


def words(page: str) -> str:
    return re.sub(r"\s+", " ", re.sub(r"<svg.*?</svg>|<style.*?</style>|<[^>]+>", " ", page, flags=re.DOTALL))


def test_the_page_tells_the_whole_story_in_order(answer: tuple[Diagnosis, Comparison]) -> None:
    found, comparison = answer
    report = diagnosis_report(found, comparison)
    assert [s.title for s in report.sections] == [
        "Where they disagree", "What is missing", "What adding it did", "Measured, before and after", "What remains",
        "What to run next", "What to know about this answer",
    ]  # fmt: skip
    page = html(report)
    text = words(page)
    assert found.summary in text
    assert found.steps[0].reason[1:] in text
    assert "joint2.coulomb_friction.torque" in text
    assert "98.2 % of the variance beyond noise is gone" in text
    assert "6.4 standard deviations" in text
    # map, dependences, evidence, errors, two overlays, remaining torque
    assert page.count("<svg") == 7
    assert "<script" not in page


@pytest.mark.usefixtures("undrawn")
def test_errors_stand_beside_the_noise_and_say_how_much_is_gone(answer: tuple[Diagnosis, Comparison]) -> None:
    step = answer[0].steps[0]
    still = SignalError(joint=1, unit="rad", before=1.2e-3, after=1.1e-3, floor=1e-3)
    gone = SignalError(joint=2, unit="rad", before=10e-3, after=1.5e-3, floor=1e-3)
    told = answer[0].model_copy(update={"steps": (step.model_copy(update={"rmse_holdout": (still, gone)}),)})
    blocks = next(s for s in diagnosis_report(told).sections if s.title == "What adding it did").blocks
    table = next(b for b in blocks if isinstance(b, Table) and b.head[0] == "traces")
    by_joint = {(row[0].text, row[1].text): row[-1].text for row in table.rows}
    assert by_joint["held out", "2"] == "99 %"
    assert by_joint["held out", "1"] == "–"


@pytest.mark.usefixtures("undrawn")
def test_a_step_that_was_not_taken_says_why(answer: tuple[Diagnosis, Comparison]) -> None:
    found, _ = answer
    step = found.steps[0].model_copy(update={"adopted": False, "rejected_because": "the held-out error rises"})
    text = words(diagnosis_page(found.model_copy(update={"steps": (step,)})))
    assert "Not taken into the model: the held-out error rises." in text


@pytest.mark.usefixtures("undrawn")
def test_a_group_is_named_as_one_that_cannot_be_told_apart(answer: tuple[Diagnosis, Comparison]) -> None:
    found, _ = answer
    step = found.steps[0]
    grouped = step.model_copy(update={"effect": None, "group": step.candidates[:2]})
    text = words(diagnosis_page(found.model_copy(update={"verdict": "ambiguous", "steps": (grouped,)})))
    assert "These traces cannot tell apart: coulomb friction, joint 2, stiction, joint 2." in text
    assert "What adding it did" not in text


@pytest.mark.usefixtures("undrawn")
def test_an_answer_without_steps_has_a_page(answer: tuple[Diagnosis, Comparison]) -> None:
    found, _ = answer
    bare = found.model_copy(
        update={"verdict": "nothing-significant", "steps": (), "remaining": (), "next_experiment": None, "holdout": ()}
    )
    text = words(diagnosis_page(bare))
    assert "the model explains these traces within their noise" in text
    assert "none: nothing below was judged on other data" in text
    assert EFFECT not in text.split("model after")[0]


@pytest.mark.usefixtures("undrawn")
def test_several_steps_are_numbered(answer: tuple[Diagnosis, Comparison]) -> None:
    found, _ = answer
    titles = [s.title for s in diagnosis_report(found.model_copy(update={"steps": found.steps * 2})).sections]
    assert "Step 1: where they disagree" in titles
    assert "Step 2: what adding it did" in titles


@pytest.mark.usefixtures("undrawn")
def test_the_answer_survives_json(answer: tuple[Diagnosis, Comparison]) -> None:
    found, _ = answer
    again = Diagnosis.model_validate_json(found.model_dump_json())
    assert again.steps == found.steps
    assert again.model_after.identity == found.model_after.identity
    assert diagnosis_page(again) == diagnosis_page(found)


def test_a_torque_that_was_left_comes_back_in_its_size(answer: tuple[Diagnosis, Comparison]) -> None:
    found, _ = answer
    against = {(s.joint, s.against): s for s in found.remaining}
    back, forth = (against[2, "direction"].torque[k] for k in (0, 2))
    assert back == pytest.approx(8.0, rel=0.3)
    assert forth == pytest.approx(-8.0, rel=0.3)
