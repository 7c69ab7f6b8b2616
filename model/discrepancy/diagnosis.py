"""The answer of a diagnosis: stable, typed, and JSON as it stands. docs/diagnosis-json.md describes every field."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.frozen import FrozenRecord
from model.discrepancy.grounds import ControllerProof, Measurement, Method, Note, Reason, Refusal, SharedLaw
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter
from model.record_check.finding import RecordFinding

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ANSWER_FORMAT = 1
"""Version of the answer; a reader refuses newer ones."""

Verdict = Literal[
    "nothing-significant", "named", "ambiguous", "partly", "suspected", "unknown-effect", "check-the-record"
]
"""`partly`: effects are named, alone or in groups, and far more than noise is left on their joints."""
Phase = Literal["ramp_start", "steady_ramp", "reversal", "creep", "hold"]
AgainstWhat = Literal["time", "position", "speed", "direction", "drive"]
UNWRITTEN = ""
"""A sentence that the renderer writes once the answer is complete."""

CLEAR_SHAPE = 0.4
"""Least share of the remaining torque's variance that a dependence must explain to count as a shape that a person could
write an effect after, and to say that a law is another one."""
FEWEST_BINS = 5
"""Bins with a torque that such a shape needs: two or three values are no curve. Directions are never more than
three."""


class FoundValue(FrozenRecord):
    """One parameter of an added effect: estimate and 95 % interval; no interval where the data do not bound it.

    `part` says which number of the effect it is, `joints` to which joints it belongs (none: to the whole machine).
    """

    value: float
    low: float | None
    high: float | None
    unit: str
    part: str = ""
    joints: tuple[int, ...] = ()

    @classmethod
    def of(cls, p: Parameter, value: float, low: float | None = None, high: float | None = None) -> FoundValue:
        """An estimate of a parameter."""
        return cls(value=value, low=low, high=high, unit=p.unit, part=p.part, joints=p.joints)


class Candidate(FrozenRecord):
    """An effect that was tried.

    `evidence` is the fall of −2 log posterior less the cost of its own parameters (BIC; for a tone's frequency the
    number of tones tried); above 0 it explains more than it costs. `misfit` is the mean square of the weighted residual
    that it leaves: near 1 for the right effect. `refitted` says whether all tolerance parameters were fitted again with
    it, or it was only probed.
    """

    effect: str
    joints: tuple[int, ...]
    evidence: float
    misfit: float | None = None
    refitted: bool = False
    parameters: dict[str, FoundValue] = {}
    evidence_held_out: float | None = None
    """What held-out traces say for it, which decides together with `evidence`, with nothing fitted to them: counted as
    for the other candidates, and where `needed` is told, by itself. By torques; None where there are none."""
    needed: float | None = None
    """Sum of both from which it would be named: by torques, of the best candidate of a step that added nothing."""

    @property
    def total(self) -> float:
        """What all traces say for it, as evidence."""
        return self.evidence + (self.evidence_held_out or 0.0)


class SignalError(FrozenRecord):
    """Root mean square of measurement − simulation of one joint. `floor`: of the measurement's own noise."""

    joint: int
    unit: str
    before: float
    after: float
    floor: float


class GapStage(FrozenRecord):
    """The error of one model on the way from the given to the resulting one: root mean square by joint of the `Gap`, on
    traces fitted to and on held-out ones (empty without any); None where it is not finite.

    `kind`: the model as given; with `effect` on `joints` added to the stage before, and its numbers fitted within one
    stated deviation of the machine file; with everything refitted. Without an effect: with its numbers `fitted`.
    """

    kind: Literal["given", "fitted", "effect", "refitted"]
    name: str = UNWRITTEN
    """For a list, in words."""
    effect: str | None = None
    joints: tuple[int, ...] = ()
    fitted: tuple[float | None, ...]
    held_out: tuple[float | None, ...] = ()


