"""The whole workflow: where, what, add, show, and again until nothing significant is left."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import TraceError
from daq.contracts.machine import NoController
from daq.contracts.progress import Cancel, Never, Progress, silent
from daq.contracts.trace import Trace
from model.discrepancy import reasons
from model.discrepancy.answer import (
    Candidate,
    Diagnosis,
    FoundValue,
    RemainingShape,
    SignalError,
    Step,
    Verdict,
    Where,
)
from model.discrepancy.candidates import OF_THE_CONTROLLER
from model.discrepancy.controller_check import ControllerFinding, check_controller, with_used_set_points
from model.discrepancy.decision import Added, Decision, decide
from model.discrepancy.distortion import sum_of_contributions
from model.discrepancy.estimates import found_values, listed, only_probed, runner_up
from model.discrepancy.excess import excess_removed
from model.discrepancy.holdout import HeldOut, errors, held_out
from model.discrepancy.next_experiment import Asked, Asker, rivals_of
from model.discrepancy.noise_floor import noise_floor
from model.discrepancy.observation import Observation, Signals, observed
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.probing import Probed
from model.discrepancy.ranking import Ranking, ranked
from model.discrepancy.reasons_samples import Left
from model.discrepancy.refitting import Judged, Refitted, deeper, judge
from model.discrepancy.remaining import shapes
from model.discrepancy.search import Point, point_at, searched, settled
from model.discrepancy.thresholds import THRESHOLDS, Thresholds
from model.discrepancy.verdict import first_to_withdraw, unexplained, verdict, withdrawn
from model.discrepancy.where import located
from model.fitting.unknowns import Unknown
from model.machine_model.model import Lineage, Model

Floats = NDArray[np.float64]

FIRST_STEPS, LAST_STEPS = 6, 4
"""Of a search before and after its derivatives are computed anew."""


@dataclass(frozen=True)
class _Case:
    """What stays the same during a diagnosis."""

    observation: Observation
    floor: Floats
    held: HeldOut | None
    floor_held: Floats
    traces: tuple[Trace, ...]
    options: DiagnosisOptions
    thresholds: Thresholds
    excluded: tuple[str, ...]
    names: tuple[str, ...]


def diagnose(
    model: Model, traces: Sequence[Trace], holdout: Sequence[Trace] = (), options: DiagnosisOptions | None = None,
    progress: Progress = silent, cancel: Cancel | None = None, ask: Asker | None = None,
) -> Diagnosis:  # fmt: skip
    """Where a model and traces disagree, which effects are missing, and what adding them brings.

    On a machine with a controller its loop is simulated from the recorded set points; without one, or where the traces
    have no set points, the recorded drive is balanced against the motion in torques. `ask` says what may be run next
    on a machine with a controller; without it, nothing is proposed.

    Raises:
        TraceError, SpecError: for traces or options that cannot give an answer; one line says why.
        CancelledError: when asked to end.
    """
    options, cancel, begun = options or DiagnosisOptions(), cancel or Never(), time.perf_counter()
    _refuse_shared(traces, holdout)
    if isinstance(model.machine.controller, NoController) or any(t.set_point is None for t in traces):
        from model.discrepancy.torque_space.diagnose import diagnose_torques  # here: rigs with a controller need none

        return diagnose_torques(model, traces, holdout, options, progress, cancel)
    progress(0.0, "checking the controller's own numbers")
    findings = check_controller(traces, model.machine)
    known = _with_findings(model, findings)
    traces, holdout = tuple(_used(t, findings) for t in traces), tuple(_used(t, findings) for t in holdout)
    progress(0.02, "fitting the tolerance parameters")
    observation, wider, unknowns = observed(known, traces)
    given = _given(observation, wider, unknowns)
    point = _tolerances(observation, given)
    case = _case(observation, held_out(known, holdout), point, traces, options)
    steps = [_controller_step(model, observation, f) for f in findings]
    current, answered = judge(observation, point), None
    first, passed = current, [current] * len(findings)
    rivals: tuple[Refitted, ...] = ()
    probes: tuple[Probed, ...] = ()
    while answered is None:
        number = len(steps) - len(findings)
        share = 0.1 + 0.8 * number / options.most_steps
        joints = _to_search(case, current, number)
        turn, current = _ranked_in(case, current, joints, share, progress, cancel, probes)
        probes = (*probes, *turn.probed)
        taken = [Added(s.effect, s.joints, s.evidence) for s in steps[len(findings) :] if s.adopted]
        decision = decide(turn, case.thresholds, taken)
        step, following = _turn(case, current, turn, decision)
        if step is not None:
            steps.append(step)
            passed.append(current)
            rivals = rivals_of(turn, decision) or rivals
        current = following
        if step is None or not step.adopted or step.group or number + 1 == options.most_steps:
            left = _unexplained(case, model, first, current, steps)
            answered = verdict(steps, step, left)
    progress(0.95, "writing the answer")
    remaining: tuple[RemainingShape, ...] = ()
    if answered == "unknown-effect":
        wrong = first_to_withdraw(steps, left, len(findings))
        if wrong is not None:
            current, steps = passed[wrong], [*steps[:wrong], *(withdrawn(s, left) for s in steps[wrong:])]
        remaining = _remaining(case, current.point)
    asked = Asked(None) if ask is None else ask.after(answered, observation, current.point, rivals, traces)
    answer = Diagnosis(
        verdict=answered, summary=_summary(case, current, answered, steps, remaining),
        steps=tuple(steps), remaining=remaining,
        model_before=model, model_after=_adopted(model, current.point, case.names),
        traces=case.names, holdout=tuple(t.record.trace_id for t in holdout),
        rmse_fit=errors(observation, model, given.residuals, current.point.residuals, case.floor),
        rmse_holdout=_held_errors(case, model, *_held(case, given, current.point)),
        significant=case.thresholds.significant, seconds=time.perf_counter() - begun,
        robot_seconds=float(sum(t.time[-1] - t.time[0] for t in traces)),
        notes=_notes(case) + (() if asked.note is None else (asked.note,)), next_experiment=asked.experiment,
    )  # fmt: skip
    progress(1.0, "done")
    return answer


def _case(
    observation: Observation, held: HeldOut | None, point: Point, traces: tuple[Trace, ...], options: DiagnosisOptions
) -> _Case:
    recorded = all(t.error is not None and t.power_raw is not None for t in traces)
    return _Case(
        observation, noise_floor(observation, point), held, np.zeros(0) if held is None else held.floor(point), traces,
        options, THRESHOLDS, OF_THE_CONTROLLER if recorded else (), tuple(t.record.trace_id for t in traces),
    )  # fmt: skip


def _refuse_shared(traces: Sequence[Trace], holdout: Sequence[Trace]) -> None:
    """Raises TraceError for a trace that would be fitted to and held out at once."""
    for trace in holdout:
        if any(trace.record.trace_id == other.record.trace_id for other in traces):
            raise TraceError(
                f"trace {trace.record.trace_id}: is both fitted to and held out; what is held out must be another trace"
            )


def _used(trace: Trace, findings: Sequence[ControllerFinding]) -> Trace:
    """The trace with the set points that were not lost, where some were: what they did is known to the count."""
    return with_used_set_points(trace) if any(f.effect == "lost_set_points" for f in findings) else trace


def _with_findings(model: Model, findings: Sequence[ControllerFinding]) -> Model:
    """The model with the gains that the records prove."""
    for finding in findings:
        if finding.effect == "wrong_gain":
            model = model.with_effect("wrong_gain", (finding.joint,), {"relative": finding.value})
    return model


def _given(observation: Observation, model: Model, unknowns: Sequence[Unknown]) -> Point:
    """The model as it was given, with its derivatives. Effects proved by the controller's numbers stay as they are."""
    free = tuple(u for u in unknowns if ".wrong_gain." not in u.name)
    values = np.array([u.start for u in free])
    return point_at(observation, model, free, values, observation.quiet)


