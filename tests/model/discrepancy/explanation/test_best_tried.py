"""How near the best candidate came to being named: by the evidence that it needed itself."""

from model.discrepancy.diagnosis import Candidate
from model.discrepancy.explanation.answer_words import best_tried


def tried(evidence: float, **fields: float) -> Candidate:
    return Candidate(effect="coulomb_friction", joints=(1,), evidence=evidence, refitted=True).model_copy(update=fields)


def test_a_candidate_is_held_to_the_evidence_that_it_needs_and_not_to_the_most_that_any_needs() -> None:
    said = best_tried([tried(7.0, needed=10.0), tried(-3.0)], 30.0)
    assert said == (
        "The best of the 2 listed, Coulomb friction on joint 1, has evidence of 7; it would be named from 10."
    )
    assert best_tried([tried(7.0)], 30.0).endswith("has evidence of 7; an effect is named from 30.")
    above = best_tried([tried(12.0, needed=10.0)], 30.0)
    assert above.endswith("It is above the 10 from which it would be named, but takes off no more than noise.")


def test_what_held_out_traces_say_counts() -> None:
    said = best_tried([tried(35.0, needed=30.0, evidence_held_out=-20.0)], 30.0)
    assert said.endswith("has evidence of 35 (15 with what held-out traces say); it would be named from 30.")