class GapNumber(FrozenRecord):
    """A number of the machine file: as `stated`, with its `deviation`; what it would have had to become `without` the
    effects; and with them (`fitted`). All in `unit`."""

    name: str
    unit: str
    stated: float
    deviation: float
    without: float
    fitted: float


class GapWithout(FrozenRecord):
    """What the numbers alone would make of the records, without any effect: errors as in a stage, and the numbers that
    would have had to move by more than a stated deviation, the furthest first."""

    fitted: tuple[float | None, ...]
    held_out: tuple[float | None, ...] = ()
    numbers: tuple[GapNumber, ...] = ()
    text: str = UNWRITTEN
    """The same in words."""


class Gap(FrozenRecord):
    """The gap between simulation and measurement, and how it shrinks from stage to stage.

    `measure`: of the closed loop, simulated from set points and initial posture alone, or of the balance of torques.
    `units`, `noise`, `most` by joint: what noise leaves of a right model in this measure, and the most that may be
    noise (empty in results of older versions). `without`: the alternative to the effects; None where none was added.
    """

    measure: Literal["closed-loop", "torques"]
    joints: tuple[int, ...]
    units: tuple[str, ...]
    noise: tuple[float, ...]
    most: tuple[float, ...] = ()
    stages: tuple[GapStage, ...]
    without: GapWithout | None = None


class PhaseCell(FrozenRecord):
    """One cell of the map of disagreement: mean square of the weighted residual (1: no more than noise) of a joint in
    a stretch of time and phase of motion; `significance` in standard deviations."""

    joint: int
    start: float
    end: float
    phase: Phase
    mean_square: float
    significance: float
    trace: int = 0


class Dependence(FrozenRecord):
    """Mean residual of a joint against a quantity, in bins: what a person would plot."""

    joint: int
    against: AgainstWhat
    unit: str
    centres: tuple[float, ...]
    residual: tuple[float | None, ...]
    deviation: tuple[float | None, ...]
    significance: float


class WorstPlace(FrozenRecord):
    """The joint and phase of motion with the largest residual, `ratio` times its noise. `rms`, `floor`: of the residual
    and of the noise, in `unit`, in that phase or over the `whole_record`."""

    joint: int
    phase: Phase
    ratio: float
    rms: float | None = None
    floor: float | None = None
    unit: str = ""
    whole_record: bool = False


class Where(FrozenRecord):
    """Where simulation and measurement disagree, for a step before it: a one-line summary, and the numbers behind it.

    `joint`, `phase`: where they disagree most; None where it is no more than noise, which `worst` then tells. Most is
    by the noise of each joint; in torques, `largest` is the joint with the largest residual, where it is another.
    """

    joint: int | None
    phase: Phase | None
    summary: str
    cells: tuple[PhaseCell, ...]
    dependences: tuple[Dependence, ...]
    worst: WorstPlace | None = None
    largest: WorstPlace | None = None


class RemainingShape(FrozenRecord):
    """What none of the known effects explains, as a torque at a joint against something, so that a person can invent
    the effect: torque (N·m, N) in bins of `against`, with its standard deviation.

    against_motion: the torque is counted against the direction of motion, as friction acts: where it goes with
    position, a joint rubs more at some places.
    """

    joint: int
    against: AgainstWhat
    unit: str
    torque_unit: str
    centres: tuple[float, ...]
    torque: tuple[float | None, ...]
    deviation: tuple[float | None, ...]
    explained: float
    """Share of the remaining torque's variance that this dependence explains."""
    against_motion: bool = False

    @property
    def quantity(self) -> str:
        """What the torque goes with, in words."""
        return f"{self.against}, against the motion" if self.against_motion else self.against

    @property
    def filled_bins(self) -> int:
        """Bins in which a torque is known."""
        return sum(torque is not None for torque in self.torque)


