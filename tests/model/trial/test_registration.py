"""Which arms a trial takes, and what a registration pins down."""

from pathlib import Path

import pytest

from daq.contracts.errors import SpecError
from mock_controller.hidden.arm import Kind, Load, compose_seed, draw_arm
from model.trial.arms import KINDS, LOADS, arms, compose, drawn_arms, parse_choice, parse_numbers, sample_arms
from model.trial.registration import parse_registration

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


def test_seeds_are_the_mock_s() -> None:
    kinds = {"shared": Kind.SHARED_BY_JOINTS, "open-set": Kind.OPEN_SET, "wrong-priors": Kind.WRONG_PRIORS}
    kinds["later"] = Kind.LATER_SINGLE
    for kind in KINDS:
        for load in LOADS:
            ours = compose(77, kind, load)
            assert ours == compose_seed(77, kinds.get(kind) or Kind[kind.upper()], Load[load.upper()])


def test_arms_are_named_by_a_range_or_a_list_of_numbers() -> None:
    assert parse_numbers("3:6") == [3, 4, 5, 6]
    assert parse_numbers("1,5") == [1, 5]
    for wrong in ("", "a", "5:3", "-1", "1:2:3"):
        with pytest.raises(SpecError, match="FIRST:LAST"):
            parse_numbers(wrong)
    with pytest.raises(SpecError, match=r"kind 'all': allowed are clean, single"):
        parse_choice("clean,all", KINDS, "kind")


def test_arms_carry_the_loads_in_turn() -> None:
    assert arms([1, 3, 4], ["single"]) == [120, 321, 422]
    assert arms([1], ["single", "clean"], ["heavy"]) == [122, 112]


def test_some_of_the_seeds_are_of_all_kinds_and_the_same_each_time() -> None:
    seeds = [compose(number, kind, "nominal") for kind in KINDS for number in range(20)]
    some = sample_arms(seeds, 30)
    assert len(some) == 30
    assert some == sample_arms(seeds[::-1], 30)
    assert some[:10] == sample_arms(seeds, 10)
    assert {seed // 10 % 10 for seed in some} == set(KINDS.values())
    assert sample_arms(seeds[:2], 5) == sample_arms(seeds[:2], 2)


def test_seeds_drawn_from_a_commit_are_new_with_each_commit_and_far_from_those_for_tuning() -> None:
    cases = {"single": 50, "clean": 30}
    first, again, other = drawn_arms("c0ffee", cases), drawn_arms("c0ffee", cases), drawn_arms("decaf", cases)
    assert first == again
    assert not set(first) & set(other)
    assert len(set(first)) == 80
    assert min(first) >= 10**8
    assert [draw_arm(seed).kind for seed in first] == [Kind.SINGLE] * 50 + [Kind.CLEAN] * 30
    assert {draw_arm(seed).load for seed in first} == set(Load)


def test_a_larger_registration_keeps_the_arms_of_a_smaller_one() -> None:
    assert drawn_arms("c0ffee", {"pair": 5})[:3] == drawn_arms("c0ffee", {"pair": 3})


def test_a_registration_draws_each_run() -> None:
    registration = parse_registration(TEXT, "here")
    assert len(registration.arms("diagnostic", "c0ffee")) == 7
    assert registration.run("ramp").experiment == "ramp"
    assert registration.arms("ramp", "c0ffee") == registration.arms("diagnostic", "c0ffee")[:2]
    with pytest.raises(SpecError, match="run 'x': the registration has diagnostic, ramp"):
        registration.run("x")


def test_other_code_or_another_library_needs_another_registration() -> None:
    registration = parse_registration(TEXT, "here")
    registration.check_code({"model": "abc"}, {"numpy": "2.1"}, "here")
    with pytest.raises(SpecError, match=r"^model: not as registered"):
        registration.check_code({"model": "abd"}, {"numpy": "2.1"}, "here")
    with pytest.raises(SpecError, match=r"^numpy: not as registered"):
        registration.check_code({"model": "abc"}, {"numpy": "2.2"}, "here")


def test_what_decides_the_outcome_has_to_be_registered_all_of_it() -> None:
    registration = parse_registration(TEXT, "here")
    with pytest.raises(SpecError, match=r"registration here: lacks scipy, which decide the outcome; .*--hashes"):
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
        ("5.0", "4.0", "detectable: 4.0: the scoring takes d′ ≥ 5"),
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
