"""Makes the sentences of an answer from its data. This is the last step of a diagnosis, and the only one that writes
prose.

Whoever wants to know something of an answer reads its data; sentences are for people and are not read back.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from daq.contracts.errors import SpecError
from model.discrepancy.diagnosis import (
    CLEAR_SHAPE,
    FEWEST_BINS,
    UNWRITTEN,
    Candidate,
    Diagnosis,
    DifferencePlace,
    FoundValue,
    Gap,
    Inseparable,
    NextExperiment,
    Phase,
    RemainingShape,
    Step,
    Suspicion,
    Where,
    clear_shape,
    in_order,
)
from model.discrepancy.explanation.class_words import class_of_group, class_words
from model.discrepancy.explanation.effect_words import shape_in_torques, size_of, words_of
from model.discrepancy.explanation.left_words import NOISE_UNKNOWN, doubts_of
from model.discrepancy.explanation.note_words import note_words
from model.discrepancy.explanation.pattern_words import pattern_words
from model.discrepancy.grounds import ControllerEffect, NamedEffect, Reason, Refusal
from model.discrepancy.numbers import from_to, plain
from model.effects.names import capitalised, effect_on, joints_in_words, placed
from model.record_check.finding import doubts_in, lines_of
from model.units import shown_unit, with_unit

NOTICEABLE = 0.98
"""Ratio of the errors with and without an effect, above which the effect hardly changes the error."""
ALL = 0.95
"""Share of the evidence; with a margin above it, the next best candidate has next to no evidence."""
LEAST_SHOWN = 5e-4
"""Least share of a mean square that is not shown as 0.0 %."""
NO_NOISE_STATED = "and the machine file states no noise of the sensors to compare it with"
PHASES: Mapping[Phase, str] = {
    "ramp_start": "as motion starts",
    "steady_ramp": "in steady motion",
    "reversal": "after reversals",
    "creep": "in slow motion",
    "hold": "at rest",
}


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


def step_with_sentences(step: Step) -> Step:
    """The step with its reason, its place, and why it was refused."""
    update: dict[str, object] = {"where": where_with_summary(step.where)}
    if step.proof is not None:
        update["where"] = step.where.model_copy(update={"summary": sentence(_proof(step))})
    if step.proof is not None or step.reason_data is not None:
        update["reason"] = reason_text(step)
    if step.refusal is not None:
        update["rejected_because"] = refusal_words(step.refusal)
    return step.model_copy(update=update)


def _gap_with_names(gap: Gap) -> Gap:
    """The gap with the names of its stages, and the alternative in words."""
    named = {"given": "model as given", "fitted": "its numbers fitted", "refitted": "everything refitted"}
    stages = tuple(
        s.model_copy(update={"name": named.get(s.kind, f"+ {placed(s.effect or '', s.joints)}")}) for s in gap.stages
    )
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


def where_with_summary(where: Where) -> Where:
    """The place with its summary."""
    if where.worst is None and where.summary != UNWRITTEN:
        return where
    return where.model_copy(update={"summary": sentence(_place(where))})


def sentence(words: str) -> str:
    """A clause as a sentence."""
    return f"{capitalised(words)}."


def reason_text(step: Step) -> str:
    """What speaks for the effect of a step, in one to three sentences, with the numbers of the step as it is now."""
    if step.proof is not None:
        return sentence(f"{_proof(step)}; this needs no model of the arm")
    reason = step.reason_data
    if reason is None:
        return step.reason
    if reason.pattern is None or reason.units is None:
        return sentence(_torque_reason(step, reason))
    others = [j for j in step.joints if j != reason.joint]
    alike = f" (and likewise {joints_in_words(others)})" if others else ""
    called = words_of(step.effect or "").called + _size(step.effect or "", step.parameters, reason.joint or 0)
    seen = f"joint {reason.joint} {pattern_words(reason.pattern, reason.units)}{alike}"
    sentences = [sentence(f"{seen}: {called}{_taken_off(reason)}")]
    if reason.rival is not None:
        sentences.append(sentence(_beaten(reason.rival, step)))
    if step.where.joint is None or (step.joints and step.where.joint not in step.joints):
        sentences.append("What shows it is the pattern over the whole record, not one place.")
    return " ".join(sentences)


def refusal_words(refusal: Refusal) -> str:
    """Why an effect was not taken into the model, as a clause."""
    n = refusal.numbers
    match refusal.kind:
        case "diverges":
            words = "with it, the simulation of the held-out traces does not stay finite"
        case "error-grows":
            words = f"the error on the held-out traces grows, by {n['share']:.0%} of what is beyond noise there"
        case "error-rises":
            words = (
                f"the error on the held-out traces rises: its sum of squares by {n['rise']:.0f} ± {n['deviation']:.0f} "
                "variances of a reading"
            )
        case "falls-too-little":
            change = "does not fall"
            if abs(n["share"]) >= LEAST_SHOWN:
                change = f"falls by only {n['share']:.1%}" if n["share"] > 0.0 else f"grows by {-n['share']:.1%}"
            words = f"on records not fitted to, the mean square {change}"
        case "only-resembles":
            words = (
                "it only resembles what is missing: with all that was found, "
                f"{joints_in_words(refusal.joints)} still {'disagrees' if len(refusal.joints) == 1 else 'disagree'} "
                "beyond noise"
            )
        case "superfluous":
            words = "a later effect explains what it explained"
    return words


def summary(answer: Diagnosis) -> str:
    """The answer in a few sentences: what was not examined, its verdict, its steps and what is left."""
    return " ".join([*map(sentence, not_examined_words(answer.not_examined)), _summary_of(answer)])


def not_examined_words(joints: Sequence[int]) -> list[str]:
    """That joints were not examined, as a clause; none where all were."""
    if not joints:
        return []
    one = len(joints) == 1
    seen = "was not examined: its drive stands at its" if one else "were not examined: their drives stand at their"
    return [f"{joints_in_words(joints)} {seen} largest value for too much of the time"]


def _summary_of(answer: Diagnosis) -> str:
    adopted = [s for s in answer.steps if s.adopted]
    match answer.verdict:
        case "check-the-record":
            return " ".join(lines_of(doubts_in(answer.record)))
        case "nothing-significant" if answer.examined_nothing:
            return "The traces say nothing of the model."
        case "nothing-significant":
            rejected = [s for s in answer.steps if not s.adopted]
            first = rejected[0] if rejected else None
            return _nothing(next(filter(was_taken_back, rejected), first), doubts_of(answer))
        case "suspected":
            return _suspected(answer)
        case "unknown-effect":
            return _unknown(answer)
        case "named" | "ambiguous" | "partly":
            parts = [_undecided(s.group, s.where, answer.inseparable) if s.group else reason_text(s) for s in adopted]
            rest = (
                ["Something is left that none of the known effects explains."]
                if answer.remaining or answer.verdict == "partly"
                else []
            )
            return " ".join([*parts, *rest])


def was_taken_back(step: Step) -> bool:
    """Whether an effect was in the model for a while, and did not explain what it was to explain."""
    return step.refusal is not None and step.refusal.kind == "only-resembles"


def _suspected(answer: Diagnosis) -> str:
    """What is suspected, and how much more of the motion would settle it."""
    if answer.suspicion is None:
        return "Suspected: an effect that these traces do not show clearly."
    return f"Suspected: {suspicion_words(answer.suspicion)}."


def suspicion_words(found: Suspicion) -> str:
    """A suspicion as a clause."""
    return (
        f"{_called(found.effect, found.joints)}, evidence {found.evidence:.0f} of {found.needed:.0f}; "
        f"{found.seconds:.0f} s more of this motion would settle it"
    )


def shape_words(shape: RemainingShape) -> str:
    """A torque that is left, and what it goes with."""
    torques = [t for t in shape.torque if t is not None]
    what = "friction" if shape.against_motion else "a torque"
    return (
        f"{what} at joint {shape.joint} of {plain(min(torques))} to {plain(max(torques))} {shape.torque_unit} that "
        f"goes with {shape.against}{_place_of_most(shape)}"
    )


def _place_of_most(shape: RemainingShape) -> str:
    """Where a torque that goes with the position is largest."""
    if shape.against != "position":
        return ""
    both = zip(shape.torque, shape.centres, strict=True)
    known = [(abs(torque), place) for torque, place in both if torque is not None]
    factor, unit = shown_unit(shape.unit)
    return f", most at {with_unit(plain(max(known)[1] * factor, 3), unit)}"


def what_is_left(remaining: Sequence[RemainingShape]) -> str:
    """What the torque that is left goes with, and whether that is clear enough to invent an effect. A clause."""
    if not remaining:
        return "what is left has no shape against time, position, speed, direction or drive"
    clear = clear_shape(remaining)
    best = remaining[0] if clear is None else clear
    share = f"{100 * best.explained:.0f} % of what is left"
    if clear is not None:
        return f"{shape_words(best)} explains {share}"
    if best.explained < CLEAR_SHAPE:
        return f"no clear shape: the best, {shape_words(best)}, explains only {share}"
    few = f"rests on {best.filled_bins} of the {FEWEST_BINS} bins that a shape needs"
    return f"no clear shape: the best, {shape_words(best)}, explains {share}, but {few}"


def best_tried(candidates: Sequence[Candidate], significant: float) -> str:
    """How near the best of the candidates, none of which was added, has come to the evidence that it needs.

    Args:
        significant: evidence that a candidate needs which does not say what it needs itself: the most for a first one.
    """
    fitted, probed = in_order(candidates)
    best = (fitted or probed)[0]
    name = effect_on(best.effect, best.joints)
    count = "The only candidate" if len(candidates) == 1 else f"The best of {len(candidates)} candidates"
    if not fitted:
        return (
            f"None of the candidates promised enough to be fitted. {count}, {name}, promises evidence of "
            f"{best.evidence:.0f}; an effect is named from {significant:g}."
        )
    told, total = f"{count}, {name}, has evidence of {best.evidence:.0f}", best.total
    if best.evidence_held_out is not None:
        told += f" ({total:.0f} with what held-out traces say)"
    needed = significant if best.needed is None else best.needed
    subject = "an effect is" if best.needed is None else "it would be"
    if total >= needed:
        return f"{told}. It is above the {needed:.3g} from which {subject} named, but takes off no more than noise."
    return f"{told}; {subject} named from {needed:.3g}."


def _nothing(rejected: Step | None, doubts: Sequence[str]) -> str:
    """Why no effect is named.

    Args:
        rejected: a step that was refused on records not fitted to, or taken back.
        doubts: what is left above noise, and what differs from the machine file, as clauses.
    """
    if rejected is None or rejected.effect is None:
        if doubts:
            return f"No known effect has the evidence to be named, though {' and '.join(doubts)}."
        return "Nothing significant: the model explains the traces within noise and stated tolerances."
    if was_taken_back(rejected):
        return (
            f"Nothing is named: {_called(rejected.effect, rejected.joints)} was added, with evidence of "
            f"{rejected.evidence:.0f}, and taken back, because {rejected.rejected_because}. What is left without it "
            "has no shape of an effect."
        )
    because = rejected.rejected_because or "records that were not fitted to do not confirm it"
    return (
        f"No effect holds on records that were not fitted to: {_called(rejected.effect, rejected.joints)} explains "
        f"more of the fitted ones, with evidence of {rejected.evidence:.0f}, but {because}."
    )


def _undecided(group: Sequence[Candidate], where: Where, classes: Sequence[Inseparable]) -> str:
    """Why several effects are named: they explain the same, within what their evidence can tell apart, or on every
    motion."""
    if len(group) < 2:
        raise SpecError(f"{len(group)} candidates cannot be undecided between; at least 2 are needed")
    named = ", ".join(f"{_called(c.effect, c.joints)} ({c.evidence:.0f})" for c in group)
    apart = max(c.evidence for c in group) - min(c.evidence for c in group)
    text = f"{where.summary} These explain it, with evidence that differs by no more than {apart:.0f}: {named}."
    whole = class_of_group(group, classes)
    return text if whole is None else f"{text} {sentence(class_words(whole))}"


def _unknown(answer: Diagnosis) -> str:
    """Why none of the known effects is named, and what a torque that would explain it goes with."""
    where, joints = answer.where, answer.unexplained_joints
    places = [] if where is None else [_left_on(joints, where) if joints and where.joint is None else where.summary]
    parts = [*places, sentence(f"no known effect explains it; {what_is_left(answer.remaining)}")]
    if answer.worse_held_out:
        parts.append(
            "The fit of the tolerance parameters does not hold on held-out traces, where the error of "
            f"{joints_in_words(answer.worse_held_out)} grows: do not use the model after."
        )
    return " ".join(parts)


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


def _place(where: Where) -> str:
    """Where simulation and measurement disagree most, as a clause."""
    worst = where.worst
    if worst is None:
        return "no joint moves"
    phase = PHASES[worst.phase]
    if where.joint is None or worst.rms is None:
        return (
            f"no joint is off by more than noise; the largest residual is that of joint {worst.joint}, "
            f"{worst.ratio:.2f} times its noise {phase}"
        )
    if worst.whole_record or worst.floor is None:
        times = f"{plain(worst.ratio)} times its noise" if worst.ratio < NOISE_UNKNOWN else NO_NOISE_STATED
        seen = f"joint {worst.joint}, mostly {phase}: {plain(worst.rms, 3)} {worst.unit} rms, {times}"
        largest = where.largest
        if largest is None or largest.rms is None:
            return seen
        return f"{seen}; more is left of joint {largest.joint}, {plain(largest.rms, 3)} {largest.unit} rms"
    return f"joint {worst.joint}, {phase}: {worst.rms:.2g} {worst.unit} rms against a floor of {worst.floor:.2g}"


def _proof(step: Step) -> str:
    """What the controller's own recorded numbers prove, as a clause."""
    assert step.proof is not None
    joint, samples, of = step.joints[0], step.proof.samples, step.proof.of
    if step.effect == ControllerEffect.WRONG_GAIN:
        ratio = 1 + next(iter(step.parameters.values())).value
        share = f"{samples} of {of} samples"
        return f"joint {joint}: the recorded power is {ratio:.3f} times the gain times the recorded error ({share})"
    return (
        f"joint {joint}: the recorded error is not set point − position in {samples} samples, so set points were lost"
    )


