"""A diagnosis by output error: locate, try, add and show what an effect brings, until nothing significant is left."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.progress import Cancel, Progress
from daq.contracts.trace import Trace
from model.discrepancy.candidates.candidate_fit import CandidateFit, Fit, improved_baseline, judge
from model.discrepancy.candidates.probing import Probe
from model.discrepancy.candidates.ranking import Ranking, decide, rank
from model.discrepancy.diagnosis import UNWRITTEN, Candidate, Diagnosis, Step, Where
from model.discrepancy.experiment_design.next_experiment import Asked, ExperimentChooser, rivals_of
from model.discrepancy.explanation.answer_words import with_sentences
from model.discrepancy.explanation.notes import on_stated_numbers, on_unfinished
from model.discrepancy.grounds import ControllerEffect, Note
from model.discrepancy.localisation.statistics import chance_significance
from model.discrepancy.localisation.structure import joints_with_structure
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.output_error.calibration import Calibration
from model.discrepancy.output_error.case import Case, Watch, build_case, closed_loop_gap, errors_of_fit
from model.discrepancy.output_error.controller_evidence import judge_controller, with_used_set_points
from model.discrepancy.output_error.holdout import hold_out
from model.discrepancy.output_error.noise_model import note_on_noise, shown_noise
from model.discrepancy.output_error.observation import Observation, observe
from model.discrepancy.output_error.sampled_controller import with_errors
from model.discrepancy.output_error.search import FEW_STEPS, Point, converge, descend, point_at
from model.discrepancy.selection.step import listed, make_step, only_probed, update_to_last_fit
from model.discrepancy.thresholds import CHANCES, FEEDBACK_SHARE_FOR_ERRORS
from model.discrepancy.verdict import first_to_withdraw, unexplained, verdict, withdrawn, worse_held_out
from model.effects.names import effect_on
from model.fitting.unknowns import Unknown
from model.machine_model.model import Lineage, Model
from model.machine_model.parameter import Kind
from model.machine_model.record_verdict import FAR_OFF

NOISE_ROUNDS = 2
"""Fits with the noise that the one before has left."""
SHORT_DISTANCE = 0.3
"""Share of the expected distance over which friction builds up, below which a fit is tried with sudden friction too."""


def diagnose_by_simulation(
    model: Model,
    traces: Sequence[Trace],
    holdout: Sequence[Trace],
    options: DiagnosisOptions,
    progress: Progress,
    cancel: Cancel,
    chooser: ExperimentChooser | None,
    watch: Watch | None = None,
) -> Diagnosis:
    """The answer to traces with set points from a machine with a controller, as `workflow.diagnose` describes."""
    begun = time.perf_counter()
    progress(0.0, "checking the controller's own numbers")
    traces, holdout = (with_errors(some, model.machine) for some in (traces, holdout))
    controller = judge_controller(model, traces)
    excluded = controller.settled
    if any(f.effect is ControllerEffect.LOST_SET_POINTS for f in controller.findings):
        # The set points that were used are known to the count.
        traces, holdout = (tuple(map(with_used_set_points, some)) for some in (traces, holdout))
    progress(0.02, "fitting the tolerance parameters")
    known = controller.with_findings(model)
    given = _given_point(*observe(known, traces, held_out=[t.record.trace_id for t in holdout]))
    if given.observation.drive_is_input:
        # The plant gets the drive that was recorded, whatever the controller has done.
        excluded = tuple(effect.value for effect in ControllerEffect)
    fitted = _weighed_with_shown_noise(_fit_tolerances(given))
    case = build_case(model, given, fitted, traces, hold_out(known, holdout), options, excluded, watch)
    first = judge(fitted)
    search = _add_effects(case, _Search(first=first, current=first), progress, cancel)
    progress(0.95, "writing the answer")
    answer = _answer(case, search, controller.steps, chooser, cancel)
    progress(1.0, "done")
    return answer.model_copy(update={"seconds": time.perf_counter() - begun})


@dataclass(frozen=True)
class _Search:
    """The state of the search for missing effects.

    Args:
        first: the fit before any effect was added.
        current: the fit now.
        steps: one for every ranking with something to say.
        before: the fit that each step began from.
        rivals: candidates close to the last added effect; where there is a group, of the last group.
        probes: all so far.
        tried: the last ranking, where nothing was added.
        ended: whether the search is over.
    """

    first: Fit
    current: Fit
    steps: tuple[Step, ...] = ()
    before: tuple[Fit, ...] = ()
    rivals: tuple[CandidateFit, ...] = ()
    probes: tuple[Probe, ...] = ()
    tried: Ranking | None = None
    ended: bool = False

    @property
    def added(self) -> list[Step]:
        """The steps of the effects in the current fit."""
        return [s for s in self.steps if s.adopted]

    @property
    def taken(self) -> list[tuple[Step, Point]]:
        """The steps in the current fit, each with the point after it."""
        after = [*self.before[1:], self.current]
        adopted = [k for k, step in enumerate(self.steps) if step.adopted]
        return [(self.steps[k], (self.current if k == adopted[-1] else after[k]).point) for k in adopted]


def _given_point(observation: Observation, given: Calibration) -> Point:
    """The model as it was given; its derivatives are left at zero. Wrong gains, which the controller's own numbers
    prove, stay as they are."""
    free = [k for k, u in enumerate(given.unknowns) if not u.parameter.is_gain_error]
    return point_at(observation, given.only(free), np.zeros((len(free), observation.samples)))


def _fit_tolerances(given: Point) -> Point:
    """The tolerance parameters fitted to the end, because their remaining error would look like an effect.

    The closed loop is fitted first, which is robust far from the solution. If that leads to instability, as a strong
    effect can, the fit starts again from the given model.
    """
    near = given
    for share in (0.0, FEEDBACK_SHARE_FOR_ERRORS):
        near = _fit_with_feedback(near, given.observation.with_feedback_share(share)) or near
    begun = _fit_with_feedback(near, given.observation) or _fit_with_feedback(given, given.observation)
    if begun is None:
        raise SpecError("the simulation does not stay finite: the control loop is unstable")
    return _with_sudden_friction(converge(begun, FEW_STEPS))


def _with_sudden_friction(fitted: Point) -> Point:
    """The fit, or a better one that begins where friction is there at once, on joints where it builds up over a short
    distance: there the cost has valleys, in which a search may end."""
    distances = [k for k, u in enumerate(fitted.unknowns) if u.kind is Kind.PRESLIDING]
    short = [k for k in distances if fitted.values[k] < SHORT_DISTANCE * fitted.unknowns[k].expected]
    values = fitted.values.copy()
    values[short] = [fitted.unknowns[k].low for k in short]
    if np.array_equal(values, fitted.values):
        return fitted
    begun = fitted.moved_to(values)
    tried = converge(begun, FEW_STEPS) if begun.is_finite else fitted
    return tried if tried.cost < fitted.cost else fitted


def _fit_with_feedback(point: Point, observation: Observation) -> Point | None:
    """The point that a search on an observation reaches from another point's values; None if no simulation stays
    finite."""
    try:
        begun = point.on(observation)
        return descend(begun, FEW_STEPS) if begun.is_finite else None
    except SpecError:
        return None


def _weighed_with_shown_noise(fitted: Point) -> Point:
    """The point fitted with the noise that its record shows, where that is more than it was fitted with, and noise.

    Twice, since a fit with too little noise has followed some of it. Where tolerances stay far from what they are
    expected to be, the fit is begun from there as well: with too little noise it may have gone along a valley in which
    records tell little, and a search does not find the way back.
    """
    for _ in range(NOISE_ROUNDS):
        noise = shown_noise(fitted)
        if noise is None:
            break
        observation = replace(fitted.observation, noise=noise)
        try:
            fitted = converge(fitted.on(observation), FEW_STEPS)
            if fitted.strain >= FAR_OFF:
                again = _fit_tolerances(fitted.at_expected())
                fitted = again if again.cost < fitted.cost else fitted
        except SpecError:
            break
    return fitted


def _add_effects(case: Case, search: _Search, progress: Progress, cancel: Cancel) -> _Search:
    """Adds effects until nothing significant is left, until what is left cannot be named, or until the limit of
    steps."""
    width = 0.8 / case.options.most_steps
    for number in range(case.options.most_steps):
        named = ", ".join(effect_on(s.effect, s.joints) for s in search.steps if s.adopted and s.effect)
        so_far = f"found so far: {named}; " if named else ""

        def tell(done: float, text: str, begin: float = 0.1 + number * width, so_far: str = so_far) -> None:
            progress(begin + width * done, f"{so_far}{text}")

        search = _add_effect(case, search, tell, cancel)
        if search.ended:
            break
    return search


def _add_effect(case: Case, search: _Search, progress: Progress, cancel: Cancel) -> _Search:
    """The search after one more ranking: with the best candidate that held-out traces do not refuse, if any."""
    ranking, current = _rank(case, search, progress, cancel)
    search = replace(search, current=current, probes=(*search.probes, *ranking.probed), tried=ranking)
    if not search.added:
        search = replace(search, first=current)
    for _ in range(CHANCES):
        decision = decide(ranking, case.thresholds, search.added)
        step, following = make_step(case, current, ranking, decision)
        if step is None:
            break
        search = replace(search, steps=(*search.steps, step), before=(*search.before, current))
        if step.adopted:
            grouped = any(s.adopted and s.group for s in search.steps[:-1])
            rivals = search.rivals if grouped and not step.group else rivals_of(ranking, decision)
            return replace(search, current=following, rivals=rivals, tried=None)
        ranking = replace(ranking, fitted=tuple(f for f in ranking.fitted if f is not decision.best))
    return replace(search, ended=True)


def _rank(case: Case, search: _Search, progress: Progress, cancel: Cancel) -> tuple[Ranking, Fit]:
    """The candidates, and the fit that they are compared with: the current one, or a better one found through them."""
    ranking = rank(case, search.current, progress, cancel, search.probes)
    better = improved_baseline(search.current, ranking.fitted[0]) if ranking.fitted else None
    if better is None:
        return ranking, search.current
    return rank(case, better, progress, cancel), better


def _answer(
    case: Case, found: _Search, proved: tuple[Step, ...], chooser: ExperimentChooser | None, cancel: Cancel
) -> Diagnosis:
    """The answer of a finished search, with wrong steps withdrawn. The caller fills in the time that it took."""
    looked = None if found.added else case.where(found.current.point)
    joints, noisy = _joints_left(case, found, looked)
    answered = verdict((*proved, *found.steps), unexplained=bool(joints))
    if answered == "unknown-effect":
        found = _withdraw(found, joints)
        if looked is None and not found.added and not proved:
            # What is left without the withdrawn steps is judged as where none was ever found.
            looked = case.where(found.current.point)
            joints, noisy = _joints_left(case, found, looked)
            answered = verdict(found.steps, unexplained=bool(joints))
    current, steps = update_to_last_fit(found.current, found.steps)
    found, end = replace(found, current=current, steps=steps), current.point
    where = case.where(end) if looked is None else looked  # nothing was added: it is the same point
    asked = Asked(None) if chooser is None else chooser.after(answered, end, found.rivals, case.traces, cancel)
    notes = (
        *on_stated_numbers(_stated(end), end.by_name),
        Note(kind="tolerances-fitted-first", values={"traces": len(case.traces)}),
        Note(kind="errors-follow-record", values={"share": FEEDBACK_SHARE_FOR_ERRORS}),
        *note_on_noise(end.observation, case.scoring.rms(case.scored(end)), noisy),
        *on_unfinished((*case.traces, *case.held_traces)),
        *(() if case.held_traces else (Note(kind="nothing-held-out"),)),
        *asked.notes,
    )
    held = case.held_errors(*case.held_residuals(case.given, end))
    unknown = answered == "unknown-effect"
    answer = Diagnosis(
        verdict=answered,
        summary=UNWRITTEN,
        method="output-error",
        unexplained_joints=joints if unknown else (),
        worse_held_out=worse_held_out(held) if unknown else (),
        steps=(*proved, *found.steps),
        where=where,
        candidates=_candidates(found),
        model_before=case.model,
        model_after=_with_lineage(case, end),
        traces=case.names,
        holdout=tuple(t.record.trace_id for t in case.held_traces),
        rmse_fit=case.fitted_errors(case.given, end),
        rmse_holdout=held,
        gap=closed_loop_gap(case, found.first.point, found.taken, end),
        significant=case.thresholds.significant,
        seconds=0.0,
        robot_seconds=float(sum(t.time[-1] - t.time[0] for t in case.traces)),
        notes_data=notes,
        next_experiment=asked.experiment,
        inseparable=asked.inseparable,
    )
    return with_sentences(answer)


def _joints_left(case: Case, found: _Search, where: Where | None) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Joints on which fitted or held-out traces leave more than noise: those with an unexplained error, and those on
    which it is noise. where: the map of the current point, while no effect has been added.

    What a nearly right law of an effect leaves may be without any shape: with an effect, more than noise is an
    unexplained error.
    """
    before, after, effect_added = found.first.point, found.current.point, where is None
    if effect_added:
        case = case.with_floors_of(after)
    held_errors = case.held_errors(*case.held_residuals(case.credited_against(before, after), after))
    joints = len(case.floor)
    judged = 0 if case.held is None else case.held.observation.samples
    counts = case.scoring.samples // joints, judged // joints
    left = unexplained(
        case.fitted_errors(before, after), held_errors, case.thresholds, named=effect_added, samples=counts
    )
    if where is None:
        return left, ()
    closer = unexplained(errors_of_fit(after), (), case.thresholds, named=False, samples=counts)
    line = chance_significance(len(where.cells), case.thresholds.place)
    places = [c.joint for c in where.cells if c.significance >= line]
    return _by_structure(case, after, tuple(sorted({*left, *closer, *places})))