def _tolerances(observation: Observation, given: Point) -> Point:
    """The tolerance parameters fitted to the end: what they leave undone would look like an effect."""
    return settled(observation, searched(observation, given, FIRST_STEPS), LAST_STEPS)


def _to_search(case: _Case, current: Judged, number: int) -> tuple[int, ...]:
    """Joints on which something may be missing: all at first, then those that are worse than noise would be."""
    joints = case.options.joints or current.point.model.machine.modelled_joints
    if number == 0:
        return joints
    places = current.point.model.machine.modelled_joints
    runs = case.observation.by_joint(current.point.weighted)
    misfit = {j: float(np.mean(np.concatenate(own) ** 2)) for j, own in zip(places, runs, strict=True)}
    return tuple(j for j in joints if misfit[j] > case.thresholds.quiet_joint)


def _ranked_in(
    case: _Case, current: Judged, joints: tuple[int, ...], share: float, progress: Progress, cancel: Cancel,
    earlier: Sequence[Probed],
) -> tuple[Ranking, Judged]:  # fmt: skip
    """The candidates of a turn, and the point that they are compared with: the current one, or a better one that their
    fits have found."""
    if not joints:
        return Ranking((), ()), current
    width = 0.8 / case.options.most_steps

    def tell(done: float, text: str) -> None:
        progress(share + width * done, text)

    options = case.options.model_copy(update={"joints": joints})
    turn = ranked(case.observation, current, options, case.excluded, case.thresholds, tell, cancel, earlier)
    better = deeper(case.observation, current, turn.fitted[0]) if turn.fitted else None
    if better is None:
        return turn, current
    return ranked(case.observation, better, options, case.excluded, case.thresholds, tell, cancel), better


