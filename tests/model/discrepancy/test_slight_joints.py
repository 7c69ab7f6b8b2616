"""A joint that shares an effect only slightly is named as such, and is not in the headline."""

import pytest

from model.discrepancy.diagnosis import Candidate, Diagnosis, FoundValue, Step
from model.discrepancy.explanation.answer_words import headline
from model.discrepancy.explanation.renderer import with_sentences
from model.discrepancy.slight_joints import with_slight_joints
from tests.model.discrepancy.answers import an_answer
from tests.model.fitting import imagined

EFFECT = "coulomb_friction"
GIVEN = imagined.arm()


@pytest.fixture(scope="module")
def answer() -> Diagnosis:
    return an_answer(8.0)[0]


def on_both(answer: Diagnosis, torque: float, evidence: float) -> Diagnosis:
    """8 N·m on joint 2, and more on joint 1, which together have so much more evidence than on joint 2 alone."""
    after = GIVEN.with_effect(EFFECT, (1, 2), {"joint2.coulomb_friction.torque": 8.0})
    values = {
        f"joint{j}.coulomb_friction.torque": FoundValue.of(
            after.parameter(f"joint{j}.coulomb_friction.torque"), size, 0.98 * size, 1.02 * size
        )
        for j, size in ((1, torque), (2, 8.0))
    }
    alone = Candidate(effect=EFFECT, joints=(2,), evidence=1554.0, misfit=1.05, refitted=True)
    other = Candidate(effect=EFFECT, joints=(1,), evidence=70.0, misfit=3.0, refitted=True)
    step = answer.steps[0].model_copy(
        update={"joints": (1, 2), "parameters": values, "evidence": 1554.0 + evidence, "candidates": (alone, other)}
    )
    return answer.model_copy(update={"steps": with_slight_joints((step,), GIVEN, after), "model_after": after})


def test_a_joint_with_little_evidence_and_a_small_size_is_slight(answer: Diagnosis) -> None:
    found = with_sentences(on_both(answer, 0.2, 60.0))
    assert (found.steps[0].slight_joints, found.steps[0].main_joints) == ((1,), (2,))
    assert headline(found) == "Coulomb friction on joint 2, 8 N·m (7.84 to 8.16)"
    assert "On joint 1 it is slight (0.2 N·m (0.196 to 0.204)), which may be what the law leaves" in found.summary


@pytest.mark.parametrize(("torque", "evidence"), [(3.0, 60.0), (0.2, 200.0)])
def test_a_joint_with_much_of_either_is_as_good_as_the_other(answer: Diagnosis, torque: float, evidence: float) -> None:
    found = with_sentences(on_both(answer, torque, evidence))
    assert found.steps[0].slight_joints == ()
    assert "Coulomb friction on joints 1 and 2" in headline(found)
    assert "slight" not in found.summary


def test_a_later_step_of_the_same_effect_may_be_slight_as_a_whole(answer: Diagnosis) -> None:
    both = on_both(answer, 0.2, 0.0)
    whole = both.steps[0]

    def one(joint: int, evidence: float) -> Step:
        name = f"joint{joint}.coulomb_friction.torque"
        return whole.model_copy(
            update={
                "joints": (joint,),
                "parameters": {name: whole.parameters[name]},
                "evidence": evidence,
                "slight_joints": (),
            }
        )

    steps = with_slight_joints((one(2, 1554.0), one(1, 60.0)), GIVEN, both.model_after)
    assert [s.slight_joints for s in steps] == [(), (1,)]
    assert headline(both.model_copy(update={"steps": steps})) == "Coulomb friction on joint 2, 8 N·m (7.84 to 8.16)"
    assert with_slight_joints((one(2, 1554.0),), GIVEN, both.model_after)[0].slight_joints == ()