def _by_structure(case: Case, point: Point, joints: tuple[int, ...]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """These joints: those on which what is left has a shape, on the fitted traces or on held-out ones, and those on
    which it is noise, larger than the file states."""
    if not joints:
        return (), ()
    found = {*joints_with_structure(case.residuals_of(point)), *joints_with_structure(case.held_residuals_of(point))}
    return tuple(j for j in joints if j in found), tuple(j for j in joints if j not in found)


def _withdraw(found: _Search, unexplained_joints: Sequence[int]) -> _Search:
    """The search before its first step on a joint that stays unexplained."""
    wrong = first_to_withdraw(found.steps, unexplained_joints)
    if wrong is None:
        return found
    steps = (*found.steps[:wrong], *(withdrawn(s, unexplained_joints) for s in found.steps[wrong:]))
    return replace(found, current=found.before[wrong], steps=steps, tried=None)  # it was tried against another point


def _candidates(found: _Search) -> tuple[Candidate, ...]:
    """The last ranking, where nothing was added: fitted candidates by evidence, then those that were only probed."""
    tried, observation = found.tried, found.current.point.observation
    return () if tried is None else (*map(listed, tried.fitted), *only_probed(tried, observation))


def _stated(point: Point) -> list[Unknown]:
    """The numbers of the machine itself that a fit may change: no effect's, and no initial posture."""
    known = point.model.by_name
    return [u.as_stated for u in point.unknowns if u.name in known and known[u.name].effect is None]


def _with_lineage(case: Case, point: Point) -> Model:
    """The model of the last fit, and where it comes from."""
    fit = {"misfit": point.misfit, "fitted": [u.name for u in point.unknowns if u.name in point.model.by_name]}
    lineage = Lineage(parent=case.model.identity, traces=case.names, fit=fit, note="diagnosis")
    return point.fitted_model.with_lineage(lineage)