def _turn(
    case: _Case, current: Judged, ranking: Ranking, decision: Decision
) -> tuple[Step | None, Judged]:  # fmt: skip
    """The step that a decision leads to, and where it leaves the model. No step when nothing is significant."""
    best = decision.best
    if decision.kind == "nothing" or best is None:
        return None, current
    observation, model = case.observation, best.judged.point.model
    best = replace(best, judged=judge(observation, settled(observation, best.judged.point, LAST_STEPS)))
    held = _held(case, current.point, best.judged.point)
    held_errors = _held_errors(case, model, *held)
    removed = excess_removed(held_errors)
    rejected = _rejected(case, best, *held, _on(best.candidate.joints, held_errors))
    where = _where(case, current.point)
    values = found_values(observation, best)
    candidates = tuple(listed(r) for r in ranking.fitted) + only_probed(ranking, observation.samples)
    reason = reasons.reason(
        best.candidate.name, best.candidate.joints, values, best.evidence, decision.margin,
        model=_with_point(model, best.judged.point), before=_with_point(current.point.model, current.point),
        records=observation.records, runner_up=runner_up(candidates), left=_left(observation, best.judged.point),
    )  # fmt: skip
    step = Step(
        effect=best.candidate.name, joints=best.candidate.joints, parameters=values, evidence=best.evidence,
        margin=decision.margin, candidates=candidates, group=tuple(listed(r) for r in decision.group),
        rmse_fit=errors(observation, model, current.point.residuals, best.judged.point.residuals, case.floor),
        rmse_holdout=held_errors, excess_removed_holdout=removed,
        sum_lambda2_before=_sum_lambda2(current.point, current.point),
        sum_lambda2_after=_sum_lambda2(best.judged.point, current.point),
        where=where, reason=reason, adopted=rejected is None, rejected_because=rejected,
    )  # fmt: skip
    return step, current if rejected is not None else best.judged


def _held(case: _Case, before: Point, after: Point) -> tuple[Signals, Signals]:
    """Residuals of the held-out traces, before and after; empty where there are no such traces."""
    return ((), ()) if case.held is None else (case.held.residuals(before), case.held.residuals(after))


def _held_errors(case: _Case, model: Model, before: Signals, after: Signals) -> tuple[SignalError, ...]:
    return () if case.held is None else errors(case.held.observation, model, before, after, case.floor_held)


def _on(joints: Sequence[int], found: Sequence[SignalError]) -> tuple[SignalError, ...]:
    """Errors of an effect's own joints; of all, where it is the whole machine's."""
    return tuple(e for e in found if not joints or e.joint in joints)


def _rejected(
    case: _Case, best: Refitted, before: Signals, after: Signals, own: Sequence[SignalError]
) -> str | None:  # fmt: skip
    """Why the step is not taken, if held-out traces speak against it. `own`: their errors on the effect's joints; on
    others, something else may be missing, which the tolerance parameters bend to make up for."""
    if case.held is None:
        return None
    removed = excess_removed(own)
    if removed is not None and removed < 0.0:
        return f"the error on the held-out traces grows, by {-removed:.0%} of what is beyond noise there"
    rise, deviation = case.held.rise(before, after)
    lines, share = case.thresholds, case.held.observation.samples / case.observation.samples
    by_chance = max(lines.worse * deviation, lines.lost * best.evidence * share)
    if rise > min(by_chance, best.evidence - lines.significant):
        return (
            f"the error on the held-out traces rises: its sum of squares by {rise:.0f} ± {deviation:.0f} variances of "
            "a reading"
        )
    return None


def _unexplained(case: _Case, model: Model, first: Judged, current: Judged, steps: Sequence[Step]) -> tuple[int, ...]:
    """Joints on which something is left, on fitted or held-out traces. What has been added may raise the floor: noise
    decides where in its play a joint comes to rest."""
    before, after, named = first.point, current.point, any(s.adopted for s in steps)
    if named:
        floor = np.maximum(case.floor, noise_floor(case.observation, after))
        held = case.floor_held if case.held is None else np.maximum(case.floor_held, case.held.floor(after))
        case = replace(case, floor=floor, floor_held=held)
    fitted = errors(case.observation, model, before.residuals, after.residuals, case.floor)
    held_errors = _held_errors(case, model, *_held(case, before, after))
    joints = len(case.floor)
    judged = 0 if case.held is None else case.held.observation.samples
    counts = case.observation.samples // joints, judged // joints
    return unexplained(fitted, held_errors, case.thresholds, named=named, samples=counts)