def _torque_reason(step: Step, reason: Reason) -> str:
    """What speaks for an effect in a balance of torques."""
    place = f"{joints_in_words(step.joints)}: " if step.joints else ""
    seen = shape_in_torques(step.effect or "", slides=reason.slides)
    several = len(step.joints) > 1
    sizes = ", ".join(_torque_size(v, several=several, slides=reason.slides) for v in step.parameters.values())
    if reason.removed is None:
        return f"{place}{seen} ({sizes})"
    gone = percent_gone(reason.removed, 0)
    return f"{place}{seen} ({sizes}); it takes {gone} off the mean square on records not fitted to"


def _torque_size(value: FoundValue, *, several: bool, slides: bool) -> str:
    on = f" of {joints_in_words(value.joints)}" if several and value.joints else ""
    unit = "" if value.unit == "1" else f" {value.unit}"
    if value.part == "cycles":  # rad of phase per rad (m): cycles a turn, or 2π times those a metre
        unit = f" rad/m, {plain(value.value / (2 * math.pi), 3)} a metre" if slides else " a turn"
    return f"{value.part}{on} {plain(value.value, 3)}{unit}"


def _taken_off(reason: Reason) -> str:
    if reason.rms is None:
        return ""
    before, after, unit = reason.rms.before, reason.rms.after, reason.rms.unit
    if after > NOTICEABLE * before:
        return f", which hardly changes its rms error: it stays near {plain(after)} {unit}"
    first, last = from_to(before, after)
    return f", which takes its rms error from {first} to {last} {unit}"


