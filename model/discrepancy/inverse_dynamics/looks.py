"""The answer of torques below several cutoffs, each of which shows what the others do not."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property

from daq.contracts.errors import SpecError
from daq.contracts.progress import Cancel, Progress, part_of
from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import Diagnosis, Step
from model.discrepancy.explanation.notes import on_unfinished
from model.discrepancy.grounds import Note
from model.discrepancy.inverse_dynamics.case import TorqueCase
from model.discrepancy.inverse_dynamics.judged_controller import JudgedController
from model.discrepancy.inverse_dynamics.left_over import FRICTION
from model.discrepancy.inverse_dynamics.options import TorqueOptions
from model.discrepancy.inverse_dynamics.workflow import TorqueWorkflow
from model.effects.library import find_named_effect
from model.inverse_dynamics.readings import choose_cutoff
from model.inverse_dynamics.recorded_motion import SHORTEST, recorded_motions
from model.inverse_dynamics.repeats import noise_left
from model.inverse_dynamics.shaking import find_shaking
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model

LOOKS = (1.0, 1 / 2, 1 / 3)
"""Cutoffs of the torques that are compared, as shares of the highest that accelerations bear, in turn until something
is found that has one name. The noise's variance grows with the fifth power of the cutoff, and slow effects, such as a
sensor's scale, show below a lower one as well; gears that give and delays show below the highest alone."""
JUMPING = frozenset({"amplifier_threshold", "dead_zone", "gear_loss", "direction_dependent_gear_loss", "supply_limit"})
"""Effects that are no friction, and whose torque jumps as friction's does, where motion or drive turns, or breaks off
where the drive is at its limit."""
LONG = 20.0
"""Least duration of a record for a lower cutoff, in periods of that cutoff."""


@dataclass(frozen=True)
class Look:
    """What torques of some records showed below one cutoff (Hz)."""

    workflow: TorqueWorkflow
    records: Records
    cutoff: float

    @cached_property
    def answer(self) -> Diagnosis:
        """What is said of it, without its sentences and the time that it took."""
        traces, held = self.records.traces, self.records.held_out
        fitted, checked = ([t.record.trace_id for t in some] for some in (traces, held))
        robot = sum(float(t.time[-1] - t.time[0]) for t in traces)
        return self.workflow.answer(fitted, checked, self.cutoff).model_copy(update={"robot_seconds": robot})


def first_finding(records: Records, progress: Progress) -> Look:
    """What is seen below the cutoff that was asked for, or else below those that accelerations bear.

    Raises:
        TraceError, SpecError: for traces that cannot be compared in torques, or in which nothing moves beyond the noise
            of its readings. CancelledError: when asked to end.
    """
    if records.options.cutoff is not None:
        return records.below(records.options.cutoff, progress)
    return _first_below(records, records.highest_cutoff, progress)


def _first_below(records: Records, highest: float, progress: Progress) -> Look:
    """What is seen below the highest cutoff (Hz). Where nothing is found there, what the first lower one shows that
    names an effect which lower cutoffs show as well; where groups are found, what the first lower one shows that tells
    them apart. Lower cutoffs are not looked at where drives stand at limits that no file states: what is lacking there
    is smeared over more of the record, and looks like a spring or a slow ripple.
    """
    found: list[Look] = []
    for k, share in enumerate(LOOKS):
        if found and (_at_limits(found[0].answer) or not records.bears(share * highest)):
            break
        found.append(records.below(share * highest, part_of(progress, k / len(LOOKS), (k + 1) / len(LOOKS))))
        first, last = found[0].answer, found[-1].answer
        if first.verdict == "ambiguous" and not _jumps_anywhere(first):
            if _tells_apart(last, first):
                return found[-1]
        elif _finds(first) or _names_slow_effects(last):
            return found[-1]
    return found[0]


def _at_limits(answer: Diagnosis) -> bool:
    """Whether drives stand at limits that no file states."""
    return any(note.kind == "drive-at-limit" for note in answer.notes_data)


def _finds(answer: Diagnosis) -> bool:
    """Whether anything is found in torques, beside what the controller's own numbers prove."""
    proved_alone = all(step.proof is not None for step in answer.steps if step.adopted)
    return answer.verdict == "unknown-effect" or not proved_alone


