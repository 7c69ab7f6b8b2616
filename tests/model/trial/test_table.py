"""Rates with intervals, and the table made of them."""

import pytest

from model.discrepancy.diagnosis import Diagnosis
from model.trial.cases import as_csv
from model.trial.markdown import as_markdown
from model.trial.rates import rate
from model.trial.score import Score, score
from model.trial.table import TrialTable, quantiles, trial_table
from model.trial.truth import Truth
from tests.model.trial.answers import MACHINE, answer, seen, step, truth


def judged(of: Truth, given: Diagnosis, d_prime: float = 20.0) -> Score:
    return score(of, seen(of, d_prime), given, MACHINE)


def test_the_interval_of_a_rate_is_clopper_and_pearson_s() -> None:
    found = rate([True] * 8 + [False] * 2)
    assert (found.hits, found.cases, found.share) == (8, 10, 0.8)
    assert found.low == pytest.approx(0.4439045, abs=1e-6)
    assert found.high == pytest.approx(0.9747893, abs=1e-6)


def test_three_hundred_clean_cases_without_an_alarm_bound_it_at_one_and_a_quarter_per_cent() -> None:
    found = rate([False] * 300)
    assert (found.low, found.high) == (0.0, pytest.approx(0.01222, abs=1e-4))


def test_quantiles_ignore_missing_values() -> None:
    found = quantiles([None, *map(float, range(101))])
    assert (found.cases, found.tenth, found.median, found.ninety_fifth, found.largest) == (101, 10, 50, 95, 100)


@pytest.fixture
def table() -> TrialTable:
    stiction, delay = truth("single", ("stiction", (1,))), truth("single", ("input_delay", (2,)))
    strange = truth("open_set", ("tight_spot", (1,)), known=False)
    return trial_table(
        [
            judged(stiction, answer("named", step("stiction", 1, ranked=("stiction",), holdout=(3.0, 1.0)))),
            judged(stiction, answer("named", step("coulomb_friction", 1, ranked=("coulomb_friction", "stiction")))),
            judged(stiction, answer("nothing-significant"), d_prime=2.0),
            judged(delay, answer("ambiguous", step("input_delay", 2, group=("input_delay", "motor_inductance")))),
            judged(truth("clean"), answer("nothing-significant")),
            judged(strange, answer("unknown-effect")),
        ],
        not_acquired=1,
    )


def test_rates_are_of_detectable_cases(table: TrialTable) -> None:
    lines = {line.what: line.rate for line in table.lines}
    assert (lines["named right, strict"].hits, lines["named right, strict"].cases) == (1, 3)
    assert lines["friction kinds merged"].hits == 2
    assert lines["named right, or in the group that was given"].hits == 2
    assert lines["right name among the first three"].hits == 3
    assert (lines["false alarm on clean arms"].hits, lines["false alarm on clean arms"].cases) == (0, 1)
    assert lines["the same inside the friction family"].cases == 1
    assert table.excess_removed.median == pytest.approx(1.0)
    assert table.not_acquired == 1


def test_the_confusion_says_what_was_taken_for_what(table: TrialTable) -> None:
    assert table.confusion == {
        "input_delay": {"group with it of 2": 1},
        "stiction": {"stiction": 1, "coulomb_friction": 1},
    }
    by_name = {line.effect: line for line in table.by_effect}
    assert (by_name["stiction"].cases, by_name["stiction"].detectable) == (3, 2)
    assert by_name["stiction"].answers == {"coulomb_friction": 1}


def test_the_page_shows_every_rate_with_its_interval(table: TrialTable) -> None:
    page = as_markdown(table)
    assert "| named right, strict | 1/3 = 33.3 % (0.8–90.6) | ≥ 92 % |" in page
    assert "| stiction | 3 | 2 | 1/2 | 2/2 | 2/2 | coulomb_friction 1 |" in page
    assert "| tight_spot | 1 | 1 | 1/1 |" in page
    for line in page.splitlines():
        if line.startswith("|"):
            assert line.count("|") in (4, 7, 8)


def test_a_table_without_cases_says_that_none_was_scored() -> None:
    assert as_markdown(trial_table([])) == "No case has been scored yet.\n"


def test_every_case_is_a_line_that_can_be_counted_again() -> None:
    pair = truth("pair", ("dead_zone", (1,)), ("payload", ()), parameters={"width": 0.5, "mass": 1.0})
    group = answer("ambiguous", step("dead_zone", 1, group=("dead_zone", "backlash")))
    head, *lines = as_csv([judged(pair, group), judged(truth("clean"), answer("nothing-significant"))]).splitlines()
    cells = dict(zip(head.split(","), lines[0].split(","), strict=True))
    assert (cells["hidden"], cells["joints"], cells["d_prime"]) == ("dead_zone + payload", "1 + -", "20.0 + 20.0")
    assert (cells["answered"], cells["named_right"], cells["alarm"]) == ("dead_zone | backlash", "no", "")
    assert dict(zip(head.split(","), lines[1].split(","), strict=True))["alarm"] == "no"
