"""The whole workflow: where, what, add, show, and again until nothing significant is left."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import NoController
from daq.contracts.progress import Cancel, Never, Progress, silent
from daq.contracts.trace import Trace
from model.discrepancy.candidates.decision import Added, decide
from model.discrepancy.candidates.estimates import listed, only_probed
from model.discrepancy.candidates.probing import Probed
from model.discrepancy.candidates.ranking import Ranking, ranked
from model.discrepancy.diagnosis import Candidate, Diagnosis, RemainingShape, SignalError, Step, Verdict, Where
from model.discrepancy.experiment_design.next_experiment import Asked, Asker, rivals_of
from model.discrepancy.explanation import reasons
from model.discrepancy.explanation.notes import (
    ERRORS_FOLLOW,
    NOTHING_HELD_OUT,
    on_tolerances,
    on_unfinished,
    on_what_is_stated,
)
from model.discrepancy.localisation.statistics import chance_significance
from model.discrepancy.options import DiagnosisOptions, check_options
from model.discrepancy.output_error.case import Case, with_point
from model.discrepancy.output_error.controller_evidence import (
    ControllerFinding,
    check_controller,
    judged_by_records,
    with_findings,
    with_used_set_points,
)
from model.discrepancy.output_error.feedback_share import FOLLOWING_FOR_ERRORS
from model.discrepancy.output_error.holdout import HeldOut, held_out
from model.discrepancy.output_error.last_fit import as_last_fitted
from model.discrepancy.output_error.noise_floor import noise_floor
from model.discrepancy.output_error.observation import Observation, observed
from model.discrepancy.output_error.proved import proved_step
from model.discrepancy.output_error.refitting import Judged, Refitted, deeper, judge
from model.discrepancy.output_error.search import Point, point_at, searched, settled
from model.discrepancy.output_error.step import LAST_STEPS, step_of
from model.discrepancy.thresholds import THRESHOLDS
from model.discrepancy.verdict import first_to_withdraw, unexplained, verdict, withdrawn
from model.fitting.unknowns import Unknown
from model.machine_model.model import Lineage, Model

CHANCES = 3
"""Candidates of a turn that held-out traces may refuse, until there is nothing more to look for."""
NEARER = (0.0, 0.5)
"""Shares of the record that are followed on the way to a first fit."""
FIRST_STEPS = 6
"""Of a search before its derivatives are computed anew."""


@dataclass(frozen=True)
class _Found:
    """What the turns so far have found.

    first: the fit before any effect was added. current: the fit now. steps: one a turn that had something to say.
    before: where each of them began. rivals: answers that came close to the last effect added. probes: all so far.
    tried: the ranking of the last turn, where it added nothing. ended: whether there is nothing more to look for.
    """

    first: Judged
    current: Judged
    steps: tuple[Step, ...] = ()
    before: tuple[Judged, ...] = ()
    rivals: tuple[Refitted, ...] = ()
    probes: tuple[Probed, ...] = ()
    tried: Ranking | None = None
    ended: bool = False

    @property
    def added(self) -> list[Added]:
        """The effects in the current fit."""
        return [Added(s.effect, s.joints, s.evidence) for s in self.steps if s.adopted]


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
    check_options(options, model)
    _refuse_shared(traces, holdout)
    if isinstance(model.machine.controller, NoController) or any(t.set_point is None for t in traces):
        from model.discrepancy.inverse_dynamics.diagnose import (
            diagnose_torques,  # here: rigs with a controller need none
        )

        return diagnose_torques(model, traces, holdout, options, progress, cancel)
    progress(0.0, "checking the controller's own numbers")
    findings = check_controller(traces, model.machine, model)
    known, judged = with_findings(model, findings), judged_by_records(traces, model.machine)
    traces, holdout = tuple(_used(t, findings) for t in traces), tuple(_used(t, findings) for t in holdout)
    progress(0.02, "fitting the tolerance parameters")
    observation, wider, unknowns = observed(known, traces)
    given = _given(observation, wider, unknowns)
    point = _tolerances(observation, given)
    case = _case(observation, held_out(known, holdout), point, traces, options, judged)
    found = _searched(case, judge(observation, point), progress, cancel)
    progress(0.95, "writing the answer")
    proved = tuple(proved_step(model, observation, f) for f in findings)
    answer = _answer(case, model, given, found, proved, ask, tuple(holdout))
    progress(1.0, "done")
    return answer.model_copy(update={"seconds": time.perf_counter() - begun})


def _answer(
    case: Case, model: Model, given: Point, found: _Found, proved: tuple[Step, ...], ask: Asker | None,
    holdout: tuple[Trace, ...],
) -> Diagnosis:  # fmt: skip
    """What the turns have come to, and what is taken back of it. The time that it took is not known here."""
    looked = None if found.added else case.where(found.current.point)
    left = _unexplained(case, found, looked)
    answered = verdict((*proved, *found.steps), unexplained=bool(left))
    if answered == "unknown-effect":
        found = _taken_back(found, left)
    current, steps = as_last_fitted(case.observation, found.current, found.steps)
    found, end = replace(found, current=current, steps=steps), current.point
    where = case.where(end, moving=False) if looked is None else looked  # nothing was added: it is the same point
    remaining = case.remaining(end) if answered == "unknown-effect" else ()
    asked = Asked(None) if ask is None else ask.after(answered, case.observation, end, found.rivals, case.traces)
    notes = (
        *on_what_is_stated(_stated(end), {u.name: float(v) for u, v in zip(end.unknowns, end.values, strict=True)}),
        on_tolerances(len(case.traces)), ERRORS_FOLLOW,
        *on_unfinished((*case.traces, *holdout)), *(() if holdout else (NOTHING_HELD_OUT,)),
        *(() if asked.note is None else (asked.note,)),
    )  # fmt: skip
    held = case.held_errors(end.model, *case.held_residuals(given, end))
    return Diagnosis(
        verdict=answered, summary=_summary(found, answered, proved, where, remaining, left, held),
        steps=(*proved, *found.steps), where=where, candidates=_candidates(case, found), remaining=remaining,
        model_before=model, model_after=_with_lineage(model, end, case.names),
        traces=case.names, holdout=tuple(t.record.trace_id for t in holdout),
        rmse_fit=case.fitted_errors(given, end), rmse_holdout=held,
        significant=case.thresholds.significant, seconds=0.0,
        robot_seconds=float(sum(t.time[-1] - t.time[0] for t in case.traces)),
        notes=notes, next_experiment=asked.experiment,
    )  # fmt: skip


def _case(
    observation: Observation, held: HeldOut | None, point: Point, traces: tuple[Trace, ...],
    options: DiagnosisOptions, excluded: tuple[str, ...],
) -> Case:  # fmt: skip
    told = observation.following(FOLLOWING_FOR_ERRORS)
    return Case(
        observation, told, noise_floor(told, point), held, np.zeros(0) if held is None else held.floor(point), traces,
        options, THRESHOLDS, excluded,
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


def _given(observation: Observation, model: Model, unknowns: Sequence[Unknown]) -> Point:
    """The model as it was given, to begin from: its derivatives are left at zero. Effects proved by the controller's
    numbers stay as they are."""
    free = tuple(u for u in unknowns if ".wrong_gain." not in u.name)
    values = np.array([u.start for u in free])
    return point_at(observation, model, free, values, np.zeros((len(free), observation.samples)))


def _tolerances(observation: Observation, given: Point) -> Point:
    """The tolerance parameters fitted to the end: what they leave undone would look like an effect. In closed loop
    first, where a model that is far off does not run away from the record; from where that came to the brink of
    instability, as a strong effect can bring it, from the model as it was given."""
    near = given
    for share in NEARER:
        near = _followed(observation.following(share), near) or near
    begun = _followed(observation, near) or _followed(observation, given)
    if begun is None:
        raise SpecError("the simulation does not stay finite: the loop is unstable")
    return settled(observation, begun, LAST_STEPS)


def _followed(observation: Observation, point: Point) -> Point | None:
    """Where a search from a point's values leads; None where no simulation there stays finite."""
    try:
        begun = point_at(observation, point.model, point.unknowns, point.values)
        return searched(observation, begun, FIRST_STEPS) if np.isfinite(begun.weighted).all() else None
    except SpecError:
        return None


