"""Which arms a trial takes, what a registration pins down, and the table of rates."""

from pathlib import Path

import pytest

from daq.contracts.errors import SpecError
from mock_controller.hidden.arm import Kind, Load, compose_seed, draw_arm
from model.discrepancy.diagnosis import Diagnosis
from model.trial.score import Score, score
from model.trial.truth import Truth
from tests.model.trial.answers import MACHINE, answer, seen, step, truth
from trials.blind.registration import (
    KINDS,
    LOADS,
    arms,
    compose,
    drawn_arms,
    parse_choice,
    parse_numbers,
    parse_registration,
    sample_arms,
)
from trials.blind.table import TrialTable, as_csv, as_markdown, quantiles, rate, trial_table

TEXT = """
version = 1
title = "A trial"
detectable = 5.0

[runs.diagnostic]
cases = { single = 4, clean = 3 }

[runs.ramp]
experiment = "ramp"
cases = { single = 2 }

[hashes]
"model" = "abc"

[versions]
numpy = "2.1"
"""
KEPT = Path(__file__).parents[3] / "docs" / "trial"


def test_seeds_are_the_mock_s_and_arms_a_range_or_a_list_with_loads_in_turn() -> None:
    kinds = {"shared": Kind.SHARED_BY_JOINTS, "open-set": Kind.OPEN_SET, "wrong-priors": Kind.WRONG_PRIORS}
    kinds["later"] = Kind.LATER_SINGLE
    for kind in KINDS:
        for load in LOADS:
            ours = compose(77, kind, load)
            assert ours == compose_seed(77, kinds.get(kind) or Kind[kind.upper()], Load[load.upper()])
    assert parse_numbers("3:6") == [3, 4, 5, 6]
    assert parse_numbers("1,5") == [1, 5]
    for wrong in ("", "a", "5:3", "-1", "1:2:3"):
        with pytest.raises(SpecError, match="FIRST:LAST"):
            parse_numbers(wrong)
    with pytest.raises(SpecError, match=r"kind 'all': allowed are clean, single"):
        parse_choice("clean,all", KINDS, "kind")
    assert arms([1, 3, 4], ["single"]) == [120, 321, 422]
    assert arms([1], ["single", "clean"], ["heavy"]) == [122, 112]


def test_some_seeds_are_of_all_kinds_and_drawn_from_each_commit_anew() -> None:
    seeds = [compose(number, kind, "nominal") for kind in KINDS for number in range(20)]
    some = sample_arms(seeds, 30)
    assert len(some) == 30
    assert some == sample_arms(seeds[::-1], 30)
    assert some[:10] == sample_arms(seeds, 10)
    assert {seed // 10 % 10 for seed in some} == set(KINDS.values())
    assert sample_arms(seeds[:2], 5) == sample_arms(seeds[:2], 2)
    cases = {"single": 50, "clean": 30}
    first, again, other = drawn_arms("c0ffee", cases), drawn_arms("c0ffee", cases), drawn_arms("decaf", cases)
    assert first == again
    assert not set(first) & set(other)
    assert len(set(first)) == 80
    assert min(first) >= 10**8
    assert [draw_arm(seed).kind for seed in first] == [Kind.SINGLE] * 50 + [Kind.CLEAN] * 30
    assert {draw_arm(seed).load for seed in first} == set(Load)


def test_a_registration_draws_each_run_and_a_larger_one_keeps_the_arms_of_a_smaller() -> None:
    registration = parse_registration(TEXT, "here")
    assert len(registration.arms("diagnostic", "c0ffee")) == 7
    assert registration.run("ramp").experiment == "ramp"
    assert registration.arms("ramp", "c0ffee") == registration.arms("diagnostic", "c0ffee")[:2]
    with pytest.raises(SpecError, match="run 'x': the registration has diagnostic, ramp"):
        registration.run("x")
    assert drawn_arms("c0ffee", {"pair": 5})[:3] == drawn_arms("c0ffee", {"pair": 3})


def test_all_that_decides_the_outcome_has_to_be_registered() -> None:
    registration = parse_registration(TEXT, "here")
    registration.check_code({"model": "abc"}, {"numpy": "2.1"}, "here")
    with pytest.raises(SpecError, match=r"^model: not as registered"):
        registration.check_code({"model": "abd"}, {"numpy": "2.1"}, "here")
    with pytest.raises(SpecError, match=r"^numpy: not as registered"):
        registration.check_code({"model": "abc"}, {"numpy": "2.2"}, "here")
    registration = parse_registration(TEXT, "here")
    with pytest.raises(SpecError, match=r"registration here: lacks scipy, which determine the outcome; .*--hashes"):
        registration.check_code({"model": "abc"}, {"numpy": "2.1", "scipy": "1.1"}, "here")
    every = {"model": "abc", **dict.fromkeys(("a", "b", "c", "d"), "")}
    with pytest.raises(SpecError, match=r"lacks a, b, c and 1 more, which") as error:
        registration.check_code(every, {"numpy": "2.1"}, "here")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("file", sorted(KEPT.glob("registration*.toml")), ids=lambda file: file.stem)
def test_registrations_that_were_made_stay_readable(file: Path) -> None:
    registration = parse_registration(file.read_text("utf-8"), str(file))
    assert len(registration.hashes) >= 20
    assert registration.arms("diagnostic", "c0ffee")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("5.0", "4.0", "detectable: 4.0: the scoring uses d′ ≥ 5"),
        ("clean = 3", "dirty = 3", "kind 'dirty'"),
        ("single = 4", "single = 0", "greater than or equal to 1"),
        ('"ramp"\n', '"walk"\n', "runs.ramp.experiment"),
        ("title", "titel", "title: Field required"),
        ("[hashes]", "[hashes", "not TOML"),
        ("detectable", 'loads = ["none"]\ndetectable', "loads: 'none': allowed are nominal"),
    ],
)
def test_wrong_registrations_are_refused_in_one_line(old: str, new: str, says: str) -> None:
    with pytest.raises(SpecError, match=r"^here: ") as error:
        parse_registration(TEXT.replace(old, new), "here")
    assert says in str(error.value)
    assert "\n" not in str(error.value)