class Step(FrozenRecord):
    """One step of the workflow: what was found, what adding it did. `reason` and `rejected_because` are written from
    the data beside them."""

    effect: str | None
    joints: tuple[int, ...]
    parameters: dict[str, FoundValue]
    """By the parameter's full name, as in the model."""
    evidence: float
    margin: float
    """Evidence of the answer over the next best that would be another answer."""
    candidates: tuple[Candidate, ...]
    group: tuple[Candidate, ...] = ()
    """Candidates that the data cannot tell apart, when the verdict is `ambiguous`."""
    rmse_fit: tuple[SignalError, ...]
    rmse_holdout: tuple[SignalError, ...] = ()
    excess_removed_holdout: float | None = None
    """Share of the held-out variance above the noise floor that the step removed; in torques of the joints that it
    improved on the fitted traces."""
    evidence_held_out: float | None = None
    """2 ln of the ratio of the likelihoods of held-out traces with and without the effect; in torques alone."""
    where: Where
    reason: str
    adopted: bool
    rejected_because: str | None = None
    reason_data: Reason | None = None
    proof: ControllerProof | None = None
    """Where the controller's own recorded numbers prove the effect: nothing was fitted for it, and it has no errors."""
    refusal: Refusal | None = None


class DifferencePlace(FrozenRecord):
    """Where two candidates would differ most on an experiment: `share` of the difference's square is there.
    `other_joint`: it is not the joint of the effect."""

    joint: int
    phase: Phase
    share: float
    other_joint: bool


class NextExperiment(FrozenRecord):
    """The experiment that best separates what is left, within the arm's limits."""

    name: str
    spec: ExperimentSpec
    duration: float
    """s"""
    separates: tuple[str, ...]
    predicted_separation: float
    """Standard deviations between the two candidates that are hardest to tell apart, tolerance parameters refitted; 0
    where there are no candidates to separate."""
    reason: str
    description: str = ""
    """What the experiment does."""
    hardest: tuple[str, ...] = ()
    """The two candidates that are hardest to tell apart."""
    differs_at: DifferencePlace | None = None
    information: float | None = None
    """nats that it would add on the arm's parameters, where there are no candidates to separate."""


class PlacedEffect(FrozenRecord):
    """An effect on joints; none: of the whole machine."""

    effect: str
    joints: tuple[int, ...]


class Inseparable(FrozenRecord):
    """Candidates that no admissible motion tells apart: one class of effects.

    `separation`: the most that any of the `tried` motions set two of them apart, in deviations, and on which
    `experiment`; a motion that tells them apart would have `needed`. `shares`: the law that they have in common, None
    where none is known that all of them have. `told_by`: measurements that would tell them; empty without such a law.
    """

    members: tuple[PlacedEffect, ...]
    separation: float
    needed: float
    experiment: str
    tried: int
    shares: SharedLaw | None = None
    told_by: tuple[Measurement, ...] = ()


class Suspicion(FrozenRecord):
    """An effect that more of the same motion would show or refute: its evidence, held-out records included, the
    evidence `needed` to name it, and the `seconds` that are still to be recorded for that."""

    effect: str
    joints: tuple[int, ...]
    evidence: float
    needed: float
    seconds: float


class Acquired(FrozenRecord):
    """An experiment that was asked for and run in the course of the diagnosis."""

    experiment: str
    trace: str
    file: str
    outcome: str
    """How the run ended: `complete`, or as `daq run` says; only complete runs are used."""
    duration: float
    """s of robot time."""
    reason: str


