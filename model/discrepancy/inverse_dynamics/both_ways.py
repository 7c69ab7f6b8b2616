"""What fitted and held-out traces show, each fitted to in turn while the others are held out (docs/decisions/0072).

One motion may hardly show what another one shows plainly: a step excites what a slow sweep leaves alone. And what only
one of them shows may be a part of something else that the library has no law for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from daq.contracts.progress import Progress, part_of
from model.discrepancy.diagnosis import Diagnosis, Step, Suspicion, Verdict
from model.discrepancy.grounds import Note
from model.discrepancy.inverse_dynamics.looks import Look, Records, first_finding, found_in_torques, names_of

PLAIN = 100.0
"""Evidence of all records from which effects are plain to see, so that they are named even where the held-out traces
show nothing when they are fitted to: too little may move in these."""


def diagnose_both_ways(records: Records, progress: Progress) -> Diagnosis:
    """What traces to fit to and held-out traces show, without its sentences and the time that it took.

    Raises SpecError where nothing moves beyond the noise of its readings.
    """
    look = first_finding(records, part_of(progress, 0.0, 0.5 if records.held_out else 1.0))
    other = _look_the_other_way(records, look.answer, part_of(progress, 0.5, 1.0))
    return look.answer if other is None else _join(look, other)


def _look_the_other_way(records: Records, found: Diagnosis, progress: Progress) -> Diagnosis | None:
    """The answer with the traces exchanged; None where it would say nothing more.

    Where one effect with one name is plain to see, that effect alone is looked for at first: what the others may show
    is that they contradict it. Where something is left that has no name, no other traces give it one.
    """
    if not records.held_out or found.verdict == "unknown-effect":
        return None
    exchanged = records.exchanged()
    if exchanged is None or exchanged.unseen is not None:
        return None
    steps = found_in_torques(found)
    if len(steps) == 1 and not steps[0].group and _evidence(steps) >= PLAIN:
        options = records.options.model_copy(update={"effects": tuple(names_of(steps[0]))})
        alone = first_finding(replace(exchanged, options=options), part_of(progress, 0.0, 0.5)).answer
        if alone.verdict != "unknown-effect":
            return alone
        progress = part_of(progress, 0.5, 1.0)
    return first_finding(exchanged, progress).answer


def _join(look: Look, other: Diagnosis) -> Diagnosis:
    """The answer of both: what the traces to fit to show, without what the others do not confirm, and without names
    that the others exclude; or what the others show, where the first show nothing. What the others leave without a name
    has none.

    Args:
        look: at the traces to fit to. other: the answer with fitted and held-out traces exchanged.
    """
    found, seen = found_in_torques(look.answer), found_in_torques(other)
    if other.verdict == "unknown-effect" and found:
        return _with_note(other, Note(kind="traces-contradict", values={"effects": [_values(step) for step in found]}))
    if not found and (seen or other.verdict == "unknown-effect"):
        return _with_note(other, Note(kind="traces-exchanged"))
    if not found:
        return look.answer if other.suspicion is not None else _without_suspicion(look.answer)
    missing = [step for step in found if not any(_agree(step, one) for one in seen)]
    if missing and (len(missing) < len(found) or _evidence(found) < PLAIN):
        return _without_excluded(look.without(missing), seen)
    return _without_excluded(look.answer, seen)


def _without_suspicion(answer: Diagnosis) -> Diagnosis:
    """The answer without an effect that is suspected: the other traces say nothing of it."""
    if answer.suspicion is None:
        return answer
    note = Note(kind="suspicion-dropped", values={**_values(answer.suspicion), "evidence": answer.suspicion.evidence})
    return _with_note(answer.model_copy(update={"verdict": "nothing-significant", "suspicion": None}), note)


def _values(step: Step | Suspicion) -> dict[str, object]:
    return {"effect": step.effect, "joints": list(step.joints)}


def _without_excluded(answer: Diagnosis, seen: Sequence[Step]) -> Diagnosis:
    """The answer without names of its groups that no step of the other answer has, which is of the same effect."""
    steps = tuple(_narrowed(step, seen) for step in answer.steps)
    if steps == answer.steps:
        return answer
    is_open = any(step.adopted and step.group for step in steps)
    verdict: Verdict = "ambiguous" if is_open else "named"
    return _with_note(answer.model_copy(update={"steps": steps, "verdict": verdict}), Note(kind="names-excluded"))


def _narrowed(step: Step, seen: Sequence[Step]) -> Step:
    same = [one for one in seen if _agree(step, one)] if step.adopted and step.group else []
    if len(same) != 1 or step.effect not in names_of(same[0]):
        return step
    kept = tuple(member for member in step.group if member.effect in names_of(same[0]))
    return step.model_copy(update={"group": kept if len(kept) > 1 else ()})


def _with_note(answer: Diagnosis, note: Note) -> Diagnosis:
    return answer.model_copy(update={"notes_data": (note, *answer.notes_data)})


def _evidence(steps: Sequence[Step]) -> float:
    return sum(step.evidence + (step.evidence_held_out or 0.0) for step in steps)


def _agree(step: Step, other: Step) -> bool:
    """Whether two steps may be of the same effect, on a joint of both."""
    places = not step.joints or not other.joints or bool(set(step.joints) & set(other.joints))
    return places and bool(names_of(step) & names_of(other))
