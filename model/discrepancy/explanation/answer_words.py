"""An answer in words: its headline and summary, what is left, and what was tried."""

from __future__ import annotations

from collections.abc import Sequence

from model.discrepancy.diagnosis import (
    CLEAR_SHAPE,
    FEWEST_BINS,
    Candidate,
    Diagnosis,
    Gap,
    NextExperiment,
    RemainingShape,
    Step,
    Suspicion,
    Where,
    clear_shape,
    in_order,
)
from model.discrepancy.explanation.effect_words import (
    METHODS,
    NOTHING,
    NOTHING_AT_LENGTH,
    PHASES,
    STAGES,
    called,
    class_headline,
    class_of_group,
    class_words,
    plain,
    size_words,
    sizes_of,
)
from model.discrepancy.explanation.notes import limited_search, note_words
from model.discrepancy.explanation.step_words import (
    NOISE_UNKNOWN,
    reason_text,
    sentence,
    step_with_sentences,
    where_with_summary,
)
from model.discrepancy.thresholds import WITHIN_NOISE
from model.effects.names import effect_on, joints_in_words, placed
from model.record_check.finding import doubts_headline, doubts_in, lines_of
from model.units import shown_unit, with_unit

SHOWN = 3
"""Members of a group that a headline names."""


def headline(found: Diagnosis) -> str:
    """The effects that were found, with joints and sizes; or that none was found, or none that is known; joints that
    were not examined, and to what the search was limited. A clause for the terminal, the report, lists and the page."""
    shown = [s for s in found.steps if s.adopted]
    findings = [_group_headline(s, found) if s.group else _finding(s) for s in shown]
    limits = [limited_search(n.values) for n in found.notes_data if n.kind == "limited-search"]
    match found.verdict:
        case "check-the-record":
            return f"check the record: {doubts_headline(found.record)}"
        case "suspected" if found.suspicion is not None:
            findings = [f"perhaps {suspicion_words(found.suspicion)}"]
        case "nothing-significant" if found.examined_nothing:
            findings = ["the traces say nothing of the model"]
        case "nothing-significant":
            why = _why_nothing(found)[0]
            # a search of some effects or joints does not say that the model explains the rest
            findings = [NOTHING["doubted" if limits and why == "explained" else why], *doubts_of(found)]
        case "unknown-effect":
            findings.append("none of the known effects explains what is left")
        case "partly":
            findings.append("and more is missing than was named")
    return "; ".join(
        [
            *(findings or ["several effects that these traces cannot tell apart"]),
            *_not_examined(found.not_examined),
            *limits,
        ]
    )


def summary(found: Diagnosis) -> str:
    """The answer in a few sentences: what was not examined, its verdict, its steps and what is left."""
    said = [*map(sentence, _not_examined(found.not_examined))]
    match found.verdict:
        case "check-the-record":
            said += lines_of(doubts_in(found.record))
        case "suspected":
            unclear = "an effect that these traces do not show clearly"
            said.append(f"Suspected: {unclear if found.suspicion is None else suspicion_words(found.suspicion)}.")
        case "nothing-significant" if found.examined_nothing:
            said.append("The traces say nothing of the model.")
        case "nothing-significant":
            said.append(_nothing(found))
        case "unknown-effect":
            said += _unknown(found)
        case _:
            machine = found.model_before.machine
            said += [_undecided(s, found) if s.group else reason_text(s, machine) for s in found.steps if s.adopted]
            if found.remaining or found.verdict == "partly":
                said.append("Something is left that these effects do not explain.")
    return " ".join(said)


def method_words(found: Diagnosis) -> str:
    """How model and traces were compared, as a noun."""
    return METHODS[found.method]


def _not_examined(joints: Sequence[int]) -> list[str]:
    """That joints were not examined, as a clause; none where all were."""
    if not joints:
        return []
    one = len(joints) == 1
    seen = "was not examined: its drive stands at its" if one else "were not examined: their drives stand at their"
    return [f"{joints_in_words(joints)} {seen} largest value for too much of the time"]


def _finding(step: Step) -> str:
    sizes = sizes_of(step.effect or "", step.parameters)
    return ", ".join((effect_on(step.effect or "", step.joints), *map(size_words, sizes)))


def _group_headline(step: Step, found: Diagnosis) -> str:
    """The class that all members of a group belong to; else the first members, and how many more there are."""
    whole = class_of_group(step.group, found.inseparable)
    if whole is not None and whole.shares is not None:
        return class_headline(whole, whole.shares)
    names = [effect_on(c.effect, c.joints) for c in step.group]
    more = [] if len(names) <= SHOWN else [f"{len(names) - SHOWN} more"]
    return f"one of: {' or '.join(names[:SHOWN] + more)}"


