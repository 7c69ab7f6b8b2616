"""Makes the sentences of an answer from its data. This is the last step of a diagnosis, and the only one that writes
prose.

Whoever wants to know something of an answer reads its data; sentences are for people and are not read back.
"""

from __future__ import annotations

from model.discrepancy.diagnosis import Diagnosis, Gap, NextExperiment
from model.discrepancy.explanation.answer_words import summary
from model.discrepancy.explanation.note_words import note_words
from model.discrepancy.explanation.step_words import PHASES, sentence, step_with_sentences, where_with_summary
from model.discrepancy.numbers import plain
from model.effects.names import placed
from model.units import shown_unit, with_unit

STAGES = {"given": "model as given", "fitted": "its numbers fitted", "refitted": "everything refitted"}


def with_sentences(answer: Diagnosis) -> Diagnosis:
    """The answer with its sentences. What has no data, as in older answers, keeps the text that it has."""
    asked = answer.next_experiment
    written = answer.model_copy(
        update={
            "steps": tuple(map(step_with_sentences, answer.steps)),
            "gap": None if answer.gap is None else _gap_with_names(answer.gap),
            "where": None if answer.where is None else where_with_summary(answer.where),
            "next_experiment": None if asked is None else _experiment_with_reason(asked),
            "notes": tuple(sentence(note_words(n)) for n in answer.notes_data) or answer.notes,
        }
    )
    return written.model_copy(update={"summary": summary(written)})


def _gap_with_names(gap: Gap) -> Gap:
    """The gap with the names of its stages, and the alternative in words."""
    names = (STAGES.get(s.kind) or f"+ {placed(s.effect or '', s.joints)}" for s in gap.stages)
    stages = tuple(s.model_copy(update={"name": name}) for s, name in zip(gap.stages, names, strict=True))
    without = None if gap.without is None else gap.without.model_copy(update={"text": _without_words(gap)})
    return gap.model_copy(update={"stages": stages, "without": without})


def _without_words(gap: Gap) -> str:
    """What the numbers would have had to become without the effects, and what that leaves."""
    without = gap.without
    assert without is not None
    errors = []
    for place, joint in enumerate(gap.joints):
        factor, unit = shown_unit(gap.units[place])
        sizes = (without.fitted[place], gap.stages[-1].fitted[place])
        alone, whole = ("–" if v is None else with_unit(plain(v * factor), unit) for v in sizes)
        errors.append(f"joint {joint} {alone} (with: {whole})")
    left = f"Without the effect, fitted numbers alone leave {', '.join(errors)}"
    if not without.numbers:
        return f"{left}; no number would have to move by more than a stated deviation."
    moved = [
        f"{n.name} {plain(n.without, 3)}{'' if n.unit == '1' else f' {n.unit}'} for {plain(n.stated, 3)} ± "
        f"{plain(n.deviation)} (with it: {plain(n.fitted, 3)})"
        for n in without.numbers
    ]
    return f"{left}. The numbers would have had to become {'; '.join(moved)}."


def _experiment_with_reason(asked: NextExperiment) -> NextExperiment:
    at = asked.differs_at
    if asked.information is not None:
        why = f"it excites what these traces do not, and would add {asked.information:.0f} nats of information on the"
        why += " arm's parameters"
    elif at is not None:
        on_joint = f"on joint {at.joint} " if at.other_joint else ""
        why = (
            f"{asked.hardest[0]} and {asked.hardest[1]} would differ by {asked.predicted_separation:.1f} standard "
            f"deviations with the other parameters refitted, {100 * at.share:.0f} % of it {on_joint}{PHASES[at.phase]}"
        )
    else:
        return asked
    return asked.model_copy(update={"reason": sentence(f"{asked.description}: {why}")})