def _left(observation: Observation, point: Point) -> Left:
    """Measured − simulated of any model with the noise and the starts of a point: an effect is taken out, all else
    stays."""
    kept = [k for k, u in enumerate(point.unknowns) if u.name not in point.model.by_name]
    unknowns, values = [point.unknowns[k] for k in kept], point.values[kept]
    return lambda model: observation.residuals(model, unknowns, values, point.noise)


def _sum_lambda2(point: Point, before: Point) -> float:
    """Σλ² of the distortion method over the parameters that were there before a step: at 1 or more, deviations as large
    as expected explain what is left."""
    known = {u.name for u in before.unknowns}
    kept = [k for k, u in enumerate(point.unknowns) if u.name in known]
    names = [point.unknowns[k].name for k in kept]
    return sum_of_contributions(_with_point(point.model, point), names, point.weighted, point.tangents[kept])


def _where(case: _Case, point: Point) -> Where:
    return located(
        _with_point(point.model, point), case.observation.records, point.residuals, case.observation.deviations
    )


def _remaining(case: _Case, point: Point) -> tuple[RemainingShape, ...]:
    model = _with_point(point.model, point)
    return shapes(model, case.observation.records, point.residuals, case.observation.deviations)


def _with_point(model: Model, point: Point) -> Model:
    """The model with a point's values, where they are parameters of it."""
    named = {u.name: float(v) for u, v in zip(point.unknowns, point.values, strict=True) if u.name in model.by_name}
    return model.with_values(named)


def _adopted(model: Model, point: Point, names: tuple[str, ...]) -> Model:
    fit = {"misfit": point.misfit, "fitted": [u.name for u in point.unknowns if u.name in point.model.by_name]}
    lineage = Lineage(parent=model.identity, traces=names, fit=fit, note="diagnosis")
    return _with_point(point.model, point).with_lineage(lineage)


def _controller_step(model: Model, observation: Observation, finding: ControllerFinding) -> Step:
    """A step that the recorded controller's own numbers prove; nothing was fitted for it."""
    part = "relative" if finding.effect == "wrong_gain" else "share"
    name = f"joint{finding.joint}.{finding.effect}.{part}"
    value = FoundValue(value=finding.value, low=finding.low, high=finding.high, unit="1")
    evidence = float(finding.samples)
    proof = Candidate(
        effect=finding.effect, joints=(finding.joint,), evidence=evidence, parameters={name: value}, refitted=False
    )
    share = f"{finding.samples} of {finding.of} samples"
    if finding.effect == "wrong_gain":
        said = f"the recorded power is {1 + finding.value:.3f} times the gain times the recorded error ({share})"
    else:
        said = f"the recorded error is not set point − position in {finding.samples} samples: set points were lost"
    quiet: Signals = tuple(np.zeros_like(r.measured) for r in observation.records)
    where = Where(joint=finding.joint, phase=None, summary=f"joint {finding.joint}: {said}", cells=(), dependences=())
    return Step(
        effect=finding.effect, joints=(finding.joint,), parameters={name: value}, evidence=evidence, margin=evidence,
        candidates=(proof,), rmse_fit=errors(observation, model, quiet, quiet, observation.deviations), where=where,
        reason=f"joint {finding.joint}: {said}; this needs no model of the arm", adopted=True,
    )  # fmt: skip


def _summary(
    case: _Case, current: Judged, answered: Verdict, steps: Sequence[Step], remaining: Sequence[RemainingShape]
) -> str:
    if answered == "nothing-significant":
        return reasons.nothing(next((s for s in steps if not s.adopted and s.effect is not None), None))
    if answered == "named":
        return "; ".join(s.reason for s in steps if s.adopted)
    if answered == "ambiguous":
        return reasons.undecided(steps[-1].group, steps[-1].where)
    return reasons.unexplained(_where(case, current.point), remaining)


def _notes(case: _Case) -> tuple[str, ...]:
    found = [f"tolerance parameters: {len(case.names)} trace(s), priors as the machine file states them"]
    if case.held is None:
        found.append("no held-out trace was given: nothing here has been shown on data it was not fitted to")
    return tuple(found)