def _undecided(step: Step, found: Diagnosis) -> str:
    """Why several effects are named: they explain the same, within what their evidence can tell apart, or on every
    motion."""
    group = step.group
    named = ", ".join(f"{called(c.effect, c.joints)} ({c.evidence:.0f})" for c in group)
    apart = max(c.evidence for c in group) - min(c.evidence for c in group)
    text = f"{step.where.summary} These explain it, with evidence that differs by no more than {apart:.0f}: {named}."
    whole = class_of_group(group, found.inseparable)
    return text if whole is None else f"{text} {sentence(class_words(whole))}"


def suspicion_words(found: Suspicion) -> str:
    """A suspicion as a clause."""
    return (
        f"{called(found.effect, found.joints)}, evidence {found.evidence:.0f} of {found.needed:.0f}; "
        f"{found.seconds:.0f} s more of this motion would settle it"
    )


def _why_nothing(found: Diagnosis) -> tuple[str, Step | None]:
    """Why nothing is named, as a key of `NOTHING`, and the step that was refused."""
    refused = [s for s in found.steps if s.effect is not None]
    for step in refused:
        if step.refusal is not None and step.refusal.kind == "only-resembles":
            return step.refusal.kind, step
    return ("refused", refused[0]) if refused else ("doubted" if doubts_of(found) else "explained", None)


def _nothing(found: Diagnosis) -> str:
    kind, step = _why_nothing(found)
    if step is None:
        return NOTHING_AT_LENGTH[kind].format(doubts=" and ".join(doubts_of(found)))
    because = step.rejected_because or "records that were not fitted to do not confirm it"
    return NOTHING_AT_LENGTH[kind].format(
        effect=called(step.effect or "", step.joints), evidence=step.evidence, because=because
    )


def _unknown(found: Diagnosis) -> list[str]:
    """Why none of the known effects is named, and what a torque that would explain it goes with."""
    where, joints = found.where, found.unexplained_joints
    said = [] if where is None else [_left_on(joints, where) if joints and where.joint is None else where.summary]
    looked = found.remaining or found.method == "inverse-dynamics"  # readings are looked at for no shape
    shape = f"; {what_is_left(found.remaining)}" if looked else ""
    said.append(sentence(f"no known effect explains it{shape}"))
    if found.worse_held_out:
        said.append(
            "The fit of the tolerance parameters does not hold on held-out traces, where the error of "
            f"{joints_in_words(found.worse_held_out)} grows: do not use the model after."
        )
    return said


def _left_on(joints: Sequence[int], where: Where) -> str:
    """What is left on joints whose residual is too large, where the map names no joint."""
    named = f"{joints_in_words(joints)}: more than noise is left"
    clearest = max((c for c in where.cells if c.joint in joints), key=lambda c: c.significance, default=None)
    if clearest is None:
        return sentence(named)
    return sentence(
        f"{named}; the clearest place is joint {clearest.joint} at {clearest.start:.1f} s, "
        f"by {clearest.significance:.1f} standard deviations"
    )


def doubts_of(found: Diagnosis) -> list[str]:
    """What speaks against an answer that names nothing, as clauses: as much torque left as was recorded, a joint above
    its noise, and the number that is farthest from the machine file."""
    notes = {note.kind: note for note in found.notes_data if note.kind == "torque-left" or note.warning}
    said = []
    if (left := notes.get("torque-left")) is not None and left.values["after"] >= 1.0:
        said.append(f"{plain(100.0 * left.values['after'], 3)} % of the recorded torque is left")
    noises, joint = max(_beyond_noise(found), default=(0.0, 0))
    if noises:
        said.append(f"joint {joint} is left with {plain(noises, 2)} times its noise")
    if (moved := notes.get("stated-numbers-moved")) is not None:
        farthest = moved.values["numbers"][0]
        number = found.model_before.by_name.get(farthest["name"])
        effect = None if number is None else number.effect
        name = farthest["name"] if number is None or effect is None else effect_on(effect, number.joints)
        value = with_unit(plain(farthest["value"], 3), farthest["unit"])
        said.append(f"{name} comes out at {value}, where {plain(farthest['expected'], 3)} is stated")
    return said


def _beyond_noise(found: Diagnosis) -> list[tuple[float, int]]:
    """Errors of the answer beyond noise, in noises, and their joints: as the search compares them, and of the gap."""
    errors = [(e.after, e.floor, WITHIN_NOISE * e.floor, e.joint) for e in (*found.rmse_fit, *found.rmse_holdout)]
    if found.gap is not None and found.gap.most:
        gap = found.gap
        errors += zip((e or 0.0 for e in gap.stages[-1].fitted), gap.noise, gap.most, gap.joints, strict=True)
    return [(error / noise, joint) for error, noise, most, joint in errors if most < error < NOISE_UNKNOWN * noise]


