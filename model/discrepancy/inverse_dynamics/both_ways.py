"""What fitted and held-out traces show, each fitted to in turn while the others are held out (docs/decisions/0053).

One motion may hardly show what another one shows plainly: a step excites what a slow sweep leaves alone. And what only
one of them shows may be a part of something else that the library has no law for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.progress import Progress, part_of
from model.discrepancy.diagnosis import Diagnosis, SignalError, Step, Suspicion, Verdict
from model.discrepancy.grounds import Note
from model.discrepancy.inverse_dynamics.judging import SUSPECTED
from model.discrepancy.inverse_dynamics.left_over import SHAPED_ABOVE_NOISE
from model.discrepancy.inverse_dynamics.looks import Look, Records, first_finding, found_in_torques, meet, names_of
from model.fitting.choice import SLIDING_FRICTION

PLAIN = 100.0
"""Evidence of all records from which an effect may be plain to see, so that it is named even where the held-out traces
show nothing of it when they are fitted to: too little may move in these."""
CONFIRMED = SUSPECTED
"""Least part of that evidence which has to be of the held-out traces. On two sound arms (thirteenth trial) 165 and 188
of the traces to fit to stood beside 0 and 1."""


def diagnose_both_ways(records: Records, progress: Progress) -> Diagnosis:
    """What traces to fit to and held-out traces show, without its sentences and the time that it took.

    Raises:
        TraceError, SpecError: for traces that cannot be compared in torques, or in which nothing moves beyond the noise
            of its readings. CancelledError: when asked to end.
    """
    if not records.held_out:
        return first_finding(records, progress).answer
    look = first_finding(records, part_of(progress, 0.0, 0.5))
    if look.answer.verdict == "unknown-effect":  # what has no name here gets none elsewhere
        return look.answer
    try:
        other = _look_the_other_way(records, look.answer, part_of(progress, 0.5, 1.0))
    except (TraceError, SpecError) as error:  # a check all the same; the first answer stands
        return _with_note(look.answer, Note(kind="not-exchanged", values={"why": str(error)}))
    return _with_note(look.answer, Note(kind="not-exchanged")) if other is None else _join(look, other)


def _look_the_other_way(records: Records, found: Diagnosis, progress: Progress) -> Look | None:
    """What is seen with the traces exchanged; None where those held out are too short to be fitted to.

    Where one effect with one name is plain to see, that effect alone is looked for at first: what the others may show
    is that they contradict it.
    """
    exchanged = records.exchanged()
    if not exchanged.bears(exchanged.highest_cutoff):
        return None
    steps = found_in_torques(found)
    if len(steps) == 1 and not steps[0].group and _is_plain(steps[0]):
        options = records.options.model_copy(update={"effects": tuple(names_of(steps[0]))})
        alone = first_finding(replace(exchanged, options=options), part_of(progress, 0.0, 0.5))
        if not _contradicts(alone, found):
            return alone
        progress = part_of(progress, 0.5, 1.0)
    return first_finding(exchanged, progress)


def _join(look: Look, exchanged: Look) -> Diagnosis:
    """The answer of both: what the traces to fit to show, without what the others do not confirm, and without names
    that the others exclude; or what the others show plainly, where the first show nothing, or little that they do not
    confirm. What the others leave without a name has none.

    Args:
        look: at the traces to fit to. exchanged: with fitted and held-out traces exchanged.
    """
    other = exchanged.answer
    found, seen = found_in_torques(look.answer), found_in_torques(other)
    if _contradicts(exchanged, look.answer):
        effects = [_values(step) for step in found]
        left = _plain_alone(exchanged) or other
        return _with_note(left, Note(kind="traces-contradict", values={"effects": effects}))
    confirmed = [step for step in found if _is_shown(step, other) or exchanged.speaks_for(step)]
    others = [one for one in seen if not any(_agree(one, step) for step in found)]
    confirmed += _by_relatives([step for step in found if step not in confirmed], others)
    missing = [s for s in found if s not in confirmed and (not _is_plain(s) or _is_beside(s, confirmed))]
    if len(missing) == len(found):
        plain = _plain_alone(exchanged)
        if plain is not None:
            return _with_note(plain, Note(kind="traces-exchanged"))
    if not found:
        return look.answer if seen or other.suspicion is not None else _without_suspicion(look)
    return _without_excluded(look.withdraw(missing) if missing else look.answer, seen)


def _plain_alone(exchanged: Look) -> Diagnosis | None:
    """What exchanged traces show plainly, without what they show beside it: an effect, or that none of the known ones
    explains them. None where they show neither."""
    weak = [step for step in found_in_torques(exchanged.answer) if not _is_plain(step)]
    answer = exchanged.withdraw(weak) if weak else exchanged.answer
    return answer if found_in_torques(answer) or answer.verdict == "unknown-effect" else None


def _contradicts(exchanged: Look, found: Diagnosis) -> bool:
    """Whether traces leave something without a name on a joint of an effect that was found in others and for which they
    do not speak, and leave it as well with the model that has this effect."""
    other = exchanged.answer
    if other.verdict != "unknown-effect":
        return False
    joints = other.model_before.machine.modelled_joints
    doubted = [step for step in found_in_torques(found) if not exchanged.speaks_for(step)]
    own = {joint for step in doubted for joint in step.joints or joints}
    return bool(own & _far_above_noise(other.rmse_fit) & _far_above_noise(found.rmse_holdout))


def _far_above_noise(errors: Sequence[SignalError]) -> set[int]:
    """The joints whose error is no noise, by the resulting model."""
    return {error.joint for error in errors if error.after > SHAPED_ABOVE_NOISE * error.floor}


def _without_suspicion(look: Look) -> Diagnosis:
    """The answer without an effect that is suspected: the other traces say nothing of it."""
    suspicion = look.answer.suspicion
    if suspicion is None:
        return look.answer
    note = Note(kind="suspicion-dropped", values={**_values(suspicion), "evidence": suspicion.evidence})
    return _with_note(look.withdraw(()), note)


def _values(step: Step | Suspicion) -> dict[str, object]:
    return {"effect": step.effect, "joints": list(step.joints)}


def _without_excluded(answer: Diagnosis, seen: Sequence[Step]) -> Diagnosis:
    """The answer without names of its groups that no step of the other answer has, which is of the same effect."""
    steps = tuple(_narrowed(step, seen) for step in answer.steps)
    if steps == answer.steps:
        return answer
    is_open = any(step.adopted and step.group for step in steps)
    verdict: Verdict = "partly" if answer.verdict == "partly" else "ambiguous" if is_open else "named"
    return _with_note(answer.model_copy(update={"steps": steps, "verdict": verdict}), Note(kind="names-excluded"))


def _narrowed(step: Step, seen: Sequence[Step]) -> Step:
    same = [one for one in seen if _agree(step, one)] if step.adopted and step.group else []
    if len(same) != 1 or step.effect not in names_of(same[0]):
        return step
    kept = tuple(member for member in step.group if member.effect in names_of(same[0]))
    return step.model_copy(update={"group": kept if len(kept) > 1 else ()})


def _with_note(answer: Diagnosis, note: Note) -> Diagnosis:
    return answer.model_copy(update={"notes_data": (note, *answer.notes_data)})


def _evidence(step: Step) -> float:
    """Evidence of all records."""
    return step.evidence + (step.evidence_held_out or 0.0)


def _is_plain(step: Step) -> bool:
    """Whether an effect is plain to see, and not in the traces alone that it was fitted to."""
    return _evidence(step) >= PLAIN and (step.evidence_held_out or 0.0) >= CONFIRMED


def _is_shown(step: Step, other: Diagnosis) -> bool:
    """Whether the other answer names the effect of a step, or suspects it."""
    if any(_agree(step, one) for one in found_in_torques(other)):
        return True
    suspicion = other.suspicion
    return suspicion is not None and suspicion.effect in names_of(step) and meet(step.joints, suspicion.joints)


def _by_relatives(steps: Sequence[Step], others: Sequence[Step]) -> list[Step]:
    """Those of the steps of dry friction that another law of it confirms, each by one: such laws differ only where
    motion is slow or one way, or the load changes, and few motions show that."""
    left = [one for one in others if _rubs(one)]
    found = []
    for step in filter(_rubs, steps):
        relative = next((one for one in left if meet(step.joints, one.joints)), None)
        if relative is not None:
            left.remove(relative)
            found.append(step)
    return found


def _rubs(step: Step) -> bool:
    return any(name in SLIDING_FRICTION for name in names_of(step))


def _is_beside(step: Step, others: Sequence[Step]) -> bool:
    """Whether a step has a joint in common with any of the others: it may then be a part of what these explain."""
    return any(meet(step.joints, one.joints) for one in others)


def _agree(step: Step, other: Step) -> bool:
    """Whether two steps may be of the same effect, on a joint of both."""
    return meet(step.joints, other.joints) and bool(names_of(step) & names_of(other))