def _beaten(rival: NamedEffect, step: Step) -> str:
    """How far the next best candidate is behind."""
    if step.margin >= ALL * step.evidence:
        return f"no other fitted candidate has a twentieth of its evidence of {step.evidence:.0f}"
    name = _called(rival.effect, rival.joints)
    if rival.evidence > step.evidence:  # it was ranked first, but came to less when its fit was taken to its end
        return (
            f"its completed fit has evidence of {step.evidence:.0f}, less than the {rival.evidence:.0f} of {name}: "
            "these traces do not tell which of the two it is"
        )
    return f"the next best, {name}, has evidence of {rival.evidence:.0f}, and this has {step.evidence:.0f}"


def _size(effect: str, parameters: Mapping[str, FoundValue], joint: int) -> str:
    """“, 0.93° (0.90 to 0.96)”, or nothing where the effect has no single size."""
    value = size_of(effect, parameters, joint)
    return "" if value is None else f", {size_words(value)}"


def size_words(value: FoundValue) -> str:
    """“0.93° (0.90 to 0.96)”: an estimate in the units that people read, with its interval if it has one."""
    factor, unit = {"rad": (math.degrees(1.0), "°"), "1": (100.0, " %"), "s": (1e3, " ms"), "H": (1e3, " mH")}.get(
        value.unit, (1.0, f" {value.unit}")
    )
    interval = ""
    if value.low is not None and value.high is not None:
        interval = f" ({plain(value.low * factor, 3)} to {plain(value.high * factor, 3)})"
    return f"{plain(value.value * factor, 3)}{unit}{interval}"