class Diagnosis(FrozenRecord):
    """The whole answer."""

    shown: ClassVar[tuple[str, ...]] = ("verdict", "summary", "traces", "holdout")
    format: Annotated[int, Field(ge=1)] = ANSWER_FORMAT
    verdict: Verdict
    summary: str
    significant: float | None = None
    """Evidence from which a first effect is named."""
    steps: tuple[Step, ...]
    rmse_fit: tuple[SignalError, ...] = ()
    """Errors on the fitted traces, of the model as given and of the resulting model."""
    rmse_holdout: tuple[SignalError, ...] = ()
    """Errors on the held-out traces, likewise."""
    gap: Gap | None = None
    """How the gap between simulation and measurement shrinks; None where nothing was computed."""
    where: Where | None = None
    """What is left in the end: the map and dependences of the model that comes out; None where nothing was computed."""
    candidates: tuple[Candidate, ...] = ()
    """The ranking of the last step, where nothing was added in it: what was tried against what is left."""
    remaining: tuple[RemainingShape, ...] = ()
    next_experiment: NextExperiment | None = None
    inseparable: tuple[Inseparable, ...] = ()
    """Candidates that no motion within the limits tells apart, class by class."""
    acquired: tuple[Acquired, ...] = ()
    """Experiments that were asked for and run, in order; their traces are among `traces`."""
    model_before: Model
    model_after: Model
    traces: tuple[str, ...]
    holdout: tuple[str, ...] = ()
    seconds: float
    robot_seconds: float
    notes: tuple[str, ...] = ()
    """Assumptions and limits that a reader of this answer should know."""
    notes_data: tuple[Note, ...] = ()
    """The data of `notes`, in the same order."""
    method: Method = "output-error"
    suspicion: Suspicion | None = None
    """Where the verdict is `suspected`; by inverse dynamics alone."""
    unexplained_joints: tuple[int, ...] = ()
    """Joints on which more is left than noise, where the verdict is `unknown-effect`."""
    worse_held_out: tuple[int, ...] = ()
    """Joints whose held-out error grew although no effect was added: the tolerance parameters were fitted wrongly."""
    record: tuple[RecordFinding, ...] = ()
    """What the records, or the machine file beside them, say that cannot be, or should be known. Where there are
    doubts, the verdict is `check-the-record`."""
    not_examined: tuple[int, ...] = ()
    """Joints of which no fitted trace tells anything, since their drives stand at limits: the answer is not of them."""

    @property
    def computed(self) -> bool:
        """Whether anything was computed: not of records that are to be checked first."""
        return self.verdict != "check-the-record" or self.gap is not None

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws how the error of each joint shrinks from stage to stage, as a share of the given model's; dashed on
        held-out traces. `ax`: None for new axes. Raises SpecError where no gap was computed."""
        from daq.contracts.notebook_figure import axes_of

        if self.gap is None:
            raise SpecError("plot: this diagnosis has no gap to draw: " + self.summary)
        axes, stages = axes_of(ax), self.gap.stages
        for place, joint in enumerate(self.gap.joints):
            for style, rows in (("-o", [s.fitted for s in stages]), ("--o", [s.held_out for s in stages])):
                errors = [row[place] if row else None for row in rows]
                if (first := errors[0]) and any(errors):
                    shares = [float("nan") if e is None else e / first for e in errors]
                    label = f"joint {joint}{', held out' if style == '--o' else ''}"
                    axes.plot(shares, style, label=label, color=f"C{place}", mfc="none" if style == "--o" else None)
        axes.set_xticks(range(len(stages)), [stage.name for stage in stages], rotation=20, ha="right")
        axes.set_ylim(bottom=0.0)
        axes.set_ylabel("error / error of the given model")
        axes.legend()
        return axes

    @property
    def examined_nothing(self) -> bool:
        """Whether no joint could be examined, so that nothing follows from nothing having been found."""
        return set(self.not_examined) >= set(self.model_before.machine.modelled_joints)


def in_order(candidates: Sequence[Candidate]) -> tuple[list[Candidate], list[Candidate]]:
    """The fitted candidates and those that were only probed, each by what all traces say for them, the best first.

    The two kinds are not comparable: a fit shows what a candidate takes off the residual, a probe extrapolates it.
    """
    best_first = sorted(candidates, key=lambda c: -c.total)
    return [c for c in best_first if c.refitted], [c for c in best_first if not c.refitted]


def clear_shape(found: Sequence[RemainingShape]) -> RemainingShape | None:
    """The dependence that explains most, of those clear enough to be called a shape; None where there is none."""
    clear = [
        s for s in found if s.explained >= CLEAR_SHAPE and (s.against == "direction" or s.filled_bins >= FEWEST_BINS)
    ]
    return max(clear, key=lambda s: s.explained, default=None)
