"""Which effects may be named below a lower cutoff: none whose torque jumps, as it is smeared there."""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from model.discrepancy.diagnosis import Candidate, Diagnosis
from model.discrepancy.grounds import Note
from model.discrepancy.inverse_dynamics import looks
from model.discrepancy.inverse_dynamics.looks import JUMPING, LOOKS
from model.effects.library import library
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics.rigs import slide_machine
from tests.model.discrepancy.steps import answer_of, step

MODEL = base_model(slide_machine())


def answer(*effects: str, group: tuple[str, ...] = ()) -> Diagnosis:
    """An answer that names effects, one after the other, the last in a group."""
    members = tuple(Candidate(effect=name, joints=(1,), evidence=40.0) for name in group)
    steps = tuple(step(name, group=members if name == effects[-1] else ()) for name in effects)
    return answer_of(MODEL, *steps)


@dataclass
class Below:
    """Records of which each look has its own answer."""

    answers: list[Diagnosis]
    looked: list[float] = field(default_factory=list)

    def bears(self, cutoff: float) -> bool:
        return cutoff > 0.0

    def below(self, cutoff: float, progress: Any) -> Any:
        progress(1.0, "done")
        self.looked.append(cutoff)
        return SimpleNamespace(answer=self.answers[len(self.looked) - 1])


def first_finding(*answers: Diagnosis) -> tuple[Diagnosis, int]:
    """The answer that is given, and how many cutoffs were looked at."""
    work: Any = Below(list(answers))
    return looks._first_below(work, 12.0, lambda *_: None).answer, len(work.looked)


@pytest.mark.parametrize("effect", [*sorted(JUMPING), "coulomb_friction", "stribeck_friction"])
def test_an_effect_that_jumps_is_not_named_below_a_lower_cutoff(effect: str) -> None:
    nothing = answer()
    found, looks = first_finding(nothing, answer(effect), answer("spring_torque", effect))
    assert found is nothing
    assert looks == len(LOOKS)
    found, _ = first_finding(nothing, answer("spring_torque", group=("spring_torque", effect)), nothing)
    assert found is nothing, "nor where it may be one of a group"


def test_an_effect_that_jumps_is_named_below_the_highest_cutoff() -> None:
    found, looks = first_finding(answer("dead_zone"))
    assert [s.effect for s in found.steps] == ["dead_zone"]
    assert looks == 1


def test_a_slow_effect_is_named_below_the_first_cutoff_that_shows_it() -> None:
    slow = answer("potentiometer_gain")
    found, looks = first_finding(answer(), slow)
    assert found is slow
    assert looks == 2


GROUP = answer("potentiometer_offset", group=("potentiometer_offset", "spring_torque"))


def test_a_group_is_told_apart_below_the_first_cutoff_that_names_one_of_it() -> None:
    again, one = answer("spring_torque", group=("spring_torque", "torque_ripple")), answer("spring_torque")
    found, looks = first_finding(GROUP, again, one)
    assert found is one
    assert looks == len(LOOKS)


@pytest.mark.parametrize(
    "other",
    [answer(), answer("torque_ripple"), answer("spring_torque", "torque_ripple"), GROUP],
    ids=["nothing", "another", "one-more", "again"],
)
def test_a_group_stays_one_where_lower_cutoffs_name_nothing_of_it(other: Diagnosis) -> None:
    assert first_finding(GROUP, other, other)[0] is GROUP


def test_lower_cutoffs_are_not_looked_at_where_a_drive_stands_at_a_limit_that_no_file_states() -> None:
    at_limit = Note(kind="drive-at-limit", values={"shares": [[1, 0.02]], "unknown_joints": []})
    for first in (answer(), GROUP):
        limited = first.model_copy(update={"notes_data": (at_limit,)})
        assert first_finding(limited, answer("spring_torque")) == (limited, 1)


def test_a_group_with_an_effect_that_jumps_is_not_looked_at_below_a_lower_cutoff() -> None:
    group = answer("spring_torque", group=("spring_torque", "coulomb_friction"))
    assert first_finding(group) == (group, 1)


def test_the_effects_that_jump_are_of_the_library() -> None:
    assert set(library()) >= JUMPING
