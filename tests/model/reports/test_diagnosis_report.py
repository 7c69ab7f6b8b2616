"""The page of a diagnosis tells the whole story, for every verdict, from the answer alone."""

import re
from dataclasses import replace

import pytest

from daq.contracts.machine import NoController
from model.blocks import Picture, Points, Report, Table, Text
from model.comparison.compare import Comparison
from model.discrepancy.diagnosis import Acquired, Diagnosis, Inseparable, PlacedEffect
from model.discrepancy.grounds import ControllerProof, Note
from model.reports.diagnosis_report import diagnosis_page, diagnosis_report
from model.reports.diagnosis_words import TORQUES, compared, gap
from model.reports.page import html
from tests.model.discrepancy.answers import EFFECT, an_answer


@pytest.fixture(scope="module")
def answer() -> tuple[Diagnosis, Comparison]:
    return an_answer(12.0)


@pytest.fixture
def found(answer: tuple[Diagnosis, Comparison]) -> Diagnosis:
    return answer[0]


@pytest.fixture(autouse=True)
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures cost seconds; what the words say does not need them."""
    for module in ("diagnosis_map", "diagnosis_pictures", "gap", "motion", "motion_closer"):
        monkeypatch.setattr(f"model.reports.{module}.drawn", lambda *_: "<svg></svg>")


def words(page: str) -> str:
    return re.sub(r"\s+", " ", re.sub(r"<svg.*?</svg>|<style.*?</style>|<[^>]+>", " ", page, flags=re.DOTALL))


def test_the_page_tells_it_all_in_order(answer: tuple[Diagnosis, Comparison], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()  # with its figures
    found, comparison = answer
    report = diagnosis_report(found, comparison)
    assert [s.title for s in report.sections] == [
        "How the gap shrinks",
        "Where they disagree",
        "What is missing",
        "What adding it did",
        "Measured, before and after",
        "What remains",
        "What to run next",
        "What to know about this answer",
    ]
    page = html(report)
    text = words(page)
    assert found.summary in text
    assert found.steps[0].reason in text
    assert "joint2.coulomb_friction.torque" in text
    assert "98.2 % of the held-out variance beyond noise is gone" in text
    assert "6.4 standard deviations" in text
    # gap, map, dependences, evidence, two overlays and a closer look at each, remaining torque
    assert page.count("<svg") == 9
    assert "<script" not in page


def test_the_gap_of_the_closed_loop_comes_first(found: Diagnosis) -> None:
    report = diagnosis_report(found)
    assert report.sections[0].title == "How the gap shrinks"
    table = next(b for b in report.sections[0].blocks if isinstance(b, Table))
    assert table.head == (
        "traces",
        "joint",
        "model as given",
        "+ Coulomb friction, joint 2",
        "everything refitted",
        "noise",
    )
    assert [(row[0].text, row[1].text) for row in table.rows[2:4]] == [("fitted to", "2"), ("held out", "2")]


def test_the_page_says_which_method_was_used_and_denies_no_simulation_that_it_shows(
    answer: tuple[Diagnosis, Comparison],
) -> None:
    found, comparison = answer
    assert ("method", "simulation of the closed loop (output error)") in diagnosis_report(found).facts
    torques = found.model_copy(update={"method": "inverse-dynamics"})
    report = diagnosis_report(torques, comparison)
    assert ("method", "balance of torques along the recorded motion (inverse dynamics)") in report.facts
    said = words(html(report))
    assert "They were made for this page: the answer rests on the balance of torques alone." in said
    assert "othing is simulated" not in said
    assert "othing was simulated" not in said
    assert "They were made for this page" not in words(html(diagnosis_report(found, comparison)))
    assert "There is no overlay, since the loop was not simulated" in words(html(diagnosis_report(torques)))


def test_the_page_calls_traces_by_their_files_where_these_are_known(answer: tuple[Diagnosis, Comparison]) -> None:
    found, comparison = answer
    (fitted,), (held,) = found.traces, found.holdout
    report = diagnosis_report(found, comparison, {fitted: "bench_1.csv"})
    assert ("fitted to", "bench_1.csv") in report.facts
    assert ("held out", held) in report.facts
    said = words(html(report))
    assert "bench_1.csv (fitted to). Above: measured" in said
    assert "bench_1.csv, joint 2" in said


def test_a_group_cannot_be_told_apart_and_a_step_that_was_not_taken_says_why(found: Diagnosis) -> None:
    step = found.steps[0]
    grouped = step.model_copy(update={"effect": None, "group": step.candidates[:2]})
    text = words(diagnosis_page(found.model_copy(update={"verdict": "ambiguous", "steps": (grouped,)})))
    assert "These traces cannot tell apart: Coulomb friction, joint 2; stiction, joint 2." in text
    assert "What adding it did" not in text
    step = found.steps[0].model_copy(update={"adopted": False, "rejected_because": "the held-out error rises"})
    report = diagnosis_report(found.model_copy(update={"verdict": "unknown-effect", "steps": (step,)}))
    text = words(html(report))
    assert "Not taken into the model: the held-out error rises." in text
    assert "What adding it would have done" in [s.title for s in report.sections]
    assert "Not in the model: what the fit with this effect came to." in text
    assert "Σλ²" not in text


def test_that_nothing_is_significant_is_proved(answer: tuple[Diagnosis, Comparison]) -> None:
    found, comparison = answer
    step = found.steps[0]
    best = step.candidates[0].model_copy(update={"evidence": 3.0})
    sound = found.model_copy(
        update={
            "verdict": "nothing-significant",
            "steps": (),
            "remaining": (),
            "where": step.where,
            "significant": 10.0,
            "candidates": (best, *step.candidates[3:]),
            "rmse_fit": step.rmse_fit,
            "rmse_holdout": step.rmse_holdout,
        }
    )
    report = diagnosis_report(sound, comparison)
    titles = [s.title for s in report.sections]
    assert titles[:4] == ["How the gap shrinks", "Where they disagree", "What was tried", "Measured, before and after"]
    assert all(any(isinstance(b, Picture) for b in s.blocks) for s in report.sections[:4])
    text = words(html(report))
    assert (
        "The best of 5 candidates, Coulomb friction on joint 2, has evidence of 3; an effect is named from 10." in text
    )
    assert "and no effect was added" in text
    assert "tables above" not in text


def test_a_map_of_what_is_left_is_shown_once_and_a_shape_only_where_it_is_clear(found: Diagnosis) -> None:
    left = found.steps[0].where.model_copy(update={"joint": None, "phase": None, "summary": "No joint is off."})
    report = diagnosis_report(found.model_copy(update={"where": left, "remaining": ()}))
    blocks = next(s for s in report.sections if s.title == "What remains").blocks
    assert blocks[1] == Text("No joint is off.", "good")
    assert isinstance(blocks[2], Picture)
    assert "What was tried" not in [s.title for s in report.sections]
    step = found.steps[0].model_copy(update={"adopted": False})
    page = words(diagnosis_page(found.model_copy(update={"steps": (step, step), "verdict": "unknown-effect"})))
    assert page.count("in windows of 0.3 s") == 1
    assert "As before step 1: nothing was added in between." in page


def test_what_was_refused_is_no_promise_of_a_later_step(found: Diagnosis, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[list[tuple[str, bool]]] = []

    def picture(candidates: object, *_: object) -> Picture:
        shown.append([(c.effect, c.refitted) for c in candidates])  # type: ignore[attr-defined]
        return Picture("<svg></svg>", "")

    monkeypatch.setattr("model.reports.diagnosis_steps.evidence_picture", picture)
    step = found.steps[0]
    refused = step.model_copy(update={"adopted": False})
    again = step.candidates[0].model_copy(update={"refitted": False})
    later = step.model_copy(update={"effect": "stiction", "candidates": (again, *step.candidates[1:])})
    diagnosis_report(found.model_copy(update={"steps": (refused, later)}))
    assert shown[1] == shown[0][1:]


def test_what_the_controllers_numbers_prove_has_no_candidates_and_no_errors(found: Diagnosis) -> None:
    step = found.steps[0]
    zero = tuple(e.model_copy(update={"before": 0.0, "after": 0.0}) for e in step.rmse_fit)
    proof = step.candidates[0].model_copy(update={"refitted": False, "misfit": None})
    shown = step.model_copy(
        update={
            "rmse_fit": zero,
            "rmse_holdout": (),
            "candidates": (proof,),
            "proof": ControllerProof(samples=40, of=50),
        }
    )
    text = words(diagnosis_page(found.model_copy(update={"steps": (shown,)})))
    assert "the recorded numbers of the controller prove it, and nothing was fitted for it." in text
    assert "probe" not in text
    assert "noise floor" not in text


def test_experiments_are_listed_and_promise_no_separation_that_they_lack(found: Diagnosis) -> None:
    run = Acquired(experiment="ramp", trace="abc", file="f", outcome="stopped", duration=8.25, reason="tells most")
    report = diagnosis_report(found.model_copy(update={"acquired": (run,)}))
    table = next(s for s in report.sections if s.title == "What was run").blocks[0]
    assert isinstance(table, Table)
    assert [c.text for c in table.rows[0]] == ["ramp", "8.2 s", "stopped", "abc", "tells most"]
    assert found.next_experiment is not None
    asked = found.next_experiment.model_copy(update={"separates": (), "predicted_separation": 0.0})
    text = words(diagnosis_page(found.model_copy(update={"next_experiment": asked})))
    assert "12.0 s" in text
    assert "would tell apart" not in text
    assert "predicted separation" not in text


def test_where_no_motion_would_tell_the_page_says_what_would(found: Diagnosis) -> None:
    members = tuple(PlacedEffect(effect=e, joints=(2,)) for e in ("viscous_friction", "weakened_magnet"))
    untold = Inseparable(
        members=members,
        separation=1.2,
        needed=3.0,
        experiment="sweep",
        tried=110,
        shares="torque-with-speed",
        told_by=("current-clamp",),
    )
    report = diagnosis_report(found.model_copy(update={"next_experiment": None, "inseparable": (untold,)}))
    (text,) = next(s for s in report.sections if s.title == "What to run next").blocks
    assert isinstance(text, Text)
    assert text.text.endswith("What would tell them: a current clamp on the motor's lead.")


def test_a_page_about_torques_does_not_speak_of_a_simulation(found: Diagnosis) -> None:
    step = found.steps[0]
    errors = tuple(e.model_copy(update={"unit": "N·m"}) for e in step.rmse_fit)
    balanced = step.model_copy(update={"rmse_fit": errors, "rmse_holdout": ()})
    assert found.gap is not None
    gap = found.gap.model_copy(update={"measure": "torques"})
    torques = found.model_copy(update={"steps": (balanced,), "method": "inverse-dynamics", "gap": gap})
    assert compared(torques) is TORQUES
    report: Report = diagnosis_report(torques)
    text = words(html(report))
    assert "measured − simulated" not in text
    assert "torque that the model needs − torque that was applied" in text
    assert "There is no overlay" in text


@pytest.mark.parametrize(
    ("verdict", "method", "controlled", "says"),
    [
        ("nothing-significant", "inverse-dynamics", True, "Nothing is left to tell apart."),
        ("named", "inverse-dynamics", True, "No further experiment is asked for."),
        ("ambiguous", "output-error", True, "No further experiment is asked for."),
        ("ambiguous", "inverse-dynamics", True, "`daq diagnose --next FILE` simulates"),
        ("suspected", "inverse-dynamics", True, "`daq diagnose --next FILE` simulates"),
        ("unknown-effect", "inverse-dynamics", True, "`daq diagnose --next FILE` simulates"),
        ("unknown-effect", "inverse-dynamics", False, "no experiment is proposed, though one may be needed."),
    ],
)
def test_no_experiment_has_a_reason(found: Diagnosis, verdict: str, method: str, controlled: bool, says: str) -> None:
    before = found.model_before
    if not controlled:
        machine = before.machine.model_copy(update={"controller": NoController(kind="none")})
        before = before.model_copy(update={"machine": machine})
    change = {"verdict": verdict, "method": method, "next_experiment": None, "model_before": before}
    report = diagnosis_report(found.model_copy(update=change))
    (text,) = next(s for s in report.sections if s.title == "What to run next").blocks
    assert isinstance(text, Text)
    assert says in text.text
    assert ("--next" in text.text) == ("--next" in says)


def test_what_has_no_clear_shape_is_not_told_as_one(found: Diagnosis) -> None:
    shape = found.remaining[0]
    few = shape.model_copy(
        update={"against": "time", "centres": (1.0, 2.0), "torque": (0.1, 0.2), "deviation": (0.1, 0.1)}
    )
    weak = shape.model_copy(update={"explained": 0.08})
    short = few.model_copy(update={"explained": 0.64})
    for one, said in ((weak, "explains only 8 % of what is left."), (short, "rests on 2 of the 5 bins that a shape")):
        text = words(diagnosis_page(found.model_copy(update={"remaining": (one,)})))
        assert "No clear shape" in text
        assert said in text
        assert "--effect-file" not in text
    nothing = found.model_copy(update={"verdict": "unknown-effect", "remaining": ()})
    assert "What is left has no shape that these traces show" in words(diagnosis_page(nothing))


def test_an_answer_survives_json_and_one_without_steps_has_a_page(found: Diagnosis) -> None:
    again = Diagnosis.model_validate_json(found.model_dump_json())
    assert again.steps == found.steps
    assert again.model_after.identity == found.model_after.identity
    assert diagnosis_page(again) == diagnosis_page(found)
    bare = found.model_copy(
        update={"verdict": "nothing-significant", "steps": (), "remaining": (), "next_experiment": None, "holdout": ()}
    )
    text = words(diagnosis_page(bare))
    assert text.split()[:3] == ["The", "model", "explains"]
    assert "none: nothing below was judged on other data" in text
    assert EFFECT not in text.split("model after")[0]


def test_warnings_come_first_once_and_steps_are_numbered(found: Diagnosis) -> None:
    notes = (Note(kind="cutoff", values={"cutoff": 12.0}), Note(kind="resting-left-out", warning=True))
    doubted = found.model_copy(update={"notes_data": notes, "notes": ("Below 12 Hz.", "Rest is left out.")})
    sections = {s.title: s.blocks for s in diagnosis_report(doubted).sections}
    assert next(iter(sections)) == "Warnings"
    assert sections["Warnings"] == (Text("Rest is left out.", "warning"),)
    assert sections["What to know about this answer"] == (Points(("Below 12 Hz.",)),)
    titles = [s.title for s in diagnosis_report(found.model_copy(update={"steps": found.steps * 2})).sections]
    assert "Step 1: where they disagree" in titles
    assert "Step 2: what adding it did" in titles
    step = found.steps[0].model_copy(update={"excess_removed_holdout": 1.002})
    assert gap(step).endswith("all of the held-out variance beyond noise is gone.")


def test_efforts_are_recorded_and_predicted(answer: tuple[Diagnosis, Comparison]) -> None:
    found, comparison = answer
    efforts = [replace(s, signal="effort", units=("N·m",) * len(s.units), set_point=None) for s in comparison.signals]
    report = diagnosis_report(found, efforts=efforts)
    (section,) = (s for s in report.sections if s.title == "Recorded and predicted torque")
    captions = [block.caption for block in section.blocks if isinstance(block, Picture)]
    assert any("Above: recorded and predicted torque. Below: recorded − predicted" in caption for caption in captions)
    assert not any("set point" in caption or "simulated" in caption for caption in captions)