def _names_slow_effects(answer: Diagnosis) -> bool:
    """Whether effects are named, all of which lower cutoffs show as well."""
    named = answer.verdict in ("named", "ambiguous", "partly") and bool(found_in_torques(answer))
    return named and not _jumps_anywhere(answer)


def _jumps_anywhere(answer: Diagnosis) -> bool:
    """Whether any effect of an answer may jump, as friction does where motion turns: that is smeared below a low
    cutoff, and what is left of it looks like friction of another size, or like an amplifier."""
    return any(_jumps(name) for step in found_in_torques(answer) for name in names_of(step))


def _tells_apart(answer: Diagnosis, first: Diagnosis) -> bool:
    """Whether an answer gives one name to every step of the first one, of those that the step left open: the noise of
    slow torques is small, so that they tell a sensor from a spring where the same record's fast ones do not."""
    last, before = found_in_torques(answer), found_in_torques(first)
    if answer.verdict != "named" or len(last) != len(before):
        return False

    def is_of(one: Step, group: Step) -> bool:
        return set(one.joints) == set(group.joints) and names_of(one) <= names_of(group)

    return all(any(is_of(one, group) for group in before) for one in last) and all(
        any(is_of(one, group) for one in last) for group in before
    )


def found_in_torques(answer: Diagnosis) -> list[Step]:
    """The adopted steps but for those that the controller's own numbers prove."""
    return [step for step in answer.steps if step.adopted and step.proof is None]


def names_of(step: Step) -> set[str]:
    """The name that a step gives, or those of its group."""
    return {name for name in (step.effect, *(member.effect for member in step.group)) if name is not None}


def _jumps(name: str) -> bool:
    return name in JUMPING or find_named_effect(name).shared_name.family == FRICTION


@dataclass(frozen=True)
class Records:
    """What a diagnosis is of: traces to fit to, and others that are held out."""

    model: Model
    traces: tuple[Trace, ...]
    held_out: tuple[Trace, ...]
    options: TorqueOptions
    controller: JudgedController
    cancel: Cancel

    def bears(self, cutoff: float) -> bool:
        """Whether every record lasts long enough for a cutoff (Hz)."""
        return all(t.time[-1] - t.time[0] >= max(SHORTEST, LONG / cutoff) for t in (*self.traces, *self.held_out))

    @property
    def highest_cutoff(self) -> float:
        """The cutoff that was asked for, or the highest one that accelerations of the traces to fit to bear, Hz.

        Raises SpecError where nothing moves beyond the noise of its readings.
        """
        return self.options.cutoff or choose_cutoff(self.traces, self.model.machine)

    def below(self, cutoff: float, progress: Progress) -> Look:
        """What torques below a cutoff (Hz) show.

        Raises:
            TraceError, SpecError: for traces that cannot be compared below it. CancelledError: when asked to end.
        """
        model = self.model
        progress(0.0, f"low-passing the records at {cutoff:g} Hz")
        records = recorded_motions(self.traces, model.machine, cutoff)
        balance = TorqueBalance(model, records)
        case = TorqueCase(
            records,
            recorded_motions(self.held_out, model.machine, cutoff),
            noise_left(model, self.traces, balance, cutoff),
            self.options,
        )
        steps = TorqueWorkflow(model, case, self.controller, progress, self.cancel)
        steps.run()
        steps.notes += on_unfinished((*self.traces, *self.held_out))
        steps.notes += self._on_shaking()
        return Look(steps, self, cutoff)

    def _on_shaking(self) -> tuple[Note, ...]:
        """A warning about joints that shake faster than torques can be compared; none where none does."""
        try:
            cutoff = choose_cutoff(self.traces, self.model.machine)
        except SpecError:  # nothing moves beyond noise, and a cutoff was asked for
            return ()
        shaking = find_shaking((*self.traces, *self.held_out), self.model.machine, cutoff)
        values = {"cutoff": cutoff, "joints": [asdict(one) for one in shaking]}
        return (Note(kind="shakes-above-cutoff", values=values, warning=True),) if shaking else ()