# ---- Rates with intervals, and the table made of them


def judged(of: Truth, given: Diagnosis, d_prime: float = 20.0) -> Score:
    return score(of, seen(of, d_prime), given, MACHINE)


def test_rates_have_the_intervals_of_clopper_and_pearson() -> None:
    found = rate([True] * 8 + [False] * 2)
    assert (found.hits, found.cases, found.share) == (8, 10, 0.8)
    assert found.low == pytest.approx(0.4439045, abs=1e-6)
    assert found.high == pytest.approx(0.9747893, abs=1e-6)
    found = rate([False] * 300)
    assert (found.low, found.high) == (0.0, pytest.approx(0.01222, abs=1e-4))
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


def test_rates_are_of_detectable_cases_and_the_confusion_says_what_was_taken_for_what(table: TrialTable) -> None:
    lines = {line.what: line.rate for line in table.lines}
    assert (lines["named right, strict"].hits, lines["named right, strict"].cases) == (1, 3)
    assert lines["friction kinds merged"].hits == 2
    assert lines["named right, or in the group that was given"].hits == 2
    assert lines["right name among the first three"].hits == 3
    assert (lines["false alarm on clean arms"].hits, lines["false alarm on clean arms"].cases) == (0, 1)
    assert lines["the same inside the friction family"].cases == 1
    assert table.excess_removed.median == pytest.approx(1.0)
    assert table.not_acquired == 1
    assert table.confusion == {
        "input_delay": {"group with it of 2": 1},
        "stiction": {"stiction": 1, "coulomb_friction": 1},
    }
    by_name = {line.effect: line for line in table.by_effect}
    assert (by_name["stiction"].cases, by_name["stiction"].detectable) == (3, 2)
    assert by_name["stiction"].answers == {"coulomb_friction": 1}


def test_every_case_can_be_counted_again_and_every_rate_has_its_interval(table: TrialTable) -> None:
    pair = truth("pair", ("dead_zone", (1,)), ("payload", ()), parameters={"width": 0.5, "mass": 1.0})
    group = answer("ambiguous", step("dead_zone", 1, group=("dead_zone", "backlash")))
    head, *lines = as_csv([judged(pair, group), judged(truth("clean"), answer("nothing-significant"))]).splitlines()
    cells = dict(zip(head.split(","), lines[0].split(","), strict=True))
    assert (cells["hidden"], cells["joints"], cells["d_prime"]) == ("dead_zone + payload", "1 + -", "20.0 + 20.0")
    assert (cells["answered"], cells["named_right"], cells["alarm"]) == ("dead_zone | backlash", "no", "")
    assert dict(zip(head.split(","), lines[1].split(","), strict=True))["alarm"] == "no"
    page = as_markdown(table)
    assert "| named right, strict | 1/3 = 33.3 % (0.8–90.6) | ≥ 92 % |" in page
    assert "| stiction | 3 | 2 | 1/2 | 2/2 | 2/2 | coulomb_friction 1 |" in page
    assert "| tight_spot | 1 | 1 | 1/1 |" in page
    for line in page.splitlines():
        if line.startswith("|"):
            assert line.count("|") in (4, 7, 8)
    assert as_markdown(trial_table([])) == "No case has been scored yet.\n"