def removed_words(share: float) -> str:
    """The share of the held-out variance beyond noise that a step removed: all of it, where the error is below its
    floor. A clause."""
    if share < 0:
        return f"the held-out variance beyond noise has grown by {-100 * share:.1f} %"
    return f"{percent_gone(share, 1)} of the held-out variance beyond noise is gone"


def percent_gone(share: float, places: int) -> str:
    """A share in percent; “all” for all of it. A share below all is never rounded up to 100 %."""
    if share >= 1.0:
        return "all"
    return f"{min(100 * share, 100 - 10**-places):.{places}f} %".replace("-", "−")


def not_a_finding(answer: Diagnosis, where: Where) -> str:
    """Why a residual that goes with something is no finding; empty where the answer names one."""
    if answer.verdict != "nothing-significant":
        return ""
    certain = "σ says how certain the dependence is, not how large: no joint is off by more than noise. "
    last = [c for c in answer.candidates if c.refitted]
    tried = sorted([*last, *(c for s in answer.steps for c in s.candidates)], key=lambda c: -c.total)[:1]
    line = next((c.needed for c in tried if c.needed is not None), answer.significant)
    needed = [] if line is None else [f"an effect is named from evidence {line:.0f} on"]
    best = [f"the best, {placed(c.effect, c.joints)}, has evidence {c.total:.0f}" for c in tried]
    because = f": {'; '.join((*needed, *best))}" if needed or best else ""
    return f"{'' if where.joint is not None else certain}This is not a finding{because}."


def _called(effect: str, joints: Sequence[int]) -> str:
    called = words_of(effect).called
    return f"{called} on {joints_in_words(joints)}" if joints else called


def _experiment_with_reason(asked: NextExperiment) -> NextExperiment:
    if asked.information is not None:
        words = (
            f"{asked.description}: it excites what these traces do not, and would add {asked.information:.0f} nats of "
            "information on the arm's parameters"
        )
    elif asked.differs_at is not None:
        first, second = asked.hardest
        words = (
            f"{asked.description}: {first} and {second} would differ by {asked.predicted_separation:.1f} standard "
            f"deviations with the other parameters refitted, {_most_of_it(asked.differs_at)}"
        )
    else:
        return asked
    return asked.model_copy(update={"reason": sentence(words)})


def _most_of_it(at: DifferencePlace) -> str:
    joint = f"on joint {at.joint} " if at.other_joint else ""
    return f"{100 * at.share:.0f} % of it {joint}{PHASES[at.phase]}"
