"""Whether an answer is as sharp as the records allow."""

import pytest

from model.discrepancy.diagnosis import Diagnosis, Step, Verdict
from model.trial.cases import as_csv
from model.trial.markdown import as_markdown
from model.trial.score import Score, score
from model.trial.sharpness import as_sharp, asks_for_rivals, named_rivals
from model.trial.table import trial_table
from model.trial.truth import Kind
from tests.model.trial.answers import MACHINE, answer, candidate, seen, step, truth


def judged(given: Diagnosis, kind: Kind = "single", d_prime: float = 20.0, **rivals: float) -> Score:
    """The score of an answer to a delay on joint 2, with d′ of rivals."""
    of = truth(kind, ("input_delay", (2,)), parameters={"delay": 0.01})
    return score(of, seen(of, d_prime), given, MACHINE).model_copy(update={"rivals": rivals})


def named(*steps: Step, verdict: Verdict = "named") -> Diagnosis:
    return answer(verdict, *steps)


def grouped(*names: str) -> Diagnosis:
    return answer("ambiguous", step(names[0], 2, group=names))


ALONE = named(step("input_delay", 2))
PAIR = grouped("input_delay", "motor_inductance")


def test_the_right_name_alone_is_always_right() -> None:
    assert as_sharp(judged(ALONE)) is True
    assert as_sharp(judged(ALONE, motor_inductance=0.1)) is True


def test_a_group_is_right_where_none_of_its_other_names_can_be_told() -> None:
    assert as_sharp(judged(PAIR, motor_inductance=4.99)) is True
    assert as_sharp(judged(PAIR, motor_inductance=5.0)) is False
    three = grouped("motor_inductance", "input_delay", "stiction")
    assert as_sharp(judged(three, motor_inductance=1.0, stiction=2.0)) is True
    assert as_sharp(judged(three, motor_inductance=1.0, stiction=9.0)) is False


def test_a_group_is_not_worked_out_until_d_prime_of_all_its_names_is_known_or_one_can_be_told() -> None:
    three = grouped("input_delay", "motor_inductance", "stiction")
    assert as_sharp(judged(PAIR)) is None
    assert as_sharp(judged(three, motor_inductance=1.0)) is None
    assert as_sharp(judged(three, motor_inductance=8.0)) is False


def test_a_wrong_name_alone_is_wrong_whatever_can_be_told() -> None:
    wrong = judged(named(step("motor_inductance", 2)), motor_inductance=1.0)
    assert asks_for_rivals(wrong)
    assert as_sharp(wrong) is False


@pytest.mark.parametrize(
    "given",
    [
        grouped("motor_inductance", "stiction"),
        answer("nothing-significant"),
        named(step("input_delay", 2), step("stiction", 1)),
        answer(
            "ambiguous",
            step("input_delay", 2, group=("input_delay", "stiction")),
            step("payload", group=("payload", "base_tilt")),
        ),
    ],
)
def test_an_answer_that_no_d_prime_can_make_right_is_wrong_and_asks_for_none(given: Diagnosis) -> None:
    found = judged(given)
    assert not asks_for_rivals(found)
    assert as_sharp(found) is False


def test_only_detectable_single_effects_are_asked_for() -> None:
    assert as_sharp(judged(PAIR, d_prime=2.0)) is None
    assert as_sharp(judged(PAIR, kind="wrong_priors")) is None
    assert not asks_for_rivals(judged(PAIR, kind="shared_by_joints"))
    assert asks_for_rivals(judged(PAIR, kind="later_single"))


def test_rivals_are_taken_with_the_joints_that_the_answer_names() -> None:
    found = step("input_delay", 2, group=("input_delay",)).model_copy(
        update={"group": (candidate("input_delay", 2), candidate("stiction", 2), candidate("stiction", 1, 3))}
    )
    given = answer("ambiguous", found, step("gear_loss", 1, adopted=False))
    assert named_rivals(judged(given), given) == (("stiction", (2,)), ("stiction", (1, 3)))


def test_the_table_has_a_row_and_every_case_its_d_prime() -> None:
    scores = [judged(ALONE), judged(PAIR), judged(PAIR, motor_inductance=3.0), judged(PAIR, motor_inductance=7.5)]
    page = as_markdown(trial_table(scores))
    assert "| as sharp as the record allows (1 not worked out) | 2/3 = 66.7 % (9.4–99.2) | ≥ 95 % |" in page
    head, *lines = (line.split(",") for line in as_csv(scores).splitlines())
    cells = [dict(zip(head, line, strict=True)) for line in lines]
    assert [cell["as_sharp"] for cell in cells] == ["yes", "", "yes", "no"]
    assert [cell["rivals"] for cell in cells] == ["", "", "motor_inductance 3.0", "motor_inductance 7.5"]