def _searched(case: Case, begun: Judged, progress: Progress, cancel: Cancel) -> _Found:
    """Turns until nothing significant is left, or what is left cannot be named, or there have been enough."""
    found, width = _Found(begun, begun), 0.8 / case.options.most_steps
    for number in range(case.options.most_steps):

        def tell(done: float, text: str, begin: float = 0.1 + number * width) -> None:
            progress(begin + width * done, text)

        found = _after_turn(case, found, tell, cancel)
        if found.ended:
            break
    return found


def _after_turn(case: Case, found: _Found, progress: Progress, cancel: Cancel) -> _Found:
    """The best that held-out traces do not refuse, of the first few that fitted ones speak for."""
    turn, current = _ranked(case, found, progress, cancel)
    found = replace(found, current=current, probes=(*found.probes, *turn.probed), tried=turn)
    if not found.added:
        found = replace(found, first=current)
    for _ in range(CHANCES):
        decision = decide(turn, case.thresholds, found.added)
        step, following = step_of(case, current, turn, decision)
        if step is None:
            break
        found = replace(found, steps=(*found.steps, step), before=(*found.before, current))
        if step.adopted:
            rivals = rivals_of(turn, decision)
            return replace(found, current=following, rivals=rivals, tried=None, ended=bool(step.group))
        turn = replace(turn, fitted=tuple(f for f in turn.fitted if f is not decision.best))
    return replace(found, ended=True)


