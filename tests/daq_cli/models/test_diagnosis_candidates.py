"""Candidates in a terminal: what fits have shown, the named one always among them; what probes promise below it."""

from daq_cli.models.diagnosis_text import candidates_lines
from model.discrepancy.diagnosis import Candidate, Step
from tests.model.discrepancy import steps


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


def test_what_an_earlier_step_has_fitted_and_refused_is_no_promise() -> None:
    earlier = step("ripple", fitted("ripple", 90.0))
    now = step("backlash", fitted("backlash", 50.0), probed("ripple", 9000.0))
    assert not any("ripple" in line for line in candidates_lines(now, [earlier]))
    assert any("ripple" in line for line in candidates_lines(now))


def test_a_probe_that_promises_nothing_is_only_counted() -> None:
    lines = candidates_lines(step("backlash", fitted("backlash", 50.0), probed("ripple", -2.0)))
    assert lines[2:] == ["            and 1 more"]


def test_where_nothing_was_tried_nothing_is_listed() -> None:
    assert candidates_lines(step("lost_set_points")) == []