def what_is_left(remaining: Sequence[RemainingShape]) -> str:
    """What the torque that is left goes with, and whether that is clear enough to invent an effect. A clause."""
    if not remaining:
        return "what is left has no shape against time, position, speed, direction or drive"
    clear = clear_shape(remaining)
    best = remaining[0] if clear is None else clear
    shape, share = _shape_words(best), f"{100 * best.explained:.0f} % of what is left"
    if clear is not None:
        return f"{shape} explains {share}"
    if best.explained < CLEAR_SHAPE:
        return f"no clear shape: the best, {shape}, explains only {share}"
    few = f"rests on {best.filled_bins} of the {FEWEST_BINS} bins that a shape needs"
    return f"no clear shape: the best, {shape}, explains {share}, but {few}"


def _shape_words(shape: RemainingShape) -> str:
    """A torque that is left, and what it goes with; of a position, where it is largest."""
    known = [(t, place) for t, place in zip(shape.torque, shape.centres, strict=True) if t is not None]
    torques = [torque for torque, _ in known]
    most = ""
    if shape.against == "position":
        factor, unit = shown_unit(shape.unit)
        place = max((abs(torque), place) for torque, place in known)[1]
        most = f", most at {with_unit(plain(place * factor, 3), unit)}"
    what = "friction" if shape.against_motion else "a torque"
    span = f"{plain(min(torques))} to {plain(max(torques))} {shape.torque_unit}"
    return f"{what} at joint {shape.joint} of {span} that goes with {shape.against}{most}"


def best_tried(candidates: Sequence[Candidate], significant: float) -> str:
    """How near the best of the candidates, none of which was added, has come to the evidence that it needs.

    Args:
        significant: evidence that a candidate needs which does not say what it needs itself: the most for a first one.
    """
    fitted, probed = in_order(candidates)
    best = (fitted or probed)[0]
    count = "The only candidate" if len(candidates) == 1 else f"The best of the {len(candidates)} listed"
    named = f"{count}, {effect_on(best.effect, best.joints)},"
    if not fitted:
        return (
            f"None of the candidates promised enough to be fitted. {named} promises evidence of {best.evidence:.0f}; "
            f"an effect is named from {significant:g}."
        )
    held = "" if best.evidence_held_out is None else f" ({best.total:.0f} with what held-out traces say)"
    needed = significant if best.needed is None else best.needed
    subject = "an effect is" if best.needed is None else "it would be"
    told = f"{named} has evidence of {best.evidence:.0f}{held}"
    if best.total >= needed:
        return f"{told}. It is above the {needed:.3g} from which {subject} named, but takes off no more than noise."
    return f"{told}; {subject} named from {needed:.3g}."


def not_a_finding(answer: Diagnosis, where: Where) -> str:
    """Why a residual that goes with something is no finding; empty where the answer names one."""
    if answer.verdict != "nothing-significant":
        return ""
    certain = "σ says how certain the dependence is, not how large: no joint is off by more than noise. "
    last = [c for c in answer.candidates if c.refitted]
    tried = sorted([*last, *(c for s in answer.steps for c in s.candidates)], key=lambda c: -c.total)[:1]
    line = next((c.needed for c in tried if c.needed is not None), answer.significant)
    said = [] if line is None else [f"an effect is named from evidence {line:.0f} on"]
    said += [f"the best, {placed(c.effect, c.joints)}, has evidence {c.total:.0f}" for c in tried]
    because = f": {'; '.join(said)}" if said else ""
    return f"{'' if where.joint is not None else certain}This is not a finding{because}."


def with_sentences(answer: Diagnosis) -> Diagnosis:
    """The answer with its sentences."""
    asked, machine = answer.next_experiment, answer.model_before.machine
    written = answer.model_copy(
        update={
            "steps": tuple(step_with_sentences(s, machine) for s in answer.steps),
            "gap": None if answer.gap is None else _gap_with_names(answer.gap),
            "where": None if answer.where is None else where_with_summary(answer.where),
            "next_experiment": None if asked is None else _experiment_with_reason(asked),
            "notes": tuple(sentence(note_words(n)) for n in answer.notes_data),
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
        why = "it excites what these traces do not, and adds the most information on the arm's parameters"
    elif at is not None:
        on_joint = f"on joint {at.joint} " if at.other_joint else ""
        why = (
            f"{asked.hardest[0]} and {asked.hardest[1]} would differ by {asked.predicted_separation:.1f} standard "
            f"deviations with the other parameters refitted, {100 * at.share:.0f} % of it {on_joint}{PHASES[at.phase]}"
        )
    else:
        return asked
    return asked.model_copy(update={"reason": sentence(f"{asked.description}: {why}")})