def _ranked(case: Case, found: _Found, progress: Progress, cancel: Cancel) -> tuple[Ranking, Judged]:
    """The candidates of a turn, and the point that they are compared with: the current one, or a better one that their
    fits have found."""
    observation, current = case.observation, found.current
    turn = ranked(
        observation, current, case.options, case.excluded, case.thresholds, progress, cancel, found.probes
    )  # fmt: skip
    better = deeper(observation, current, turn.fitted[0]) if turn.fitted else None
    if better is None:
        return turn, current
    return ranked(observation, better, case.options, case.excluded, case.thresholds, progress, cancel), better


def _unexplained(case: Case, found: _Found, where: Where | None) -> tuple[int, ...]:
    """Joints on which something is left, on fitted or held-out traces. where: of the current point, while no effect has
    been added."""
    before, after, named = found.first.point, found.current.point, where is None
    if named:
        case = case.with_floors_of(after)
    held_errors = case.held_errors(after.model, *case.held_residuals(before, after))
    joints = len(case.floor)
    judged = 0 if case.held is None else case.held.observation.samples
    counts = case.observation.samples // joints, judged // joints
    left = unexplained(case.fitted_errors(before, after), held_errors, case.thresholds, named=named, samples=counts)
    if where is None:
        return left
    closer = unexplained(case.errors_of_fits(after), (), case.thresholds, named=False, samples=counts)
    line = chance_significance(len(where.cells), case.thresholds.place)
    places = [c.joint for c in where.cells if c.significance >= line]
    return tuple(sorted({*left, *closer, *places}))


def _taken_back(found: _Found, left: Sequence[int]) -> _Found:
    """What was found before the search took a wrong way."""
    wrong = first_to_withdraw(found.steps, left)
    if wrong is None:
        return found
    steps = (*found.steps[:wrong], *(withdrawn(s, left) for s in found.steps[wrong:]))
    return replace(found, current=found.before[wrong], steps=steps, tried=None)  # it was tried against another point


def _candidates(case: Case, found: _Found) -> tuple[Candidate, ...]:
    """What was tried against what is left: fitted candidates by evidence, then those that were only probed."""
    tried = found.tried
    return () if tried is None else (*map(listed, tried.fitted), *only_probed(tried, case.observation))


def _stated(point: Point) -> list[Unknown]:
    """The numbers of the machine itself that a fit may change: no effect's, and no start."""
    known = point.model.by_name
    return [u for u in point.unknowns if u.name in known and known[u.name].effect is None]


def _with_lineage(model: Model, point: Point, names: tuple[str, ...]) -> Model:
    """The model of the last fit, and what it came from."""
    fit = {"misfit": point.misfit, "fitted": [u.name for u in point.unknowns if u.name in point.model.by_name]}
    return with_point(point).with_lineage(Lineage(parent=model.identity, traces=names, fit=fit, note="diagnosis"))


def _summary(
    found: _Found, answered: Verdict, proved: Sequence[Step], where: Where, remaining: Sequence[RemainingShape],
    left: Sequence[int], held: Sequence[SignalError],
) -> str:  # fmt: skip
    steps = (*proved, *found.steps)
    if answered == "nothing-significant":
        return reasons.nothing(next((s for s in steps if not s.adopted), None))
    if answered == "named":
        return "; ".join(s.reason for s in steps if s.adopted)
    if answered == "ambiguous":
        return reasons.undecided(steps[-1].group, steps[-1].where)
    return reasons.unexplained(where, remaining, left, held=held)
