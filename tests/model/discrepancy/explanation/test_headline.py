"""The headline of an answer names what was found."""

import pytest

from model.discrepancy.diagnosis import Diagnosis, Inseparable, PlacedEffect, SignalError, Suspicion
from model.discrepancy.explanation.answer_words import headline, summary
from model.discrepancy.grounds import Note, Refusal
from tests.model.discrepancy.answers import an_answer


@pytest.fixture(scope="module")
def answer() -> Diagnosis:
    return an_answer(12.0)[0]


def test_it_names_effect_joint_and_size(answer: Diagnosis) -> None:
    assert headline(answer) == "Coulomb friction on joint 2, 8 N·m (7.8 to 8.2)"


def test_it_says_that_a_name_is_a_part_of_the_answer(answer: Diagnosis) -> None:
    part = answer.model_copy(update={"verdict": "partly"})
    assert headline(part) == "Coulomb friction on joint 2, 8 N·m (7.8 to 8.2); and more is missing than was named"
    assert summary(part).endswith("Something is left that these effects do not explain.")


def test_of_a_group_it_names_the_first_and_counts_the_others(answer: Diagnosis) -> None:
    (step,) = answer.steps
    grouped = step.model_copy(update={"effect": None, "group": step.candidates[:5]})
    undecided = answer.model_copy(update={"verdict": "ambiguous", "steps": (grouped,)})
    several = "one of: Coulomb friction on joint 2 or stiction on joint 2 or Stribeck friction on joint 2 or 2 more"
    assert headline(undecided) == several
    both = undecided.model_copy(update={"steps": (grouped, step)})
    assert headline(both) == f"{several}; Coulomb friction on joint 2, 8 N·m (7.8 to 8.2)"


def test_a_group_that_no_motion_tells_apart_is_named_as_its_class(answer: Diagnosis) -> None:
    (step,) = answer.steps
    grouped = step.model_copy(update={"effect": None, "group": step.candidates[:2]})
    undecided = answer.model_copy(update={"verdict": "ambiguous", "steps": (grouped,)})
    members = tuple(PlacedEffect(effect=c.effect, joints=c.joints) for c in step.candidates[:3])
    untold = Inseparable(
        members=members, separation=2.0, needed=3.0, experiment="sweep", tried=110, shares="torque-against-motion"
    )
    named = undecided.model_copy(update={"inseparable": (untold,)})
    assert headline(named) == (
        "a torque against the motion on joint 2: Coulomb friction or stiction or Stribeck friction"
    )
    assert "a torque against the motion, which no motion that was tried tells apart" in summary(named)
    for other in (untold.model_copy(update={"shares": None}), untold.model_copy(update={"members": members[1:]})):
        left = undecided.model_copy(update={"inseparable": (other,)})
        assert headline(left) == "one of: Coulomb friction on joint 2 or stiction on joint 2"
        assert "no motion" not in summary(left)


NOTHING = {"verdict": "nothing-significant"}
TAKEN_BACK = {"adopted": False, "refusal": Refusal(kind="only-resembles", joints=(2,))}
DOUBT = Suspicion(effect="backlash", joints=(1,), evidence=24.0, needed=30.0, seconds=20.0)


@pytest.mark.parametrize(
    ("fields", "of_step", "said"),
    [
        (
            {"verdict": "unknown-effect"},
            {},
            "Coulomb friction on joint 2, 8 N·m (7.8 to 8.2); none of the known effects explains what is left",
        ),
        ({"verdict": "unknown-effect"}, None, "none of the known effects explains what is left"),
        (NOTHING, {}, "nothing that the held-out traces confirm"),
        (NOTHING, TAKEN_BACK, "none of the known effects, and what is left has no shape of one"),
        (NOTHING, None, "the model explains these traces within their noise and its tolerances"),
        (
            {"verdict": "suspected", "suspicion": DOUBT},
            None,
            "perhaps backlash on joint 1, evidence 24 of 30; 20 s more of this motion would settle it",
        ),
    ],
)
def test_an_answer_without_a_name_says_what_there_is(
    answer: Diagnosis, fields: dict[str, object], of_step: dict[str, object] | None, said: str
) -> None:
    steps = () if of_step is None else (answer.steps[0].model_copy(update=of_step),)
    assert headline(answer.model_copy(update={**fields, "steps": steps})) == said


def test_what_is_left_and_a_number_far_from_its_file_are_told_where_nothing_is_named(answer: Diagnosis) -> None:
    nothing = answer.model_copy(update={"verdict": "nothing-significant", "steps": ()})
    error = SignalError(joint=1, unit="deg", before=0.5, after=0.4, floor=0.1)
    left = nothing.model_copy(update={"rmse_fit": (error,)})
    assert headline(left) == "no known effect has the evidence to be named; joint 1 is left with 4 times its noise"
    assert summary(left).startswith("No known effect has the evidence to be named, though joint 1 is left with 4 times")
    refused = left.model_copy(update={"steps": answer.steps})
    assert headline(refused) == "nothing that the held-out traces confirm; joint 1 is left with 4 times its noise"
    far = error.model_copy(update={"floor": 0.4 / 1200})
    assert headline(nothing.model_copy(update={"rmse_fit": (far,)})).endswith(
        "joint 1 is left with 1200 times its noise"
    )
    number = {"name": "link1.mass", "unit": "kg", "value": 5.51, "expected": 3.0, "deviations": 6.0}
    moved = Note(kind="stated-numbers-moved", values={"limit": 4.0, "numbers": [number]}, warning=True)
    doubted = nothing.model_copy(update={"notes_data": (moved,)})
    assert headline(doubted) == (
        "no known effect has the evidence to be named; link1.mass comes out at 5.51 kg, where 3 is stated"
    )
    assert summary(doubted).endswith("though link1.mass comes out at 5.51 kg, where 3 is stated.")
    unknown = error.model_copy(update={"floor": 1e-9})
    assert "times its noise" not in headline(nothing.model_copy(update={"rmse_fit": (unknown,)})), "no noise is stated"


def test_joints_that_were_not_examined_are_in_the_first_line(answer: Diagnosis) -> None:
    silent = answer.model_copy(update={"verdict": "nothing-significant", "steps": (), "not_examined": (2,)})
    assert headline(silent).endswith(
        "; joint 2 was not examined: its drive stands at its largest value for too much of the time"
    )
    assert summary(silent).startswith("Joint 2 was not examined: ")
    both = silent.model_copy(update={"not_examined": (1, 3)})
    assert "joints 1 and 3 were not examined" in headline(both)
    assert "not examined" not in headline(answer)


@pytest.mark.parametrize(
    ("effects", "joints", "said"),
    [
        (None, (2,), "only effects on joint 2 were looked for"),
        (("backlash",), None, "only 1 effect was looked for"),
        (("backlash", "payload"), (2, 3), "only 2 effects on joints 2 and 3 were looked for"),
    ],
)
def test_what_a_search_was_limited_to_is_in_the_first_line(
    answer: Diagnosis, effects: tuple[str, ...] | None, joints: tuple[int, ...] | None, said: str
) -> None:
    limited = Note(kind="limited-search", values={"effects": effects, "joints": joints})
    for verdict in ("named", "nothing-significant"):
        found = answer.model_copy(update={"verdict": verdict, "notes_data": (limited,)})
        assert headline(found).endswith(f"; {said}")
    nothing = found.model_copy(update={"steps": (), "rmse_fit": ()})
    assert headline(nothing) == f"no known effect has the evidence to be named; {said}"
